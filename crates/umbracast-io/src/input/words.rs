//! What the name of a file says: a sensor's name, or that the hall is empty.

use std::path::Path;

use umbracast::Site;

/// Whether a file or folder is named as the hall without people: `empty.mcap`, `empty-east.pcap`, `2024-05-01_empty/`.
pub fn is_empty_hall(path: &Path) -> bool {
    words_of_file(path).iter().any(|word| word == "empty")
}

/// The sensors that a file's name names best: one, as a rule; several where it names them equally well; or none. A sensor is
/// named by all its words, or by all those that other sensors do not share (`east` of `lidar_east`).
pub fn named(file: &Path, site: &Site) -> Vec<usize> {
    let given = words_of_file(file);
    let names: Vec<Vec<String>> = site.sensors.iter().map(|sensor| words(&sensor.name)).collect();
    let is_shared = |word: &String| names.len() > 1 && names.iter().all(|name| name.contains(word));
    let said = |name: &Vec<String>| {
        let own: Vec<&String> = name.iter().filter(|word| !is_shared(word)).collect();
        if name.iter().all(|word| given.contains(word)) {
            name.len()
        } else if own.iter().all(|word| given.contains(word)) {
            own.len()
        } else {
            0
        }
    };
    let scores: Vec<usize> = names.iter().map(said).collect();
    let best = scores.iter().copied().max().unwrap_or(0);
    (0..scores.len()).filter(|&s| best > 0 && scores[s] == best).collect()
}

fn words_of_file(path: &Path) -> Vec<String> {
    words(&path.file_stem().unwrap_or_default().to_string_lossy())
}

/// Runs of letters and runs of digits, in small letters.
fn words(text: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut before = None;
    for c in text.chars() {
        let kind = if c.is_numeric() { Some('0') } else { c.is_alphabetic().then_some('a') };
        if kind.is_some() && kind == before {
            words.last_mut().into_iter().for_each(|word| word.extend(c.to_lowercase()));
        } else if kind.is_some() {
            words.push(c.to_lowercase().collect());
        }
        before = kind;
    }
    words
}

#[cfg(test)]
mod tests {
    use umbracast::Config;

    use super::*;

    fn named_among(file: &str, sensors: &[&str]) -> Vec<usize> {
        let mut site = Config::default().site;
        let sensor = site.sensors[0].clone();
        site.sensors = sensors
            .iter()
            .map(|name| umbracast::site::Sensor { name: (*name).to_owned(), ..sensor.clone() })
            .collect();
        named(Path::new(file), &site)
    }

    #[test]
    fn a_file_names_a_sensor_by_the_words_that_only_this_one_has() {
        let two = ["lidar_west", "lidar_east"];
        assert_eq!(named_among("captures/east.pcap", &two), [1]);
        assert_eq!(named_among("Lidar West 12.pcap", &two), [0]);
        assert_eq!(named_among("scene-0000-lidar_east.pcap", &two), [1]);
        assert!(named_among("lidar.pcap", &two).is_empty());
        assert_eq!(named_among("east-west.pcap", &two), [0, 1]);
        assert!(named_among("eastern.pcap", &two).is_empty());
        assert_eq!(named_among("left-back.pcap", &["left", "left back"]), [1]);
        assert_eq!(named_among("left.pcap", &["left", "left back"]), [0]);
        assert_eq!(named_among("lidar2.pcap", &["lidar 1", "lidar 2"]), [1]);
        assert_eq!(named_among("above the door.pcap", &["above the door"]), [0]);
    }

    #[test]
    fn the_empty_hall_is_named_by_a_word_of_its_own() {
        for (name, is_empty) in [
            ("empty.mcap", true),
            ("empty-lidar_east.pcap", true),
            ("east_Empty2.pcap", true),
            ("a/empty/", true),
            ("empty/east.pcap", false),
            ("emptying.pcap", false),
        ] {
            assert_eq!(is_empty_hall(Path::new(name)), is_empty, "{name}");
        }
    }
}
