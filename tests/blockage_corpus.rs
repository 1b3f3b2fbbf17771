//! Every implementation of stage 3 against `testdata/blockage/scenes.toml`, whose answers were computed by hand.

use serde::Deserialize;
use umbracast::blockage::algorithm1::{PersonBox, Rays};
use umbracast::blockage::body::{self, Posture};
use umbracast::blockage::body_model::{Arms, BodyModel, Slice};
use umbracast::geometry::{Aabb, DMat3, DVec2, DVec3, Obb};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Corpus {
    scene: Vec<Scene>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Scene {
    name: String,
    why: String,
    access_point_m: DVec3,
    people: Vec<Person>,
    aabb: Option<Vec<bool>>,
    obb: Vec<bool>,
    body: Vec<bool>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Person {
    position_m: DVec2,
    size_m: DVec3,
    yaw_deg: f64,
}

impl Person {
    fn aabb(&self) -> Aabb {
        let half = self.size_m.truncate() * 0.5;
        Aabb {
            min_m: (self.position_m - half).extend(0.0),
            max_m: (self.position_m + half).extend(self.size_m.z),
        }
    }

    fn obb(&self) -> Obb {
        Obb {
            site_from_box: DMat3::from_rotation_z(self.yaw_deg.to_radians()),
            ..Obb::from_aabb(&self.aabb())
        }
    }
}

fn corpus() -> Vec<Scene> {
    let text = include_str!("../testdata/blockage/scenes.toml");
    toml::from_str::<Corpus>(text).expect("the corpus is TOML").scene
}

fn algorithm1(scene: &Scene, person_box: impl Fn(&Person) -> PersonBox) -> Vec<bool> {
    let people: Vec<_> = scene.people.iter().map(|p| (p.position_m, person_box(p))).collect();
    let mut blocked = vec![false; people.len()];
    Rays::default().cast_step(scene.access_point_m, &people, &mut blocked);
    blocked
}

#[test]
fn algorithm_1_on_axis_aligned_boxes() {
    for scene in corpus() {
        let Some(expected) = &scene.aabb else { continue };
        let found = algorithm1(&scene, |p| PersonBox::Aabb(p.aabb()));
        assert_eq!(&found, expected, "{}: {}", scene.name, scene.why);
    }
}

#[test]
fn algorithm_1_on_oriented_boxes() {
    for scene in corpus() {
        let found = algorithm1(&scene, |p| PersonBox::Obb(p.obb()));
        assert_eq!(found, scene.obb, "{}: {}", scene.name, scene.why);
    }
}

#[test]
fn trunk_and_head() {
    for scene in corpus() {
        let people = &scene.people;
        let blocked = |q: usize| {
            let ue_m = people[q].position_m.extend(0.5 * people[q].size_m.z);
            let hit = |p: &Person| {
                let ahead = DVec2::from_angle(p.yaw_deg.to_radians());
                let posture = Posture::standing(p.position_m, ahead, p.size_m.z);
                body::blocks(&trunk_and_head_of(p.size_m.z), &posture, scene.access_point_m, ue_m)
            };
            (0..people.len()).any(|p| p != q && hit(&people[p]))
        };
        let found: Vec<bool> = (0..people.len()).map(blocked).collect();
        assert_eq!(found, scene.body, "{}: {}", scene.name, scene.why);
    }
}

/// A trunk of 0.26 x 0.56 m up to .82 of the height with a head of 0.2 m; the arms are within the trunk.
fn trunk_and_head_of(height_m: f64) -> BodyModel {
    let slice = |top: f64, depth_m: f64, width_m: f64| Slice {
        top,
        half_depth: 0.5 * depth_m / height_m,
        half_width: 0.5 * width_m / height_m,
        ahead: 0.0,
        left: 0.0,
    };
    let body = BodyModel::shipped();
    let arms = Arms { shoulder_out: 0.0, elbow_out: 0.0, hand_out: 0.0, ..body.arms };
    BodyModel {
        slices: vec![slice(0.82, 0.26, 0.56), slice(1.0, 0.2, 0.2)],
        sway_left: 0.0,
        sway_ahead: 0.0,
        arms: Arms { upper_radius: 0.01, fore_radius: 0.01, ..arms },
    }
}
