//! Refuses impossible floor plans.

use crate::Error;
use crate::geometry::DVec2;
use crate::site::{Floor, Hall, doubled_area_m2};

/// No hall is longer; a longer one is in another unit.
pub(super) const HALL_MAX_M: f64 = 1000.0;
/// No coordinate is larger: that of the far end of a map in UTM.
const FAR_M: f64 = 1e7;
/// No floor is smaller, square metres: nobody could stand on it.
const AREA_MIN_M2: f64 = 0.25;
/// No floor is steeper: ramps of car parks rise by 15 %, those that people are to walk by 6 %.
const SLOPE_MAX: f64 = 0.2;
/// Between floor and ceiling, at least.
const HEADROOM_M: f64 = 2.0;

/// Refuses sizes, outlines and floors that cannot be.
///
/// # Errors
/// As said, with the key, what was expected and what was found.
pub(super) fn check_hall(hall: &Hall) -> Result<(), Error> {
    above_0("site.hall.height_m", hall.height_m, HALL_MAX_M)?;
    if hall.outline_m.is_empty() {
        above_0("site.hall.length_m", hall.length_m, HALL_MAX_M)?;
        above_0("site.hall.width_m", hall.width_m, HALL_MAX_M)?;
    } else {
        check_outline("site.hall.outline_m", &hall.outline_m)?;
    }
    hall.floors.iter().enumerate().try_for_each(|(i, floor)| check_floor(i, floor, hall))
}

/// Refuses a piece of floor that nobody could walk on, or that is not in the hall.
fn check_floor(i: usize, floor: &Floor, hall: &Hall) -> Result<(), Error> {
    let key = |name: &str| format!("site.hall.floors[{i}].{name}");
    check_outline(&key("outline_m"), &floor.outline_m)?;
    let [along_x, along_y] = floor.slope;
    within(&key("slope, along x"), along_x, -SLOPE_MAX, SLOPE_MAX)?;
    within(&key("slope, along y"), along_y, -SLOPE_MAX, SLOPE_MAX)?;
    within(&key("height_m"), floor.height_m, -hall.height_m, hall.height_m - HEADROOM_M)?;
    let corners: Vec<DVec2> = floor.outline_m.iter().copied().map(DVec2::from_array).collect();
    for (corner, at_m) in corners.iter().enumerate() {
        let name = key(&format!("outline_m[{corner}], its height"));
        within(&name, floor.height_at_m(*at_m), -hall.height_m, hall.height_m - HEADROOM_M)?;
    }
    let [least, most] = hall.bounds_m();
    let (low, high) = corners.iter().fold((most, least), |(low, high), p| (low.min(*p), high.max(*p)));
    match low.cmplt(most).all() && high.cmpgt(least).all() {
        true => Ok(()),
        false => {
            let key = key("outline_m");
            Err(Error::new(format!(
                "{key}: expected a piece of the hall, {least} to {most}, found one outside"
            )))
        }
    }
}

/// Refuses an outline whose edges touch elsewhere than at their corners, and one of no size.
fn check_outline(key: &str, outline_m: &[[f64; 2]]) -> Result<(), Error> {
    let count = outline_m.len();
    let refuse = |told: String| Err(Error::new(format!("{key}: {told}")));
    if count < 3 {
        return refuse(format!("expected 3 corners or more, found {count}"));
    }
    for (i, [x_m, y_m]) in outline_m.iter().enumerate() {
        within(&format!("{key}[{i}], x"), *x_m, -FAR_M, FAR_M)?;
        within(&format!("{key}[{i}], y"), *y_m, -FAR_M, FAR_M)?;
    }
    let corners: Vec<DVec2> = outline_m.iter().copied().map(DVec2::from_array).collect();
    let edge = |i: usize| [corners[i], corners[(i + 1) % count]];
    let name = |i: usize| format!("the edge from corner {i} to {}", (i + 1) % count);
    if let Some(i) = (0..count).find(|&i| edge(i)[0] == edge(i)[1]) {
        return refuse(format!("expected corners apart, found corner {i} twice"));
    }
    for i in 0..count {
        for j in i + 1..count {
            let touch = if j == i + 1 {
                folds_back(corners[i], corners[j], edge(j)[1])
            } else if (j + 1) % count == i {
                folds_back(corners[j], corners[i], edge(i)[1])
            } else {
                cross(edge(i), edge(j))
            };
            if touch {
                let found = format!("{} on {}", name(j), name(i));
                return refuse(format!("expected edges that meet at corners alone, found {found}"));
            }
        }
    }
    let start = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    let [least, most] = corners.iter().fold(start, |[least, most], p| [least.min(*p), most.max(*p)]);
    above_0(&format!("{key}, along x"), most.x - least.x, HALL_MAX_M)?;
    above_0(&format!("{key}, along y"), most.y - least.y, HALL_MAX_M)?;
    let area_m2 = 0.5 * doubled_area_m2(&corners).abs();
    match area_m2 >= AREA_MIN_M2 {
        true => Ok(()),
        false => refuse(format!("expected a floor of {AREA_MIN_M2} m^2 at least, found {area_m2}")),
    }
}

/// Whether the way turns back on itself at `corner`.
fn folds_back(before: DVec2, corner: DVec2, after: DVec2) -> bool {
    let (to, on) = (corner - before, after - corner);
    to.perp_dot(on) == 0.0 && to.dot(on) < 0.0
}

