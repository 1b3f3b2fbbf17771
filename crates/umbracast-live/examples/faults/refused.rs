//! Files of another shape than the run needs: each must be refused before the run begins, in words that say what was expected.

use std::fs;
use std::path::Path;

use umbracast::lidar::Packet;
use umbracast::{Error, Health, STEP_NS, Site};
use umbracast_io::recording::RecordingWriter;
use umbracast_io::{input, setup};

use super::hall::{Hall, empty_packets};

/// The weights of the paper's network and of the residual.
const PAPER_LSTM: &[u8] = include_bytes!("../../../../models/paper_lstm.safetensors");
const RESIDUAL: &[u8] = include_bytes!("../../../../models/residual.safetensors");

/// A row for each; the names of those that were not refused, or not in these words.
pub fn cases(hall: &Hall) -> Result<Vec<&'static str>, Error> {
    let folder = std::env::temp_dir().join(format!("umbracast-shapes-{}", std::process::id()));
    fs::create_dir_all(&folder).map_err(|e| Error::new(e.to_string()).within(folder.display()))?;
    let outcome = all(hall, &folder);
    let _ = fs::remove_dir_all(&folder); // A temporary folder; what stays there hurts nobody.
    outcome
}

fn all(hall: &Hall, folder: &Path) -> Result<Vec<&'static str>, Error> {
    let site = &hall.config.site;
    let weights = |bytes: &[u8]| {
        let file = folder.join("weights.safetensors");
        setup::write(&file, bytes)?;
        Ok(setup::weights(Some(&file)).err())
    };
    let empty = |change: fn(&mut Site), sensors: usize| {
        let mut other = site.clone();
        change(&mut other);
        let file = folder.join("empty.mcap");
        record_empty(&file, hall, &other, sensors)?;
        let frames = input::empty_hall(&[file], site, &[])
            .and_then(|empty| empty.empty_frames(site, &[0, 1], &mut Health::default()));
        Ok(frames.err())
    };
    type Refused = Result<Option<Error>, Error>;
    let cases: [(&'static str, &str, Refused); 7] = [
        ("weights of another network", "emb.weight", weights(RESIDUAL)),
        ("weights of another size", "[5, 512]", weights(&narrowed(PAPER_LSTM))),
        ("weights cut in half", "weights", weights(&PAPER_LSTM[..PAPER_LSTM.len() / 2])),
        (
            "the empty hall of a VLP-16",
            "vlp-16",
            empty(|site| site.sensors.iter_mut().for_each(|sensor| sensor.model = "vlp-16".to_owned()), 2),
        ),
        (
            "the empty hall of an Ouster",
            "os0-32",
            empty(|site| site.sensors.iter_mut().for_each(|sensor| sensor.model = "os0-32".to_owned()), 2),
        ),
        ("the empty hall, one sensor silent", "lidar_west", empty(|_| (), 1)),
        (
            "the empty hall of sensors with other names",
            "lidar_east",
            empty(|site| site.sensors.iter_mut().for_each(|sensor| sensor.name.push_str("_2")), 2),
        ),
    ];
    println!("\n{:43} {:40} what happened", "what is given", "what must happen");
    let mut wrong = Vec::new();
    for (name, word, refused) in cases {
        let told = refused?.map(|error| error.to_string().replace(&folder.display().to_string(), "..."));
        wrong.extend((!told.as_ref().is_some_and(|told| told.contains(word))).then_some(name));
        println!(
            "{name:43} {:40} {}",
            format!("refused, {word} is named"),
            told.as_deref().unwrap_or("taken")
        );
    }
    Ok(wrong)
}

/// Half of the values of one tensor of weights, by its head alone: the length stays.
fn narrowed(weights: &[u8]) -> Vec<u8> {
    let (from, to) = (b"\"shape\":[5,512]", b"\"shape\":[10,256]");
    let at = weights.windows(from.len()).position(|part| part == from).unwrap_or_default();
    // One byte more stands in the head, and one less of the spaces that fill it.
    let mut narrowed = [&weights[..at], to, &weights[at + from.len()..]].concat();
    let fill = narrowed.iter().position(|&byte| byte == b' ').unwrap_or_default();
    narrowed.remove(fill);
    narrowed
}

/// Two seconds of a hall without people as `live --record` keeps them, of its first sensors.
fn record_empty(file: &Path, hall: &Hall, site: &Site, sensors: usize) -> Result<(), Error> {
    let config = umbracast::Config { site: site.clone(), ..hall.config.clone() };
    let packets = empty_packets(site)?;
    let begun_ns = packets.first().map_or(0, |arrived| arrived.packet.time_ns);
    let mut writer = RecordingWriter::create_live(file, &config.to_toml(), site, begun_ns)?;
    for frame in packets.chunk_by(|a, b| a.packet.time_ns / STEP_NS == b.packet.time_ns / STEP_NS) {
        let mut lists: Vec<Vec<Packet>> = vec![Vec::new(); site.sensors.len()];
        for arrived in frame.iter().filter(|arrived| arrived.sensor < sensors) {
            lists[arrived.sensor].push(arrived.packet.clone());
        }
        writer.write_packets(frame[0].packet.time_ns, &lists)?;
    }
    writer.finish()
}
