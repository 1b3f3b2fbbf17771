//! The hall from above, as both the plan and the animation draw it. Site frame, metres.

use umbracast::Site;

/// A closed or open line.
pub type Outline = Vec<(f64, f64)>;

/// From, to, along x and along y.
pub type Window = ((f64, f64), (f64, f64));

/// The walls.
pub fn walls(site: &Site) -> Outline {
    let corners: Vec<(f64, f64)> = site.hall.corners().into_iter().map(<(f64, f64)>::from).collect();
    closed(&corners)
}

/// Pillars and furniture.
pub fn standing(site: &Site) -> Vec<Outline> {
    let pillars = site.pillars.iter().map(|pillar| {
        let corner = |i: i32| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 24.0).sin_cos();
            (pillar.position_m[0] + pillar.radius_m * cos, pillar.position_m[1] + pillar.radius_m * sin)
        };
        (0..=24).map(corner).collect()
    });
    let furniture = site.furniture.iter().map(|piece| {
        let (sin, cos) = piece.yaw_deg.to_radians().sin_cos();
        let corner = |along: f64, across: f64| {
            let (u, v) = (along * piece.size_m[0] / 2.0, across * piece.size_m[1] / 2.0);
            (piece.position_m[0] + u * cos - v * sin, piece.position_m[1] + u * sin + v * cos)
        };
        closed(&[corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)])
    });
    pillars.chain(furniture).collect()
}

/// Where the sensors hang.
pub fn sensors(site: &Site) -> Outline {
    site.sensors.iter().map(|sensor| (sensor.position_m[0], sensor.position_m[1])).collect()
}

/// Where the access points hang.
pub fn access_points(site: &Site) -> Outline {
    site.access_points.iter().map(|ap| (ap.position_m[0], ap.position_m[1])).collect()
}

/// The hall, and whoever and whatever is outside of it, with some room around.
pub fn window(site: &Site, people: impl Iterator<Item = (f64, f64)>) -> Window {
    const ROOM_M: f64 = 0.5;
    let mut window = ((f64::INFINITY, f64::NEG_INFINITY), (f64::INFINITY, f64::NEG_INFINITY));
    for (x, y) in walls(site).into_iter().chain(sensors(site)).chain(access_points(site)).chain(people) {
        window.0 = (window.0.0.min(x - ROOM_M), window.0.1.max(x + ROOM_M));
        window.1 = (window.1.0.min(y - ROOM_M), window.1.1.max(y + ROOM_M));
    }
    window
}

/// The longest round length that is at most a fifth of what is shown.
pub fn scale_bar_m((x, _): Window) -> f64 {
    let fifth = (x.1 - x.0) / 5.0;
    let decade = 10_f64.powf(fifth.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|round| round * decade).find(|&bar_m| bar_m <= fifth).unwrap_or(decade)
}

fn closed(corners: &[(f64, f64)]) -> Outline {
    corners.iter().chain(corners.first()).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbracast::Config;

    #[test]
    fn everything_lies_in_the_window_and_the_scale_is_round() {
        let site = Config::default().site;
        let (x, y) = window(&site, [(40.0, 0.0)].into_iter());
        assert_eq!((x, y), ((-17.5, 40.5), (-17.5, 17.5)));
        assert_eq!(scale_bar_m((x, y)), 10.0);
        assert_eq!(scale_bar_m(((0.0, 35.0), y)), 5.0);
        assert_eq!(scale_bar_m(((0.0, 6.0), y)), 1.0);
        assert_eq!(standing(&site).len(), site.pillars.len() + site.furniture.len());
    }
}
