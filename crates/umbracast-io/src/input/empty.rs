//! The hall without people: its frames, or an error that says why they are not those of the site's sensors.

use umbracast::lidar::sensor_model;
use umbracast::{Error, Frame, Health, Site};

use super::{Input, recorded_site};

impl Input {
    /// Every frame, all at once, as the empty hall is learned; what is broken is counted. Says what was lost at the end of a
    /// damaged file. Each of these `sensors`, by its place in the site, is in some frame: one without a background would take
    /// the whole hall for people.
    ///
    /// # Errors
    /// A recording of other sensor models than the site's, or one that lacks a sensor, and those of [`Self::frames`].
    pub fn empty_frames(
        &self,
        site: &Site,
        sensors: &[usize],
        health: &mut Health,
    ) -> Result<(Vec<Frame>, Option<String>), Error> {
        let within = |error: Error| error.within(format!("the empty hall, {self}"));
        self.is_of_models(site).map_err(within)?;
        let (mut frames, mut own) = (Vec::new(), Health::default());
        let lost = self.frames(site, &mut own, |frame| {
            frames.push(frame.clone());
            Ok(())
        });
        let lost = lost.map_err(within)?;
        let is_there = |sensor: usize| {
            frames.iter().any(|frame: &Frame| frame.scans.iter().any(|scan| scan.sensor == sensor))
        };
        let missing = sensors.iter().find_map(|&s| site.sensors.get(s).filter(|_| !is_there(s)));
        if let Some(sensor) = missing {
            let unread = own.packets_wrong_size + own.packets_not_understood;
            return Err(within(Error::new(format!(
                "sensor {:?}: expected frames of a {}, found none ({} frames of other sensors, {unread} packets that are no \
                 sensor's of this site)",
                sensor.name,
                sensor.model,
                frames.len()
            ))));
        }
        health.add(&own);
        Ok((frames, lost))
    }

    /// A recording says of which models its sensors were; those of some models have packets of the same form.
    fn is_of_models(&self, site: &Site) -> Result<(), Error> {
        let Self::Recording(file) = self else { return Ok(()) };
        // One that another version wrote may not be understood; its packets are.
        let Ok(Some(recorded)) = recorded_site(file) else { return Ok(()) };
        for sensor in &site.sensors {
            let other = recorded.sensors.iter().find(|other| {
                other.name == sensor.name && sensor_model(&other.model) != sensor_model(&sensor.model)
            });
            if let Some(other) = other {
                return Err(Error::new(format!(
                    "sensor {:?}: expected a recording of a {}, as the site file says, found one of a {}",
                    sensor.name, sensor.model, other.model
                )));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::RecordingWriter;
    use umbracast::Config;
    use umbracast_sim::scene::Scene;

    /// What is said of two revolutions of a hall with this site, of its first sensors, given to the default site.
    fn told(change: fn(&mut Site), sensors: usize, needed: &[usize]) -> Result<usize, String> {
        let mut config = Config::default();
        let site = config.site.clone();
        change(&mut config.site);
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("empty.mcap");
        let mut writer = RecordingWriter::create(&file, &config.to_toml(), &config.site, false).unwrap();
        for (k, mut packets) in Scene::empty(&config.site, 7, 2).unwrap().into_iter().enumerate() {
            packets[sensors..].iter_mut().for_each(Vec::clear);
            writer.write_packets(k as i64 * umbracast::STEP_NS, &packets).unwrap();
        }
        writer.finish().unwrap();
        let empty = Input::Recording(file).empty_frames(&site, needed, &mut Health::default());
        empty.map(|(frames, _)| frames.len()).map_err(|error| error.to_string())
    }

    fn all_are(site: &mut Site, model: &str) {
        site.sensors.iter_mut().for_each(|sensor| model.clone_into(&mut sensor.model));
    }

    /// Nothing of it was understood, nothing was said, and the hall was learned on the way.
    #[test]
    fn the_empty_hall_of_other_sensors_is_refused() {
        assert_eq!(told(|_| (), 2, &[0, 1]), Ok(2));
        let error = told(|site| all_are(site, "os0-32"), 2, &[0, 1]).unwrap_err();
        assert!(error.contains("\"lidar_east\": expected a recording of a hdl-32e"), "{error}");
        assert!(error.contains("empty.mcap") && error.contains("found one of a os0-32"), "{error}");
        // One spelled otherwise is the same.
        assert_eq!(told(|site| all_are(site, "HDL32E"), 2, &[0, 1]), Ok(2));
    }

    #[test]
    fn an_empty_hall_without_one_of_the_sensors_is_refused_unless_it_is_not_needed() {
        let error = told(|_| (), 1, &[0, 1]).unwrap_err();
        assert!(error.contains("\"lidar_west\": expected frames of a hdl-32e, found none"), "{error}");
        assert_eq!(told(|_| (), 1, &[0]), Ok(2));
    }
}
