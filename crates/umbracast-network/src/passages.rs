//! The shape of real fades beside that of the models: recorded passages of people through radio links, of which neither places nor
//! speeds are known.
//!
//! The file is the table of IMMERSE (TU Dortmund 2024, CC BY 4.0): a row for each passage, modem and receive chain, with the power
//! run-length coded. Of each link the passages with even places choose two numbers, how long a body takes through the link and
//! through its Fresnel zone. The others are compared with the model of these two numbers, where only the time of the fade is free.

use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};

use umbracast::Error;

/// Who passes.
const MODE: &str = "pedestrian_track1";
/// Samples between two synchronisation blocks of the 5G cell, 20 ms apart, for these passages: held values change so often.
const BLOCK_SAMPLES: f64 = 18.2;
/// Seconds between two blocks.
const BLOCK_S: f64 = 0.02;
/// No passage is longer: 18 minutes.
const SAMPLES_MAX: usize = 1_000_000;
/// A fade is deeper, dB; and so many blocks before and after its middle are looked at: 400 ms.
const FADE_DB: f64 = 6.0;
const ABOUT: usize = 20;
/// The fade may be so much earlier or later than the deepest block, in blocks and in parts of one.
const SHIFT: usize = 5;
const PARTS: usize = 4;
/// Nothing loses more, as a share of the field.
const LEAST_FIELD: f64 = 1e-4;

/// One link: a modem and a receive chain.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// As the file names them.
    pub link: String,
    /// Passages that were compared.
    pub passages: usize,
    /// Half the time that the body is in the line, and the time that it takes through the Fresnel zone's scale, seconds.
    pub half_s: f64,
    /// See `half_s`.
    pub zone_s: f64,
    /// Root of the mean squared difference with the model, with the mean fade of the other passages, and with no fade, dB.
    pub rmse_db: [f64; 3],
}

/// One row of the file.
#[derive(Debug, Deserialize)]
struct Row {
    mode: String,
    modem: String,
    metric: String,
    rsrp_dbm_runs: String,
}

/// Compares every link of a file's text; `name` is the file's for errors.
///
/// # Errors
/// A column that is missing, a run that is none, no passage with a fade.
pub fn compare(text: &str, name: &str) -> Result<Vec<Shape>, Error> {
    let mut fades: BTreeMap<String, Vec<Vec<f64>>> = BTreeMap::new();
    let mut rows = csv::Reader::from_reader(text.as_bytes());
    for (i, row) in rows.deserialize().enumerate() {
        let at = |what: String| Error::new(format!("{name}, line {}: {what}", i + 2));
        let row: Row = row.map_err(|e| at(format!("expected mode, modem, metric and rsrp_dbm_runs: {e}")))?;
        if row.mode == MODE && row.metric.starts_with("5G") {
            let blocks_db = decoded(&row.rsrp_dbm_runs).map_err(at)?;
            let of_link = fades.entry(format!("{} {}", row.modem, row.metric)).or_default();
            of_link.extend(about_fade(&blocks_db));
        }
    }
    fades.retain(|_, passages| passages.len() >= 2);
    if fades.is_empty() {
        return Err(Error::new(format!(
            "{name}: expected passages of mode {MODE} with 5G fades of {FADE_DB} dB, found none"
        )));
    }
    Ok(fades.iter().map(|(link, passages)| shape(link, passages)).collect())
}

/// Loss by block, dB below the passage's median, which is in sight.
fn decoded(runs: &str) -> Result<Vec<f64>, String> {
    let mut samples: Vec<f64> = Vec::new();
    for run in runs.split_whitespace() {
        let wrong = || format!("expected VALUExCOUNT, found {run:?}");
        let (value, count) = run.rsplit_once('x').ok_or_else(wrong)?;
        let (value, count): (f64, usize) =
            (value.parse().map_err(|_| wrong())?, count.parse().map_err(|_| wrong())?);
        if samples.len().saturating_add(count) > SAMPLES_MAX {
            return Err(wrong());
        }
        // A report that is missing holds the one before.
        let held = if value.is_finite() { value } else { samples.last().copied().unwrap_or(f64::NAN) };
        samples.extend(std::iter::repeat_n(held, count));
    }
    let first =
        samples.iter().copied().find(|value| value.is_finite()).ok_or("expected a power, found none")?;
    let block = |i: usize| Some(samples.get(((i as f64 + 0.5) * BLOCK_SAMPLES) as usize)?.max(f64::MIN));
    let blocks: Vec<f64> = (0..).map_while(block).map(|db| if db == f64::MIN { first } else { db }).collect();
    let mut sorted = blocks.clone();
    sorted.sort_by(f64::total_cmp);
    let in_sight_db = sorted.get(sorted.len() / 2).copied().unwrap_or(first);
    Ok(blocks.into_iter().map(|db| in_sight_db - db).collect())
}

