//! Which sensor of a site a capture is of: by the port, the address and the form of its packets, then by its name. Never
//! by its place among other captures. What is in doubt is refused.

use std::path::{Path, PathBuf};

use umbracast::lidar::udp_port;
use umbracast::{Error, Site};

use super::captures::{Capture, whole_site};
use super::look::Look;
use super::words;

/// A capture whose sensor the user names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Told {
    /// The sensor's name in the site file.
    pub sensor: String,
    /// Its capture, one of those that are given.
    pub file: PathBuf,
}

/// Captures as scenes. Each is one where the site has one sensor, or where one of them holds packets of several sensors;
/// else they are one for each sensor, and one scene together.
///
/// # Errors
/// A file that is no capture, one of no sensor of the site, one that several sensors may have sent, two of one sensor, or
/// none of a sensor.
pub fn in_scenes(files: &[PathBuf], site: &Site, told: &[Told]) -> Result<Vec<Vec<Capture>>, Error> {
    let told = told_sensors(files, site, told)?;
    let looks = files.iter().map(|file| Look::into(file, site)).collect::<Result<Vec<_>, _>>()?;
    let apart = whole_site(site);
    let several = apart.is_ok() && looks.iter().any(|look| look.sensors().len() > 1);
    let whole = told.iter().all(Option::is_none) && (site.sensors.len() == 1 || files.len() == 1 || several);
    if !whole {
        return Ok(vec![of_single_sensors(files, site, &looks, &told)?]);
    }
    let captures = files.iter().zip(&looks).map(|(file, look)| {
        apart.as_ref().map_err(|e| e.clone().within(file.display()))?;
        let sensors = look.sensors();
        if sensors.is_empty() {
            return Err(look.misfit(site).within(file.display()));
        }
        let by = if site.sensors.len() == 1 { "the only sensor" } else { "by ports and addresses" };
        Ok(vec![Capture { file: file.clone(), sensors, whole: true, by: by.to_owned() }])
    });
    captures.collect()
}

/// By file: the place of the sensor that it was told to be of.
fn told_sensors(files: &[PathBuf], site: &Site, told: &[Told]) -> Result<Vec<Option<usize>>, Error> {
    let names: Vec<&str> = site.sensors.iter().map(|sensor| sensor.name.as_str()).collect();
    if let Some(wrong) = told.iter().find(|told| !names.contains(&told.sensor.as_str())) {
        let (expected, found) = (names.join(", "), &wrong.sensor);
        return Err(Error::new(format!(
            "--sensor: expected a sensor of the site, {expected}, found {found:?}"
        )));
    }
    let is = |file: &Path, told: &Told| match (file.canonicalize(), told.file.canonicalize()) {
        (Ok(file), Ok(told)) => file == told,
        _ => file == told.file,
    };
    let of_file = |file: &PathBuf| {
        let told = told.iter().find(|told| is(file, told))?;
        names.iter().position(|name| *name == told.sensor)
    };
    Ok(files.iter().map(of_file).collect())
}

/// What one capture may be of.
struct Candidates {
    sensors: Vec<usize>,
    by: Vec<String>,
}

impl Candidates {
    fn of(file: &Path, look: &Look, site: &Site) -> Result<Self, Error> {
        let fit = look.sensors();
        if fit.is_empty() {
            return Err(look.misfit(site).within(file.display()));
        }
        let all: Vec<usize> = (0..site.sensors.len()).collect();
        let mut found = Self { sensors: all, by: Vec::new() };
        let at_port: Vec<usize> = (found.sensors.iter().copied())
            .filter(|&s| udp_port(&site.sensors[s]).is_some_and(|port| look.has_port(port)))
            .collect();
        let port = udp_port(&site.sensors[fit[0]]).unwrap_or_default();
        found.narrow(&at_port, || format!("port {port}"));
        let with_address: Vec<usize> =
            fit.iter().copied().filter(|&s| site.sensors[s].address.is_some()).collect();
        found.narrow(&with_address, || {
            format!("address {}", site.sensors[with_address[0]].address.as_deref().unwrap_or_default())
        });
        found.narrow(&fit, || format!("model {}", site.sensors[fit[0]].model));
        let named = words::named(file, site);
        if !named.is_empty() && named.iter().all(|s| !found.sensors.contains(s)) {
            let name = |s: usize| site.sensors[s].name.as_str();
            let packets: Vec<&str> = found.sensors.iter().map(|&s| name(s)).collect();
            let story = format!(
                "expected packets of {}, which the file's name names, found packets of {} ({}); if the name is wrong, rename the \
                 file or give `--sensor {}={}`; else correct `address`, `udp_port` or `model` in the site file",
                name(named[0]),
                packets.join(" or "),
                look.summary(),
                name(found.sensors[0]),
                file.display()
            );
            return Err(Error::new(story).within(file.display()));
        }
        found.narrow(&named, || "its name".to_owned());
        Ok(found)
    }

