//! What was seen and found as point clouds in the site's frame, for other programs: whole scans, the foreground, the ways of
//! people, and links. Fields: `x y z` in metres, `time_s` since 1970, and what each function says.

use std::sync::LazyLock;

use glam::DVec2;
use umbracast::detect::Point;
use umbracast::geometry::DVec3;
use umbracast::lidar::{Azimuths, Cloud, Frame};
use umbracast::{STEPS, Site};

use crate::pcd::{PcdCloud, PcdField, PcdKind};
use crate::rows::{LinkRow, TrackRow};

/// So far apart are the points along a link.
const ALONG_M: f64 = 0.1;

/// Where scans' azimuths point, for who places all returns of a scan: the table is made once.
pub fn azimuths() -> &'static Azimuths {
    static OF_A_TURN: LazyLock<Azimuths> = LazyLock::new(Azimuths::of_a_turn);
    &OF_A_TURN
}

/// Every return of a frame, placed where its sensor hangs: `intensity`, `sensor` (its place in the site).
pub fn of_frame(frame: &Frame) -> PcdCloud {
    let mut made = Made::new(&[("intensity", PcdKind::F32), ("sensor", PcdKind::U16)]);
    for scan in &frame.scans {
        let sensor = scan.sensor as f64;
        match &scan.cloud {
            Cloud::Organised(image) => {
                let beams = image.beams.len();
                for (at, &range_m) in image.range_m.iter().enumerate().filter(|(_, range_m)| **range_m > 0.0)
                {
                    let (c, b) = (at / beams, at % beams);
                    let at_m = scan.site_from_sensor.point(image.tabled_point_m(
                        azimuths(),
                        c,
                        b,
                        f64::from(range_m),
                    ));
                    made.push(at_m, image.time_ns(c, b), &[f64::from(image.reflectivity[at]), sensor]);
                }
            }
            Cloud::Unorganised(points) => {
                for point in points {
                    let [x, y, z] = point.position_m.map(f64::from);
                    let at_m = scan.site_from_sensor.point(DVec3::new(x, y, z));
                    made.push(at_m, point.time_ns, &[f64::from(point.reflectivity), sensor]);
                }
            }
        }
    }
    made.cloud()
}

/// The points that do not belong to the empty hall: `sensor`.
pub fn of_foreground(points: &[Point]) -> PcdCloud {
    let mut made = Made::new(&[("sensor", PcdKind::U16)]);
    points.iter().for_each(|point| made.push(point.position_m, point.time_ns, &[f64::from(point.sensor)]));
    made.cloud()
}

/// A point on the floor for each confirmed track and frame: `track`, `frame`, `height_m`, `speed_mps`.
pub fn of_tracks(site: &Site, tracks: &[TrackRow]) -> PcdCloud {
    let mut made = Made::new(&[
        ("track", PcdKind::U32),
        ("frame", PcdKind::U32),
        ("height_m", PcdKind::F32),
        ("speed_mps", PcdKind::F32),
    ]);
    for row in tracks.iter().filter(|row| row.confirmed) {
        let at_m = DVec2::new(row.x_m, row.y_m);
        let speed_mps = row.vx_mps.hypot(row.vy_mps);
        let fields = [row.track as f64, row.frame as f64, row.height_m, speed_mps];
        made.push(at_m.extend(site.hall.floor_m(at_m)), row.time_ns, &fields);
    }
    made.cloud()
}

/// Points along every link of one frame, from the access point to the device: `access_point` (its place in the site), `track`,
/// `p_now` and `p_w9`, the probabilities that anything blocks it now and within the last window.
pub fn of_links(site: &Site, tracks: &[TrackRow], links: &[LinkRow]) -> PcdCloud {
    let mut made = Made::new(&[
        ("access_point", PcdKind::U16),
        ("track", PcdKind::U32),
        ("p_now", PcdKind::F32),
        ("p_w9", PcdKind::F32),
    ]);
    for link in links {
        let Some([from_m, to_m]) = ends_m(site, tracks, link) else { continue };
        let points = (from_m.distance(to_m) / ALONG_M).ceil().max(1.0);
        let fields =
            [f64::from(link.access_point), link.track as f64, link.p_of_any(0), link.p_of_any(STEPS)];
        for n in 0..=points as usize {
            made.push(from_m.lerp(to_m, n as f64 / points), link.time_ns, &fields);
        }
    }
    made.cloud()
}

/// A link's access point and its device, metres; none where the frame lacks one of them.
pub fn ends_m(site: &Site, tracks: &[TrackRow], link: &LinkRow) -> Option<[DVec3; 2]> {
    let access_point = site.access_points.get(link.access_point as usize)?;
    let track = tracks.iter().find(|track| track.track == link.track && track.frame == link.frame)?;
    let at_m = DVec2::new(track.x_m, track.y_m);
    Some([access_point.position(), site.ue_m(at_m, track.heading_rad, track.height_m)])
}

/// Four bytes hold coordinates up to here to half a millimetre.
const SHORT_MAX_M: f64 = 4096.0;

/// A cloud in the making.
struct Made(Vec<PcdField>);

impl Made {
    fn new(more: &[(&str, PcdKind)]) -> Self {
        let always =
            [("x", PcdKind::F32), ("y", PcdKind::F32), ("z", PcdKind::F32), ("time_s", PcdKind::F64)];
        let field = |(name, kind): &(&str, PcdKind)| PcdField {
            name: (*name).to_owned(),
            kind: *kind,
            count: 1,
            values: Vec::new(),
        };
        Self(always.iter().chain(more).map(field).collect())
    }

    fn push(&mut self, at_m: DVec3, time_ns: i64, more: &[f64]) {
        let values = [at_m.x, at_m.y, at_m.z, time_ns as f64 / 1e9].into_iter().chain(more.iter().copied());
        self.0.iter_mut().zip(values).for_each(|(field, value)| field.values.push(value));
    }

    fn cloud(mut self) -> PcdCloud {
        // Coordinates of a map have too many digits for four bytes.
        if self.0[..3].iter().flat_map(|axis| &axis.values).any(|m| m.abs() > SHORT_MAX_M) {
            self.0[..3].iter_mut().for_each(|axis| axis.kind = PcdKind::F64);
        }
        let width = self.0[0].values.len();
        PcdCloud { width, height: 1, viewpoint: [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], fields: self.0 }
    }
}
