//! Motion capture as rows of joints' turns: text, comma-separated, 117 numbers a row.
//!
//! Format, as H. Zhang et al. and C. Li et al. (2018) repackage the CMU Graphics Lab Motion Capture Database: the root's
//! x, y (up), z, then for each of 38 joints a turn as axis times angle in radians. The turn is that of minus the vector.
//! The first row is the skeleton's T-pose, all others are frames at 60 Hz. There are no lengths of bones: turns are counted
//! from the T-pose and put on a skeleton of usual proportions, as tall as lets its feet tread the floor at y = 0.

use umbracast::Error;

use crate::bvh::{IDENTITY, Matrix, Motion, product, times};

/// Every second frame of 120 Hz.
const FRAME_S: f64 = 1.0 / 60.0;
/// One unit of length (0.45 inch is the database's own).
const UNIT_M: f64 = 0.0254 / 0.45;
const JOINTS: usize = 38;
/// Numbers of a row.
const COLUMNS: usize = 3 + 3 * JOINTS;
/// Ankle joints of who treads the floor, as a share of the stature.
const ANKLE: f64 = 0.039;

/// A joint that is told: its place in a row, its name, its parent's place among these joints, and the bone from there in
/// the T-pose, in shares of the stature: x to the left, y up, z ahead.
///
/// Lengths of legs and arms: Drillis and Contini; hips and shoulders apart, spine and feet from memory.
struct Bone(usize, &'static str, usize, [f64; 3]);

const BONES: [Bone; 18] = [
    Bone(0, "Hips", 0, [0.0, 0.0, 0.0]),
    Bone(2, "LeftUpLeg", 0, [0.048, -0.055, 0.02]),
    Bone(3, "LeftLeg", 1, [0.0, -0.245, 0.0]),
    Bone(4, "LeftFoot", 2, [0.0, -0.246, 0.0]),
    Bone(5, "LeftToeBase", 3, [0.0, -0.03, 0.1]),
    Bone(8, "RightUpLeg", 0, [-0.048, -0.055, 0.02]),
    Bone(9, "RightLeg", 5, [0.0, -0.245, 0.0]),
    Bone(10, "RightFoot", 6, [0.0, -0.246, 0.0]),
    Bone(11, "RightToeBase", 7, [0.0, -0.03, 0.1]),
    Bone(14, "Spine", 0, [0.0, 0.09, 0.0]),
    Bone(15, "Spine1", 9, [0.0, 0.09, 0.0]),
    Bone(16, "Neck", 10, [0.0, 0.1, 0.0]),
    Bone(21, "LeftArm", 10, [0.1, 0.08, 0.0]),
    Bone(22, "LeftForeArm", 12, [0.186, 0.0, 0.0]),
    Bone(23, "LeftHand", 13, [0.146, 0.0, 0.0]),
    Bone(30, "RightArm", 10, [-0.1, 0.08, 0.0]),
    Bone(31, "RightForeArm", 15, [-0.186, 0.0, 0.0]),
    Bone(32, "RightHand", 16, [-0.146, 0.0, 0.0]),
];

/// Parents of a row's joints, parents first; the root is its own.
const PARENTS: [usize; JOINTS] = [
    0, 0, 1, 2, 3, 4, 5, 0, 7, 8, 9, 10, 11, 0, 13, 14, 15, 16, 17, 18, 15, 20, 21, 22, 23, 24, 25, 23, 27,
    15, 29, 30, 31, 32, 33, 34, 32, 36,
];

/// The motion in a text.
///
/// # Errors
/// A row with too few or too many numbers, numbers that are not finite, no frame, nobody who stands.
pub fn parse(text: &str) -> Result<Motion, Error> {
    let rows = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let rows: Vec<[f64; COLUMNS]> = rows
        .map(|(number, line)| row(line).map_err(|e| e.within(format!("line {}", number + 1))))
        .collect::<Result<_, _>>()?;
    let [t_pose, frames @ ..] = rows.as_slice() else {
        return Err(Error::new("expected a T-pose and frames, found no row"));
    };
    // From the joints' frames in the T-pose to the body's: bones are told in the latter.
    let resting = turns(t_pose).map(|turn| transposed(&turn));
    let turned: Vec<[Matrix; JOINTS]> = frames
        .iter()
        .map(|frame| {
            let now = turns(frame);
            std::array::from_fn(|joint| product(&now[joint], &resting[joint]))
        })
        .collect();
    // The lower ankle treads the floor: so tall is the body, on the mean of all frames.
    let deep = |turned: &[Matrix; JOINTS]| {
        let joints = placed(turned, [0.0; 3], 1.0);
        -joints[3][1].min(joints[7][1])
    };
    let hips: f64 = frames.iter().map(|frame| frame[1]).sum();
    let reach: f64 = turned.iter().map(|turned| deep(turned) + ANKLE).sum();
    let tall = hips / reach;
    if frames.is_empty() || !tall.is_finite() || tall * UNIT_M < 0.5 {
        return Err(Error::new("expected frames of somebody who stands on y = 0, found none"));
    }
    let place = |(frame, turned): (&[f64; COLUMNS], _)| {
        let places = placed(turned, [frame[0], frame[1], frame[2]], tall);
        places.map(|place| place.map(|v| v * UNIT_M)).to_vec()
    };
    let positions: Vec<Vec<[f64; 3]>> = frames.iter().zip(&turned).map(place).collect();
    if !positions.iter().flatten().flatten().all(|v| v.is_finite()) {
        return Err(Error::new("expected places, found lengths too large to add up"));
    }
    Ok(Motion { frame_s: FRAME_S, joints: BONES.iter().map(|bone| bone.1.to_owned()).collect(), positions })
}

fn row(line: &str) -> Result<[f64; COLUMNS], Error> {
    let mut numbers = [0.0; COLUMNS];
    let mut count = 0;
    for word in line.split(',') {
        let value = word.trim().parse().ok().filter(|v: &f64| v.is_finite());
        let value = value.ok_or_else(|| Error::new(format!("expected a number, found {word:?}")))?;
        if let Some(number) = numbers.get_mut(count) {
            *number = value;
        }
        count += 1;
    }
    match count {
        COLUMNS => Ok(numbers),
        _ => Err(Error::new(format!("expected {COLUMNS} numbers, found {count}"))),
    }
}

/// How each joint is turned in a row, parents' turns included.
fn turns(row: &[f64; COLUMNS]) -> [Matrix; JOINTS] {
    let mut all = [IDENTITY; JOINTS];
    for joint in 0..JOINTS {
        let own = turn([0, 1, 2].map(|i| -row[3 + 3 * joint + i]));
        all[joint] = if joint == 0 { own } else { product(&all[PARENTS[joint]], &own) };
    }
    all
}

/// The turn by a vector's length about it (Rodrigues).
fn turn(vector: [f64; 3]) -> Matrix {
    let angle = vector.iter().map(|v| v * v).sum::<f64>().sqrt();
    if angle < 1e-12 {
        return IDENTITY;
    }
    let [x, y, z] = vector.map(|v| v / angle);
    let (sin, cos) = angle.sin_cos();
    let rest = 1.0 - cos;
    [
        [cos + x * x * rest, x * y * rest - z * sin, x * z * rest + y * sin],
        [y * x * rest + z * sin, cos + y * y * rest, y * z * rest - x * sin],
        [z * x * rest - y * sin, z * y * rest + x * sin, cos + z * z * rest],
    ]
}

fn transposed(matrix: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| matrix[j][i]))
}