    /// Keeps those that are also among `fit`, if there is one and that tells more than was known.
    fn narrow(&mut self, fit: &[usize], by: impl FnOnce() -> String) {
        let kept: Vec<usize> = self.sensors.iter().copied().filter(|s| fit.contains(s)).collect();
        if !kept.is_empty() && kept.len() < self.sensors.len() {
            self.sensors = kept;
            self.by.push(by());
        }
    }

    fn told(file: &Path, look: &Look, site: &Site, sensor: usize) -> Result<Self, Error> {
        if !look.sensors().contains(&sensor) {
            return Err(look.misfit(site).within(format!("{} (--sensor)", file.display())));
        }
        Ok(Self { sensors: vec![sensor], by: vec!["--sensor".to_owned()] })
    }
}

fn of_single_sensors(
    files: &[PathBuf],
    site: &Site,
    looks: &[Look],
    told: &[Option<usize>],
) -> Result<Vec<Capture>, Error> {
    let mut all = Vec::new();
    for ((file, look), told) in files.iter().zip(looks).zip(told) {
        all.push(match told {
            Some(sensor) => Candidates::told(file, look, site, *sensor)?,
            None => Candidates::of(file, look, site)?,
        });
    }
    // A sensor that one capture is surely of is none that another may be of.
    loop {
        let sure: Vec<usize> =
            all.iter().filter_map(|of| <[usize; 1]>::try_from(&of.sensors[..]).ok()).map(|[s]| s).collect();
        let mut found_more = false;
        for of in all.iter_mut().filter(|of| of.sensors.len() > 1) {
            let left: Vec<usize> = of.sensors.iter().copied().filter(|s| !sure.contains(s)).collect();
            let before = of.sensors.len();
            of.narrow(&left, || "what the others leave".to_owned());
            found_more |= of.sensors.len() < before;
        }
        if !found_more {
            break;
        }
    }
    let mut captures: Vec<Capture> = Vec::new();
    for ((file, look), of) in files.iter().zip(looks).zip(all) {
        let &[sensor] = &of.sensors[..] else {
            return Err(doubt(file, look, site, &of.sensors));
        };
        let name = &site.sensors[sensor].name;
        if let Some(other) = captures.iter().find(|other| other.sensors == [sensor]) {
            let (sensors, captures) = (site.sensors.len(), files.len());
            return Err(Error::new(format!(
                "expected {sensors} captures, one for each sensor of the site, found {captures}, and this one is of {name} (by {}) \
                 like {} (by {}); run each scene by itself, or say with `--sensor NAME=FILE` which is whose",
                of.by.join(", "),
                other.file.display(),
                other.by
            ))
            .within(file.display()));
        }
        captures.push(Capture {
            file: file.clone(),
            sensors: vec![sensor],
            whole: false,
            by: of.by.join(", "),
        });
    }
    if let Some(sensor) = (0..site.sensors.len()).find(|s| captures.iter().all(|of| of.sensors != [*s])) {
        let matched: Vec<String> = captures.iter().map(|of| of.told(site)).collect();
        return Err(Error::new(format!(
            "sensor {:?}: expected a capture of it, found none ({}); give one, or take the sensor out of the site file",
            site.sensors[sensor].name,
            matched.join("; ")
        )));
    }
    Ok(captures)
}

/// More than one sensor may have sent what is in a capture.
fn doubt(file: &Path, look: &Look, site: &Site, sensors: &[usize]) -> Error {
    let names: Vec<&str> = sensors.iter().map(|&s| site.sensors[s].name.as_str()).collect();
    Error::new(format!(
        "expected a capture of one sensor, found one that {} may have sent ({}); give each its `address` or `udp_port` in the site \
         file, its name in the name of its file, or `--sensor {}={}`",
        names.join(" and "),
        look.summary(),
        names[0],
        file.display()
    ))
    .within(file.display())
}
