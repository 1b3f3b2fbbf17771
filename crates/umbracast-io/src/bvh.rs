//! Motion capture in BVH text: the position of every joint in each frame.
//!
//! Format: a tree of joints with offsets and channels, then one line of channel values a frame. Rotations apply in
//! the order of their channels. Lengths are in the file's unit, y is up.
//!
//! Written by hand: the joints' positions are most of the work, and no parser of the format gives them.

use std::path::Path;

use umbracast::Error;

/// More joints than any body has; deeper trees are refused before they are walked.
const JOINTS_MAX: usize = 1000;

/// A recorded motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// From one frame to the next, seconds.
    pub frame_s: f64,
    /// Names of the joints, parents first; end sites have none and are left out.
    pub joints: Vec<String>,
    /// By frame and joint: x, y (up), z in the file's unit.
    pub positions: Vec<Vec<[f64; 3]>>,
}

/// A joint of the tree.
struct Joint {
    name: String,
    parent: Option<usize>,
    offset: [f64; 3],
    channels: Vec<Channel>,
}

#[derive(Clone, Copy)]
enum Channel {
    Position(usize),
    Rotation(usize),
}

/// A rotation, row by row.
pub(crate) type Matrix = [[f64; 3]; 3];

/// Reads a file.
///
/// # Errors
/// A file that cannot be read, or as [`parse`], with its path.
pub fn read(path: &Path) -> Result<Motion, Error> {
    let text = std::fs::read_to_string(path).map_err(|e| Error::new(e.to_string()).within(path.display()))?;
    parse(&text).map_err(|e| e.within(path.display()))
}

/// The same from text.
///
/// # Errors
/// A word that is not where the format has it, a frame with too few values, numbers that are not finite.
pub fn parse(text: &str) -> Result<Motion, Error> {
    let mut words = Words { text: text.split_whitespace() };
    words.expect("HIERARCHY")?;
    let joints = hierarchy(&mut words)?;
    words.expect("MOTION")?;
    words.expect("Frames:")?;
    let frames = words.number("number of frames")?;
    words.expect("Frame")?;
    words.expect("Time:")?;
    let frame_s = words.number("frame time")?;
    if frame_s <= 0.0 {
        return Err(Error::new(format!("frame time: expected more than 0 s, found {frame_s}")));
    }
    let mut positions = Vec::new();
    // Counted by the values that are there, so that a wrong number of frames asks for no memory.
    while (positions.len() as f64) < frames {
        let frame = positions.len();
        positions.push(pose(&joints, &mut words).map_err(|e| e.within(format!("frame {frame}")))?);
    }
    Ok(Motion { frame_s, joints: joints.into_iter().map(|joint| joint.name).collect(), positions })
}

struct Words<'a> {
    text: std::str::SplitWhitespace<'a>,
}

impl<'a> Words<'a> {
    fn next(&mut self, expected: &str) -> Result<&'a str, Error> {
        self.text.next().ok_or_else(|| Error::new(format!("expected {expected}, found the end of the file")))
    }

    fn expect(&mut self, word: &str) -> Result<(), Error> {
        let found = self.next(word)?;
        let wrong = || Error::new(format!("expected {word}, found {found:?}"));
        (found == word).then_some(()).ok_or_else(wrong)
    }

    fn number(&mut self, what: &str) -> Result<f64, Error> {
        let found = self.next(what)?;
        let value = found.parse().ok().filter(|v: &f64| v.is_finite());
        value.ok_or_else(|| Error::new(format!("{what}: expected a number, found {found:?}")))
    }
}

/// The tree, flat. End sites are read and forgotten.
fn hierarchy(words: &mut Words) -> Result<Vec<Joint>, Error> {
    words.expect("ROOT")?;
    let mut joints: Vec<Joint> = Vec::new();
    // The open braces: a joint each, `None` for an end site.
    let mut open: Vec<Option<usize>> = Vec::new();
    let begin = |words: &mut Words, joints: &mut Vec<Joint>, parent: Option<usize>| {
        let name = words.next("a joint's name")?.to_owned();
        if joints.len() == JOINTS_MAX {
            return Err(Error::new(format!("joints: expected {JOINTS_MAX} at most, found {name:?} beyond")));
        }
        words.expect("{")?;
        joints.push(Joint { name, parent, offset: [0.0; 3], channels: Vec::new() });
        Ok(Some(joints.len() - 1))
    };
    open.push(begin(words, &mut joints, None)?);
    while let Some(&inside) = open.last() {
        match words.next("a joint's lines")? {
            "OFFSET" => {
                let offset = [words.number("offset")?, words.number("offset")?, words.number("offset")?];
                inside.into_iter().for_each(|joint| joints[joint].offset = offset);
            }
            "CHANNELS" => {
                let count = words.number("number of channels")?;
                for _ in 0..count.clamp(0.0, 6.0) as usize {
                    let channel = channel(words.next("a channel")?)?;
                    inside.into_iter().for_each(|joint| joints[joint].channels.push(channel));
                }
            }
            "JOINT" => open.push(begin(words, &mut joints, inside)?),
            "End" => {
                words.expect("Site")?;
                words.expect("{")?;
                open.push(None);
            }
            "}" => {
                open.pop();
            }
            found => return Err(Error::new(format!("expected a joint's lines, found {found:?}"))),
        }
    }
    Ok(joints)
}

