//! The hall as it is from leg to leg: chairs that somebody moves, a door, a table put in.

use umbracast::geometry::DVec2;
use umbracast::site::Furniture;
use umbracast::{Config, Site};

/// How the hall may be. The first is the one that the program saw empty; nobody tells it of the others.
pub const HALLS: usize = 4;
/// Where people sit.
const SEATS_M: [[f64; 2]; 4] = [[-7.6, -4.2], [-6.2, -4.6], [-4.6, -6.2], [-4.2, -7.6]];
const STOOL_M: [f64; 3] = [0.36, 0.36, 0.44];
/// Where two of the stools stand once somebody has moved them.
const MOVED_M: [[f64; 2]; 2] = [[-9.2, -3.0], [-5.2, -4.9]];
/// Whoever sits comes and goes here.
pub const SEATS_DOOR_M: DVec2 = DVec2::new(-8.4, -8.4);
/// Where the others come and go; the last is the door with a leaf.
const DOORS_M: [DVec2; 5] = [
    DVec2::new(-11.8, 1.5),
    DVec2::new(0.5, 11.8),
    DVec2::new(8.6, -8.2),
    DVec2::new(1.5, -11.8),
    DVec2::new(8.4, 8.4),
];
/// Nobody walks through the place with the seats but who sits there: from corner to corner.
const SEATS_PLACE_M: [[f64; 2]; 2] = [[-10.0, -9.2], [-3.2, -2.2]];
/// People keep so far from a table's edge.
const ROOM_M: f64 = 0.2;

/// The hall as it is during a leg.
pub struct Hall {
    /// With what stands in it.
    pub site: Site,
    /// What of it was not there when the program saw the hall empty.
    pub put_in: Vec<Furniture>,
    pub seats_m: Vec<DVec2>,
    /// Those through which people can walk.
    pub doors_m: Vec<DVec2>,
    /// Corners of what walkers go round, counter-clockwise.
    pub blocked_m: Vec<Vec<DVec2>>,
}

impl Hall {
    /// As it is in that state.
    pub fn of(state: usize) -> Self {
        let mut seats_m = SEATS_M;
        match state {
            2 => seats_m[0] = MOVED_M[0],
            3 => seats_m[1] = MOVED_M[1],
            _ => {}
        }
        let is_open = state % 2 == 1;
        let stool = |position_m| Furniture { position_m, size_m: STOOL_M, yaw_deg: 0.0 };
        let mut things: Vec<Furniture> = seats_m.map(stool).into();
        things.push(leaf(is_open));
        let [least, most] = SEATS_PLACE_M;
        let mut blocked_m =
            vec![[least, [most[0], least[1]], most, [least[0], most[1]]].map(DVec2::from_array).to_vec()];
        if state == 3 {
            let table = Furniture { position_m: [3.0, -4.5], size_m: [1.2, 0.7, 0.75], yaw_deg: 20.0 };
            blocked_m.push(corners_m(&table));
            things.push(table);
        }
        let put_in = match state {
            0 => Vec::new(),
            _ => things.iter().filter(|thing| !Self::of(0).site.furniture.contains(thing)).cloned().collect(),
        };
        let mut site = Config::default().site;
        site.furniture.extend(things);
        let open = DOORS_M.len() - usize::from(!is_open);
        let seats_m = seats_m.map(DVec2::from_array).to_vec();
        Self { site, put_in, seats_m, doors_m: DOORS_M[..open].to_vec(), blocked_m }
    }
}

/// Of the door: closed it stands across the way, open along it.
fn leaf(is_open: bool) -> Furniture {
    let (position_m, yaw_deg) = if is_open { ([8.55, 9.19], 45.0) } else { ([9.19, 9.19], 135.0) };
    Furniture { position_m, size_m: [0.9, 0.05, 2.0], yaw_deg }
}

fn corners_m(thing: &Furniture) -> Vec<DVec2> {
    let [length_m, width_m, _] = thing.size_m;
    let half_m = DVec2::new(length_m / 2.0 + ROOM_M, width_m / 2.0 + ROOM_M);
    let along = DVec2::from_angle(thing.yaw_deg.to_radians());
    let corner =
        |x: f64, y: f64| DVec2::from_array(thing.position_m) + along.rotate(half_m * DVec2::new(x, y));
    vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]
}
