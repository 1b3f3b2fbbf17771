//! Every return of a range image in the site frame. Voxels take a hundred thousand a frame, so many are placed and looked up at
//! once.

use super::Point;
use super::voxel::VoxelMap;
use crate::Health;
use crate::elementary::wide;
use crate::geometry::DVec3;
use crate::lidar::{ABREAST, Abreast, Azimuths, RangeImage, Scan};

/// What places returns.
#[derive(Debug, Clone)]
pub struct Placer {
    azimuths: Azimuths,
    /// Those of the scan at hand.
    beams: Vec<Abreast>,
}

impl Placer {
    pub fn new() -> Self {
        Self { azimuths: Azimuths::of_a_turn(), beams: Vec::new() }
    }

    wide! {
        /// Adds the returns of a scan, which has this image, within a range; where there is a map, those that lie where it has none.
        pub fn place(
            &mut self, scan: &Scan, image: &RangeImage, valid_m: [f32; 2], map: Option<&VoxelMap>,
            health: &mut Health, points: &mut Vec<Point>,
        ) = place_avx2 or place_portably
    }

    #[inline(always)]
    fn place_portably(
        &mut self,
        scan: &Scan,
        image: &RangeImage,
        valid_m: [f32; 2],
        map: Option<&VoxelMap>,
        health: &mut Health,
        points: &mut Vec<Point>,
    ) {
        Abreast::take(&mut self.beams, &image.beams);
        let ranges_m = image.range_m.chunks(image.beams.len().max(1));
        for (c, ranges_m) in (0..image.columns.len()).zip(ranges_m) {
            for (beams, some_m) in self.beams.iter().zip(ranges_m.chunks(ABREAST)) {
                let mut range_m = [0.0; ABREAST];
                range_m[..some_m.len()].copy_from_slice(some_m);
                // A bit for each beam.
                let (mut returned, mut valid) = (0_u32, 0_u32);
                for (i, &range_m) in range_m.iter().enumerate() {
                    returned |= u32::from(range_m != 0.0) << i;
                    valid |= u32::from((range_m >= valid_m[0]) & (range_m <= valid_m[1])) << i;
                }
                valid &= returned;
                health.points_invalid += u64::from((returned & !valid).count_ones());
                if valid == 0 {
                    continue;
                }
                let head = beams.head_sin_cos(image, &self.azimuths, c);
                let [mut x, mut y, mut z] = [[0.0; ABREAST]; 3];
                for i in 0..ABREAST {
                    let position_m = beams.point_m(&head, i, f64::from(range_m[i]));
                    [x[i], y[i], z[i]] = scan.site_from_sensor.point(position_m).to_array();
                }
                let mut kept = match map {
                    Some(map) => valid & map.are_new(&[x, y, z]),
                    None => valid,
                };
                while kept != 0 {
                    let i = kept.trailing_zeros() as usize;
                    kept &= kept - 1;
                    points.push(Point {
                        position_m: DVec3::new(x[i], y[i], z[i]),
                        time_ns: image.time_ns(c, beams.beam(i)),
                        sensor: scan.sensor as u16,
                    });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;
    use crate::lidar::{Cloud, Column, Model};

    #[test]
    fn returns_lie_where_each_alone_does_to_the_last_bit() {
        let column = |i: i32| Column {
            time_ns: i64::from(i),
            azimuth_cdeg: (i as f32 - 100.0) * 7.3,
            azimuth_rate_cdeg_per_ns: 3.6e-4,
        };
        for model in ["hdl-32e", "vlp-16", "os0-32", "xt32"] {
            let (columns, beams) =
                ((0..6000).map(column).collect::<Vec<_>>(), Model::by_name(model).unwrap().beams);
            let n = beams.len();
            let range_m: Vec<f32> = (0..columns.len() * n).map(|i| (i % 977) as f32 * 0.03).collect();
            let image = RangeImage { beams, columns, reflectivity: vec![0; range_m.len()], range_m };
            let site_from_sensor = Pose::from_yaw_pitch_roll_deg(DVec3::new(3.0, -2.0, 9.0), 40.0, 35.0, 1.0);
            let scan = Scan { sensor: 0, site_from_sensor, cloud: Cloud::Organised(image.clone()) };
            let (mut placer, mut health) = (Placer::new(), Health::default());
            let (mut all, mut new) = (Vec::new(), Vec::new());
            placer.place(&scan, &image, [0.5, 25.0], None, &mut health, &mut all);
            let valid = |&(_, &r): &(usize, &f32)| (0.5..=25.0).contains(&r);
            let expected: Vec<Point> = image
                .range_m
                .iter()
                .enumerate()
                .filter(valid)
                .map(|(i, &r)| {
                    let position_m = site_from_sensor.point(image.point_m(i / n, i % n, f64::from(r)));
                    Point { position_m, time_ns: image.time_ns(i / n, i % n), sensor: 0 }
                })
                .collect();
            assert_eq!(all, expected, "{model}");
            let returned = image.range_m.iter().filter(|&&r| r != 0.0).count();
            assert_eq!(health.points_invalid as usize, returned - all.len());

            let map = VoxelMap::new(0.2, &all[..all.len() / 2]);
            placer.place(&scan, &image, [0.5, 25.0], Some(&map), &mut health, &mut new);
            all.retain(|point| map.is_new(point.position_m));
            assert!(new == all && !new.is_empty(), "{model}");
        }
    }
}