/// The blocks about the deepest place of a passage, with room to shift; `None` where nothing fades or the fade is cut off.
fn about_fade(blocks_db: &[f64]) -> Option<Vec<f64>> {
    let (room, three) = (ABOUT + SHIFT, |i: usize| blocks_db[i - 1..=i + 1].iter().sum::<f64>());
    let middle = (room.max(1)..blocks_db.len().checked_sub(room + 1)?)
        .max_by(|a, b| three(*a).total_cmp(&three(*b)))?;
    (blocks_db[middle] >= FADE_DB).then(|| blocks_db[middle - room..=middle + room].to_vec())
}

fn shape(link: &str, passages: &[Vec<f64>]) -> Shape {
    let (even, odd): (Vec<_>, Vec<_>) = passages.iter().enumerate().partition(|(i, _)| i % 2 == 0);
    let cost = |passages: &[(usize, &Vec<f64>)], profile: &[f64]| -> f64 {
        passages.iter().map(|(_, fade)| least(fade, profile).0).sum()
    };
    let steps = |from: usize, to: usize, by_s: f64| (from..=to).map(move |i| i as f64 * by_s);
    let choices =
        steps(3, 15, 0.01).flat_map(|half_s| steps(1, 15, 0.005).map(move |zone_s| [half_s, zone_s]));
    let [half_s, zone_s] = choices
        .map(|choice| (cost(&even, &profile(choice)), choice))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map_or([0.05, 0.03], |(_, choice)| choice);
    let model = profile([half_s, zone_s]);
    let count = (odd.len() * (2 * ABOUT + 1)).max(1) as f64;
    let rmse_db = [model.clone(), mean_fade(&even, &model), vec![0.0; model.len()]]
        .map(|profile| (cost(&odd, &profile) / count).sqrt());
    Shape { link: link.to_owned(), passages: odd.len(), half_s, zone_s, rmse_db }
}

/// Model B of TR 38.901 in time, in parts of a block: a screen that crosses at a steady speed. Far from its ends the detour round an
/// edge grows with the square of how far the edge is, so that its root grows with time.
fn profile([half_s, zone_s]: [f64; 2]) -> Vec<f64> {
    let share = |of_s: f64| (FRAC_PI_2 * of_s.abs() / zone_s).atan().copysign(of_s) / PI;
    let places = 2 * (ABOUT + 2 * SHIFT) * PARTS;
    let at_s = |i: usize| (i as f64 - 0.5 * places as f64) * BLOCK_S / PARTS as f64;
    let loss_db =
        |at_s: f64| -20.0 * (1.0 - (share(at_s + half_s) - share(at_s - half_s))).max(LEAST_FIELD).log10();
    (0..=places).map(at_s).map(loss_db).collect()
}

/// The least sum of squares over shifts of a profile, and that shift in parts of a block.
fn least(fade_db: &[f64], profile: &[f64]) -> (f64, usize) {
    let of_shift = |shift: usize| {
        let squares = (0..=2 * ABOUT).map(|i| {
            let told = profile[i * PARTS + shift];
            (fade_db[i + SHIFT] - told).powi(2)
        });
        (squares.sum::<f64>(), shift)
    };
    // In the middle the profile and the fade have the same middle.
    let middle = 2 * SHIFT * PARTS;
    (middle - SHIFT * PARTS..=middle + SHIFT * PARTS)
        .map(of_shift)
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap_or_default()
}

/// The mean fade, each shifted as the model fits it best, in parts of a block like a profile.
fn mean_fade(passages: &[(usize, &Vec<f64>)], model: &[f64]) -> Vec<f64> {
    let mut sums = vec![(0.0, 0_usize); model.len()];
    for (_, fade_db) in passages {
        let shift = least(fade_db, model).1;
        for (part, (sum, count)) in sums.iter_mut().enumerate() {
            // Part `i * PARTS + shift` of the model is block `i + SHIFT` of the fade.
            let at = (part as f64 - shift as f64) / PARTS as f64 + SHIFT as f64;
            let (i, share) = (at.floor(), at - at.floor());
            if i >= 0.0 && (i as usize) + 1 < fade_db.len() {
                *sum += fade_db[i as usize] * (1.0 - share) + fade_db[i as usize + 1] * share;
                *count += 1;
            }
        }
    }
    sums.into_iter().map(|(sum, count)| if count > 0 { sum / count as f64 } else { 0.0 }).collect()
}