/// The joints of a body so tall.
fn placed(turned: &[Matrix; JOINTS], root: [f64; 3], tall: f64) -> [[f64; 3]; BONES.len()] {
    let mut places = [root; BONES.len()];
    for (i, Bone(joint, _, from, bone)) in BONES.iter().enumerate().skip(1) {
        // A bone turns with the joint that it begins at.
        let along = times(&turned[PARENTS[*joint]], bone.map(|v| v * tall));
        places[i] = std::array::from_fn(|k| places[*from][k] + along[k]);
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A T-pose and a frame in which some joints are turned by these.
    fn text(turned: &[(usize, [f64; 3])]) -> String {
        let line = |turned: &[(usize, [f64; 3])]| {
            let mut row = vec![0.0; COLUMNS];
            row[1] = 17.0;
            for (joint, turn) in turned {
                row[3 + 3 * joint..6 + 3 * joint].copy_from_slice(turn);
            }
            row.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
        };
        // Thighs are turned in the T-pose as the database has them.
        let rest = [(2, [0.0, 0.0, 0.366_519]), (8, [0.0, 0.0, -0.366_519])];
        let kept: Vec<(usize, [f64; 3])> = rest
            .iter()
            .filter(|(joint, _)| turned.iter().all(|(other, _)| other != joint))
            .copied()
            .collect();
        format!("{}\n{}\n", line(&rest), line(&[&kept[..], turned].concat()))
    }

    #[test]
    fn who_stands_has_hanging_legs_and_arms_to_the_sides_and_treads_the_floor() {
        let motion = parse(&text(&[])).unwrap();
        let at = |name: &str| motion.positions[0][motion.joints.iter().position(|j| j == name).unwrap()];
        let (hip, foot, hand) = (at("LeftUpLeg"), at("LeftFoot"), at("LeftHand"));
        assert!((hip[0] - foot[0]).abs() < 1e-9 && (hip[2] - foot[2]).abs() < 1e-9);
        assert!((foot[1] / at("Hips")[1] - ANKLE / (0.055 + 0.491 + ANKLE)).abs() < 1e-9, "{foot:?}");
        assert!(hand[0] > 0.5 && (hand[1] - at("LeftArm")[1]).abs() < 1e-9, "{hand:?}");
        assert!(at("LeftToeBase")[2] > foot[2] + 0.1);
    }

    #[test]
    fn a_turn_is_that_of_minus_the_vector() {
        // A quarter about the knee's axis, which is x once the thigh hangs: the shank points backward.
        let motion = parse(&text(&[(3, [-1.466_46, -0.562_92, 0.0])])).unwrap();
        let at = |name: &str| motion.positions[0][motion.joints.iter().position(|j| j == name).unwrap()];
        let (knee, foot) = (at("LeftLeg"), at("LeftFoot"));
        assert!(foot[2] < knee[2] - 0.3 && (foot[1] - knee[1]).abs() < 0.01, "{knee:?} {foot:?}");
        assert!((at("RightLeg")[2] - at("RightFoot")[2]).abs() < 1e-9);
    }

    #[test]
    fn what_is_wrong_is_told() {
        let refused = |text: &str| parse(text).unwrap_err().to_string();
        assert!(refused("").contains("found no row"));
        assert!(refused("1,2,3").contains("line 1: expected 117 numbers, found 3"));
        assert!(refused(&text(&[]).replacen("17,", "nan,", 1)).contains("expected a number, found \"nan\""));
        let t_pose = text(&[]).lines().next().unwrap().to_owned();
        assert!(refused(&t_pose).contains("somebody who stands"));
        assert!(refused(&text(&[]).replace("17,", "-17,")).contains("somebody who stands"));
    }
}