/// Whether two edges touch.
fn cross([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> bool {
    let side = |from: DVec2, to: DVec2, p: DVec2| (to - from).perp_dot(p - from);
    let on = |from: DVec2, to: DVec2, p: DVec2| side(from, to, p) == 0.0 && (p - from).dot(p - to) <= 0.0;
    let apart = |x: f64, y: f64| (x > 0.0) != (y > 0.0) && x != 0.0 && y != 0.0;
    (apart(side(a, b, c), side(a, b, d)) && apart(side(c, d, a), side(c, d, b)))
        || on(a, b, c)
        || on(a, b, d)
        || on(c, d, a)
        || on(c, d, b)
}

/// Not a number is within nothing.
pub(super) fn within(key: &str, value: f64, least: f64, most: f64) -> Result<(), Error> {
    match (least..=most).contains(&value) {
        true => Ok(()),
        false => Err(Error::new(format!("{key}: expected {least} to {most}, found {value}"))),
    }
}

pub(super) fn above_0(key: &str, value: f64, most: f64) -> Result<(), Error> {
    match value > 0.0 && value <= most {
        true => Ok(()),
        false => Err(Error::new(format!("{key}: expected more than 0 and {most} at most, found {value}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;

    fn found(outline_m: &[[f64; 2]]) -> String {
        let mut hall = Config::default().site.hall;
        hall.outline_m = outline_m.to_vec();
        check_hall(&hall).map_or_else(|error| error.to_string(), |()| "accepted".to_owned())
    }

    #[test]
    fn an_outline_either_way_round_and_far_away_is_accepted() {
        let l = [[0.0, 0.0], [8.0, 0.0], [8.0, 4.0], [4.0, 4.0], [4.0, 8.0], [0.0, 8.0]];
        assert_eq!(found(&l), "accepted");
        let far = l.map(|[x, y]| [x + 500_000.0, y + 5_400_000.0]);
        assert_eq!(found(&far), "accepted");
        let mut back = far;
        back.reverse();
        assert_eq!(found(&back), "accepted");
    }

    #[test]
    fn floors_that_nobody_could_walk_on_are_refused_with_their_key() {
        let told = |outline_m: &[[f64; 2]], height_m: f64, slope: [f64; 2]| {
            let mut hall = Config::default().site.hall;
            hall.floors = vec![Floor { outline_m: outline_m.to_vec(), height_m, slope }];
            check_hall(&hall).map_or_else(|error| error.to_string(), |()| "accepted".to_owned())
        };
        let square = |x: f64| [[x, 0.0], [x + 4.0, 0.0], [x + 4.0, 4.0], [x, 4.0]];
        assert_eq!(told(&square(0.0), 0.4, [0.05, 0.0]), "accepted");
        assert_eq!(told(&square(0.0), -0.4, [0.0, 0.0]), "accepted");
        for (found, key) in [
            (told(&square(0.0)[..2], 0.4, [0.0; 2]), "outline_m: expected 3 corners or more"),
            (told(&square(30.0), 0.4, [0.0; 2]), "outline_m: expected a piece of the hall"),
            (told(&square(0.0), 0.4, [0.0, 5.0]), "slope, along y: expected -0.2 to 0.2, found 5"),
            (told(&square(0.0), 9.0, [0.0; 2]), "height_m: expected -10 to 8, found 9"),
            (told(&square(0.0), f64::NAN, [0.0; 2]), "height_m: expected"),
            (told(&square(0.0), 7.9, [0.1, 0.0]), "outline_m[1], its height: expected -10 to 8"),
        ] {
            assert!(found.starts_with(&format!("site.hall.floors[0].{key}")), "{found}");
        }
    }

    #[test]
    fn what_is_no_floor_is_refused_with_its_place() {
        let wrong: [(&[[f64; 2]], &str); 7] = [
            (&[[0.0, 0.0], [4.0, 0.0]], "site.hall.outline_m: expected 3 corners or more, found 2"),
            (
                &[[0.0, 0.0], [4.0, 0.0], [4.0, 0.0], [0.0, 4.0]],
                "site.hall.outline_m: expected corners apart",
            ),
            (
                &[[0.0, 0.0], [4.0, 4.0], [4.0, 0.0], [0.0, 4.0]],
                "site.hall.outline_m: expected edges that meet at corners alone, found the edge from corner 2 to 3 on \
                 the edge from corner 0 to 1",
            ),
            (
                &[[0.0, 0.0], [4.0, 0.0], [2.0, 0.0], [2.0, 4.0]],
                "site.hall.outline_m: expected edges that meet",
            ),
            (&[[0.0, 0.0], [0.3, 0.0], [0.3, 0.3]], "site.hall.outline_m: expected a floor of 0.25 m^2"),
            (&[[0.0, 0.0], [4.0, f64::NAN], [2.0, 4.0]], "site.hall.outline_m[1], y: expected"),
            (&[[0.0, 0.0], [4000.0, 0.0], [2.0, 4.0]], "site.hall.outline_m, along x: expected"),
        ];
        for (outline_m, told) in wrong {
            assert!(found(outline_m).starts_with(told), "{}", found(outline_m));
        }
    }
}
