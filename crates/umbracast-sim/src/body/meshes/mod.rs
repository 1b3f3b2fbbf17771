//! People whose surface is somebody else's: meshes with a skin from glTF files, driven by the poses of our own bodies.
//!
//! Two families come with the crate (`bodies/README.md`). A file of one's own serves as well (`read`).

mod fit;
mod read;
mod skin;

use std::sync::Arc;

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use umbracast::Error;
use umbracast::geometry::DVec3;

use super::build::Build;
use super::skeleton::{BONES, Bone};
use crate::random::stream;

pub use skin::Skin;

/// Between two people of one mesh: their size, one standard deviation as a share. An assumption: more people than meshes.
const SIZE: f64 = 0.01;
/// Of so many people who are nearest to a known height, one is drawn.
const NEAREST: usize = 4;

/// Everybody of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Meshes {
    /// What tells these people from others.
    pub name: String,
    people: Vec<Person>,
}

/// One person at rest as the file has them, in metres: x ahead, y left, z up, on the floor, arms anywhere.
#[derive(Debug, Clone, PartialEq)]
pub struct Person {
    /// A man's step width and lean.
    male: bool,
    /// What of the height is shoes.
    shoe_m: f64,
    bmi: f64,
    /// Where each bone begins.
    joints_m: [DVec3; BONES],
    /// Where the forearms end, left and right.
    wrists_m: [DVec3; 2],
    vertices: Vec<Vertex>,
    /// Corners, counter-clockwise from outside.
    triangles: Vec<[u32; 3]>,
}

/// A place on the surface and the bones that it follows.
#[derive(Debug, Clone, PartialEq)]
struct Vertex {
    at_m: DVec3,
    /// Bones with their shares, which sum up to 1; the greatest comes first.
    bones: Vec<(Bone, f64)>,
}

impl Meshes {
    /// The families that come with the crate, `a` or `b`: 16 people each, clothed, aged 18 to 60 and 30 to 80.
    ///
    /// # Errors
    /// Another name.
    pub fn family(name: &str) -> Result<Self, Error> {
        let bytes: &[u8] = match name {
            "a" => include_bytes!("../../../bodies/family-a.glb"),
            "b" => include_bytes!("../../../bodies/family-b.glb"),
            _ => return Err(Error::new(format!("family of meshes: expected a or b, found {name:?}"))),
        };
        Self::read(name, bytes)
    }

    /// The people of a binary glTF file. Its mesh with a skin is one of them and each morph target another. The joints of the
    /// skin are called as the bones here (`Bone`); where `extras` of the mesh tell the joints of each person, these count.
    ///
    /// # Errors
    /// A file that is not glTF, or lacks mesh, skin, bones or people who stand on two legs.
    pub fn read(name: &str, bytes: &[u8]) -> Result<Self, Error> {
        let people = read::people(bytes)?;
        people.iter().try_for_each(fit::check)?;
        Ok(Self { name: name.to_owned(), people })
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.people.len()
    }

    /// Nobody; no file is read like that.
    pub fn is_empty(&self) -> bool {
        self.people.is_empty()
    }

    /// Body and skin of the person with this seed; `height_m`, with shoes, where it is known.
    pub fn draw(&self, seed: u64, height_m: Option<f64>) -> (Build, Arc<Skin>) {
        let rng = &mut stream(seed, "mesh", 0);
        let (drawn, size): (f64, f64) = (rng.random(), StandardNormal.sample(rng));
        let person = match height_m {
            None => &self.people[(drawn * self.people.len() as f64) as usize],
            Some(height_m) => {
                let mut near: Vec<&Person> = self.people.iter().collect();
                near.sort_by(|a, b| {
                    let off = |person: &Person| (fit::height_m(person) - height_m).abs();
                    off(a).total_cmp(&off(b))
                });
                near[(drawn * near.len().min(NEAREST) as f64) as usize]
            }
        };
        let scale = match height_m {
            None => 1.0 + SIZE * size.clamp(-2.0, 2.0),
            Some(height_m) => height_m / fit::height_m(person),
        };
        let (build, skin) = fit::fitted(person, scale);
        (build, Arc::new(skin))
    }
}

#[cfg(test)]
mod tests;
