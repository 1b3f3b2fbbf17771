//! The returns that sensors get from one body alone in the hall, at one place after another, without noise.
//!
//! The hall is traced once. A body at another place is the same body seen by a sensor at another place, so one body
//! serves all places and headings.

use umbracast::Site;
use umbracast::geometry::{DVec2, Pose};
use umbracast::site::Hall;

use super::noise::Noise;
use super::raster::Painter;
use super::view::{NOBODY, View};
use super::{Sensors, Simulated};
use crate::body::Walker;

/// Sensors that look at one body at a time.
#[derive(Debug, Clone)]
pub struct Survey {
    hall: Hall,
    lookouts: Vec<Lookout>,
}

/// What one sensor gets from the body in one revolution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Points on the body: the mean over noise and drop-outs.
    pub returns: f64,
    /// Heights above the floor of the lowest and the highest of them, metres; `None` without any.
    pub span_m: Option<(f64, f64)>,
}

#[derive(Debug, Clone)]
struct Lookout {
    site_from_sensor: Pose,
    painter: Painter,
    noise: Noise,
    /// The hall, with the body in it while it is looked at.
    view: View,
    /// Ranges of the hall alone.
    hall_m: Vec<f32>,
}

impl Survey {
    /// With the sensors of that site, in its order.
    pub fn new(site: &Site, sensors: &Sensors) -> Self {
        let lookout = |(simulated, sensor): (&Simulated, &umbracast::site::Sensor)| {
            let view = View::of_hall(&simulated.outlook.hall, &simulated.head, 0, None);
            Lookout {
                site_from_sensor: sensor.site_from_sensor(),
                painter: simulated.outlook.painter.clone(),
                noise: simulated.noise.clone(),
                hall_m: view.image.range_m.clone(),
                view,
            }
        };
        Self {
            hall: site.hall.clone(),
            lookouts: sensors.sensors.iter().zip(&site.sensors).map(lookout).collect(),
        }
    }

    /// A body that stands at the origin and looks along x, as each sensor sees it in the first revolution of a
    /// scene when it is moved to `position_m` and turned to `heading_rad`.
    pub fn see(&mut self, body: &Walker, position_m: DVec2, heading_rad: f64) -> Vec<Seen> {
        let feet_m = position_m.extend(self.hall.floor_m(position_m));
        let site_from_body = Pose::from_yaw_pitch_roll_deg(feet_m, heading_rad.to_degrees(), 0.0, 0.0);
        self.lookouts.iter_mut().map(|lookout| lookout.see(body, &site_from_body)).collect()
    }
}

impl Lookout {
    fn see(&mut self, body: &Walker, site_from_body: &Pose) -> Seen {
        self.painter.hang(self.site_from_sensor.inverse().after(site_from_body));
        self.painter.draw(body, 0, &mut self.view);
        let mut seen = Seen { returns: 0.0, span_m: None };
        for pixel in 0..self.hall_m.len() {
            if self.view.owner[pixel] == NOBODY {
                continue;
            }
            let image = &self.view.image;
            let range_m = image.range_m[pixel];
            let returns = self.noise.mean_returns(range_m);
            if returns > 0.0 {
                let (column, beam) = (pixel / image.beams.len(), pixel % image.beams.len());
                let point_m = image.point_m(column, beam, f64::from(range_m));
                let height_m = self.site_from_sensor.point(point_m).z - site_from_body.translation_m.z;
                let (low_m, high_m) = seen.span_m.unwrap_or((height_m, height_m));
                seen.returns += returns;
                seen.span_m = Some((low_m.min(height_m), high_m.max(height_m)));
            }
            self.view.image.range_m[pixel] = self.hall_m[pixel];
            self.view.owner[pixel] = NOBODY;
        }
        seen
    }
}