fn channel(name: &str) -> Result<Channel, Error> {
    let axis = "XYZ".find(&name[..name.chars().next().map_or(0, char::len_utf8)]).unwrap_or(0);
    match name.get(1..) {
        Some("position") => Ok(Channel::Position(axis)),
        Some("rotation") => Ok(Channel::Rotation(axis)),
        _ => Err(Error::new(format!("expected a channel such as Xrotation, found {name:?}"))),
    }
}

/// Where the joints are by one line of values.
fn pose(joints: &[Joint], words: &mut Words) -> Result<Vec<[f64; 3]>, Error> {
    let mut placed: Vec<([f64; 3], Matrix)> = Vec::with_capacity(joints.len());
    for joint in joints {
        let (mut shift, mut turn) = (joint.offset, IDENTITY);
        for channel in &joint.channels {
            let value = words.number(&joint.name)?;
            match *channel {
                Channel::Position(axis) => shift[axis] += value,
                Channel::Rotation(axis) => turn = product(&turn, &about(axis, value.to_radians())),
            }
        }
        let (origin, parent) = joint.parent.map_or(([0.0; 3], IDENTITY), |parent| placed[parent]);
        let shift = times(&parent, shift);
        let place: [f64; 3] = std::array::from_fn(|i| origin[i] + shift[i]);
        if !place.iter().all(|value| value.is_finite()) {
            let name = &joint.name;
            return Err(Error::new(format!("{name}: expected a place, found lengths too large to add up")));
        }
        placed.push((place, product(&parent, &turn)));
    }
    Ok(placed.into_iter().map(|(position, _)| position).collect())
}

pub(crate) const IDENTITY: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn about(axis: usize, angle_rad: f64) -> Matrix {
    let (sin, cos) = angle_rad.sin_cos();
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut matrix = IDENTITY;
    (matrix[i][i], matrix[i][j]) = (cos, -sin);
    (matrix[j][i], matrix[j][j]) = (sin, cos);
    matrix
}

pub(crate) fn times(m: &Matrix, v: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

pub(crate) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARM: &str = "HIERARCHY ROOT Hips { OFFSET 0 0 0
        CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
        JOINT Elbow { OFFSET 0 2 0 CHANNELS 3 Zrotation Xrotation Yrotation
        JOINT Wrist { OFFSET 1 0 0 CHANNELS 3 Zrotation Xrotation Yrotation End Site { OFFSET 0 1 0 } } } }
        MOTION Frames: 2 Frame Time: 0.01
        0 1 0 0 0 0  0 0 0  0 0 0
        5 0 0 90 0 90  0 0 90  0 0 0";

    #[test]
    fn joints_follow_their_parents_in_the_order_of_the_channels() {
        let motion = parse(ARM).unwrap();
        assert_eq!(motion.joints, ["Hips", "Elbow", "Wrist"]);
        assert_eq!(motion.positions[0], [[0.0, 1.0, 0.0], [0.0, 3.0, 0.0], [1.0, 3.0, 0.0]]);
        // First a quarter about the old z, then one about the new x: y points along z then.
        let near = |found: [f64; 3], expected: [f64; 3]| {
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
        };
        near(motion.positions[1][1], [5.0, 0.0, 2.0]);
        // The elbow's own quarter about y takes x to -z, which the parent holds along +x.
        near(motion.positions[1][2], [4.0, 0.0, 2.0]);
    }

    #[test]
    fn what_is_wrong_is_told() {
        let refused = |from: &str, to: &str| parse(&ARM.replace(from, to)).unwrap_err().to_string();
        assert!(refused("MOTION", "MOVIE").contains("expected MOTION, found \"MOVIE\""));
        assert!(refused("Xrotation\n", "rotation\n").contains("such as Xrotation"));
        assert!(
            refused("Frames: 2", "Frames: 3").contains("frame 2: Hips: expected a number")
                || refused("Frames: 2", "Frames: 3").contains("frame 2: expected Hips, found the end")
        );
        assert!(refused("0.01", "0").contains("frame time: expected more than 0 s"));
        assert!(refused("5 0 0 90", "5 0 0 nan").contains("frame 1: Hips: expected a number, found \"nan\""));
        assert!(parse("").unwrap_err().to_string().contains("HIERARCHY"));
        let endless = ARM
            .replace("OFFSET 0 2 0", "OFFSET 1e308 1e308 1e308")
            .replace("OFFSET 1 0 0", "OFFSET 1e308 1e308 1e308");
        assert!(parse(&endless).unwrap_err().to_string().contains("frame 0: Wrist: expected a place"));
    }
}