/// Of all links together: root of the mean squared differences, by passages.
pub fn pooled(shapes: &[Shape]) -> [f64; 3] {
    let passages = shapes.iter().map(|shape| shape.passages).sum::<usize>().max(1) as f64;
    std::array::from_fn(|i| {
        let squares = shapes.iter().map(|shape| shape.rmse_db[i].powi(2) * shape.passages as f64);
        (squares.sum::<f64>() / passages).sqrt()
    })
}

/// For people.
pub fn to_text(shapes: &[Shape]) -> String {
    let mut text = String::from(
        "real fades, 400 ms to each side, only their time is free; the two numbers of a link are of other passages\n\
         link            passages  half ms  zone ms  model B dB  their mean fade dB  no fade dB\n",
    );
    let mut line = |link: &str, passages: usize, times: String, [model, mean, none]: [f64; 3]| {
        text += &format!("{link:14}  {passages:8}  {times}  {model:10.2}  {mean:18.2}  {none:10.2}\n");
    };
    for Shape { link, passages, half_s, zone_s, rmse_db } in shapes {
        line(link, *passages, format!("{:7.0}  {:7.0}", 1e3 * half_s, 1e3 * zone_s), *rmse_db);
    }
    let passages = shapes.iter().map(|shape| shape.passages).sum();
    line("all", passages, format!("{:7}  {:7}", "", ""), pooled(shapes));
    text
}

/// The same as JSON.
pub fn to_json(shapes: &[Shape]) -> Value {
    let of = |[model, mean, none]: [f64; 3]| json!({"model_b_db": model, "mean_fade_db": mean, "no_fade_db": none});
    let links = shapes.iter().map(|shape| {
        json!({"link": shape.link, "passages": shape.passages, "half_s": shape.half_s, "zone_s": shape.zone_s,
               "rmse": of(shape.rmse_db)})
    });
    json!({"links": links.collect::<Vec<_>>(), "rmse": of(pooled(shapes))})
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A table of passages that model B made, each at another time, in steps of 1 dB, held as a modem holds them.
    fn table(half_s: f64, zone_s: f64, noise_db: f64) -> String {
        let profile = profile([half_s, zone_s]);
        let mut text = String::from("mode,measurement,modem,metric,samples,rsrp_dbm_runs\n");
        for passage in 0..12 {
            let mut runs = String::new();
            for block in 0..200_usize {
                let part = (block * PARTS + passage % 5) as isize - (100 * PARTS) as isize
                    + (profile.len() / 2) as isize;
                let loss_db = usize::try_from(part).ok().and_then(|i| profile.get(i)).copied().unwrap_or(0.0);
                let noise_db = noise_db * f64::from(u8::from((block * 7 + passage) % 3 == 0));
                let count = if block % 5 == 0 { 19 } else { 18 };
                runs += &format!("{}x{count} ", (-70.0 - loss_db + noise_db).round());
            }
            text += &format!("{MODE},{passage},UE_A,5G_prx,3640,{runs}\n");
        }
        text
    }

    #[test]
    fn a_fade_of_the_model_is_found_again() {
        let shapes = compare(&table(0.08, 0.03, 0.0), "t.csv").unwrap();
        let [shape] = &shapes[..] else { panic!("{shapes:?}") };
        assert_eq!((shape.link.as_str(), shape.passages), ("UE_A 5G_prx", 6));
        assert!((shape.half_s - 0.08).abs() < 0.011 && (shape.zone_s - 0.03).abs() < 0.011, "{shape:?}");
        assert!(shape.rmse_db[0] < 0.6 && shape.rmse_db[2] > 3.0, "{shape:?}");
        assert!(to_text(&shapes).contains("all"));
    }

    #[test]
    fn what_is_no_table_is_named() {
        let said = |text: &str| compare(text, "t.csv").unwrap_err().to_string();
        assert!(said("a,b\n1,2\n").contains("t.csv, line 2"), "{}", said("a,b\n1,2\n"));
        let head = "mode,measurement,modem,metric,samples,rsrp_dbm_runs\n";
        let run = format!("{head}{MODE},1,UE_A,5G_prx,9,-70x5 -70y\n");
        assert!(said(&run).contains("expected VALUExCOUNT, found \"-70y\""), "{}", said(&run));
        assert!(said(head).contains("found none"));
        let huge = format!("{head}{MODE},1,UE_A,5G_prx,9,-70x99999999999\n");
        assert!(said(&huge).contains("VALUExCOUNT"), "{}", said(&huge));
    }
}
