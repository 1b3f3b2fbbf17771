//! Where the scans of a frame looked. Later stages need only this once they have the points.

use std::f64::consts::TAU;

use super::{Cloud, Frame, RangeImage, Scan};
use crate::geometry::Pose;

/// Directions round a sensor, counted apart, so that a lost packet hides a sector only.
pub const SECTORS: usize = 90;
/// Of 24 or so in a sector.
const COLUMNS_AT_ONCE: usize = 8;
const HALF_TURN_CDEG: f32 = 18_000.0;

/// What a frame's sensors could see, and when. Small beside the scans: what a host beside the sensors sends with their
/// foreground.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// use umbracast::lidar::Views;
///
/// let mut views = Views::default();
/// views.take(&ray(3, 15.5));
/// assert_eq!((views.time_ns, views.of_scans.len()), (400_000_000, 1));
/// assert!(views.of_scans[0].fan.is_none(), "nobody knows the beams of a cloud of points");
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Views {
    /// The frame's.
    pub time_ns: i64,
    /// One a scan, in the same order.
    pub of_scans: Vec<View>,
}

/// What one scan could see.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// use umbracast::lidar::View;
///
/// assert_eq!(View::of(&ray(0, 15.5).scans[0]).sensor, 0);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Which sensor of the site.
    pub sensor: usize,
    /// Where it hung.
    pub site_from_sensor: Pose,
    /// Its beams; none where they are not known.
    pub fan: Option<Fan>,
}

/// Where the beams of a scan went.
///
/// ```
/// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
/// # use people::*;
/// use umbracast::lidar::Fan;
///
/// // One column to the right: a quarter of a turn, clockwise from ahead.
/// let fan = Fan::of(&image());
/// assert_eq!((fan.elevations_rad.len(), fan.columns[22]), (32, 1));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Fan {
    /// Ascending.
    pub elevations_rad: Vec<f64>,
    /// Columns fired into each sector, clockwise from ahead.
    pub columns: [u32; SECTORS],
}

impl Views {
    /// Those of a frame, in the memory of the last one's.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// use umbracast::lidar::Views;
    ///
    /// let mut views = Views::of(&ray(0, 15.5));
    /// views.take(&ray(1, 15.5));
    /// assert_eq!(views.time_ns, 200_000_000);
    /// ```
    pub fn take(&mut self, frame: &Frame) {
        self.time_ns = frame.time_ns;
        self.of_scans.truncate(frame.scans.len());
        for (view, scan) in self.of_scans.iter_mut().zip(&frame.scans) {
            view.take(scan);
        }
        let new = &frame.scans[self.of_scans.len()..];
        self.of_scans.extend(new.iter().map(View::of));
    }

    /// Those of a frame.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// assert_eq!(umbracast::lidar::Views::of(&ray(0, 15.5)).of_scans.len(), 1);
    /// ```
    pub fn of(frame: &Frame) -> Self {
        let mut views = Self::default();
        views.take(frame);
        views
    }
}

impl View {
    /// That of a scan.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// use umbracast::lidar::View;
    ///
    /// let frame = ray(0, 15.5);
    /// assert_eq!(View::of(&frame.scans[0]).site_from_sensor, frame.scans[0].site_from_sensor);
    /// ```
    pub fn of(scan: &Scan) -> Self {
        let mut view = Self { sensor: scan.sensor, site_from_sensor: scan.site_from_sensor, fan: None };
        view.take(scan);
        view
    }

    fn take(&mut self, scan: &Scan) {
        (self.sensor, self.site_from_sensor) = (scan.sensor, scan.site_from_sensor);
        match (&scan.cloud, &mut self.fan) {
            (Cloud::Organised(image), Some(fan)) => fan.take(image),
            (Cloud::Organised(image), fan) => *fan = Some(Fan::of(image)),
            (Cloud::Unorganised(_), fan) => *fan = None,
        }
    }
}

impl Fan {
    /// That of a revolution.
    ///
    /// ```
    /// # mod people { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/doctests/people.rs")); }
    /// # use people::*;
    /// let fan = umbracast::lidar::Fan::of(&image());
    /// assert!(fan.elevations_rad.is_sorted());
    /// ```
    pub fn of(image: &RangeImage) -> Self {
        let mut fan = Self { elevations_rad: Vec::new(), columns: [0; SECTORS] };
        fan.take(image);
        fan
    }

    /// The same as another, in the memory of this one.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.elevations_rad.clone_from(&other.elevations_rad);
        self.columns = other.columns;
    }

    fn take(&mut self, image: &RangeImage) {
        self.elevations_rad.clear();
        self.elevations_rad.extend(image.beams.iter().map(|beam| beam.elevation_rad));
        self.elevations_rad.sort_unstable_by(f64::total_cmp);
        self.columns.fill(0);
        let of = |azimuth_cdeg: f32| sector((f64::from(azimuth_cdeg) * 0.01).to_radians());
        for columns in image.columns.chunks(COLUMNS_AT_ONCE) {
            let azimuths_cdeg = || columns.iter().map(|column| column.azimuth_cdeg);
            let (least, most) = (
                azimuths_cdeg().fold(f32::INFINITY, f32::min),
                azimuths_cdeg().fold(f32::NEG_INFINITY, f32::max),
            );
            // Most columns fall into one sector with those beside them, and what lies between two azimuths less than half a
            // turn apart that do is in it as well.
            if most - least < HALF_TURN_CDEG && of(least) == of(most) {
                self.columns[of(least)] += columns.len() as u32;
            } else {
                azimuths_cdeg().for_each(|azimuth_cdeg| self.columns[of(azimuth_cdeg)] += 1);
            }
        }
    }
}

/// The sector of an azimuth, clockwise from above.
pub(crate) fn sector(azimuth_rad: f64) -> usize {
    let turn = (azimuth_rad / TAU).rem_euclid(1.0);
    ((turn * SECTORS as f64) as usize).min(SECTORS - 1)
}
