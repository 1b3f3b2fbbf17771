//! From a binary glTF file to people.

use glam::{DMat4, DVec4};
use gltf::mesh::util::ReadJoints;
use serde::Deserialize;
use std::collections::BTreeMap;
use umbracast::Error;
use umbracast::geometry::DVec3;

use super::{Person, Vertex};
use crate::body::skeleton::{BONES, Bone};

/// What stands in `extras` of the mesh.
#[derive(Deserialize)]
struct Extras {
    people: Vec<Told>,
}

/// What is told of one person; all of it may be missing.
#[derive(Deserialize, Default)]
#[serde(default)]
struct Told {
    male: bool,
    shoe_m: f64,
    bmi: Option<f64>,
    /// Wears what the primitives called `shell` are.
    shell: bool,
    joints_m: BTreeMap<String, [f64; 3]>,
}

/// One primitive.
struct Piece {
    shell: bool,
    /// The base, then the morph targets added to it.
    people: Vec<Vec<DVec3>>,
    bones: Vec<Vec<(Bone, f64)>>,
    triangles: Vec<[u32; 3]>,
}

pub(super) fn people(bytes: &[u8]) -> Result<Vec<Person>, Error> {
    let file = gltf::Gltf::from_slice(bytes).map_err(|e| Error::new(format!("glTF: {e}")))?;
    let blob = file.blob.as_deref().ok_or_else(|| missing("a binary chunk (.glb)"))?;
    let mut skinned = file.nodes().filter_map(|node| Some((node.mesh()?, node.skin()?)));
    let (mesh, skin) = skinned.next().ok_or_else(|| missing("a mesh with a skin"))?;
    let told: Vec<Told> = match mesh.extras() {
        None => Vec::new(),
        Some(extras) => serde_json::from_str::<Extras>(extras.get()).map_or(Vec::new(), |e| e.people),
    };
    let bones: Vec<Bone> = skin.joints().map(|node| bone(node.name())).collect::<Result<_, _>>()?;
    if let Some(absent) = Bone::ALL.iter().find(|bone| !bones.contains(bone)) {
        return Err(missing(&format!("a joint {absent:?}")));
    }
    let of_base = joints_of_base(&skin, &bones, blob)?;
    let pieces: Vec<Piece> = mesh.primitives().map(|p| piece(&p, &bones, blob)).collect::<Result<_, _>>()?;
    let count = pieces.first().map(|piece| piece.people.len()).ok_or_else(|| missing("a primitive"))?;
    if pieces.iter().any(|piece| piece.people.len() != count) {
        return Err(missing("as many morph targets in each primitive"));
    }
    let nothing = Told::default();
    (0..count)
        .map(|i| {
            let told = told.get(i).unwrap_or(&nothing);
            let mut joints_m = of_base;
            for (bone, joint_m) in Bone::ALL.iter().zip(&mut joints_m) {
                if let Some(at) = told.joints_m.get(&format!("{bone:?}")) {
                    *joint_m = ours(*at);
                }
            }
            let worn = pieces.iter().filter(|piece| told.shell || !piece.shell);
            let mut person = Person {
                male: told.male,
                shoe_m: told.shoe_m,
                bmi: told.bmi.unwrap_or(25.0),
                joints_m,
                wrists_m: [DVec3::ZERO; 2],
                vertices: Vec::new(),
                triangles: Vec::new(),
            };
            for piece in worn {
                let first = person.vertices.len() as u32;
                let vertices = piece.people[i].iter().zip(&piece.bones);
                person.vertices.extend(vertices.map(|(&at_m, bones)| Vertex { at_m, bones: bones.clone() }));
                person.triangles.extend(piece.triangles.iter().map(|t| t.map(|v| first + v)));
            }
            for (i, side) in ["Left", "Right"].into_iter().enumerate() {
                let told = told.joints_m.get(&format!("Wrist{side}")).map(|at| ours(*at));
                person.wrists_m[i] = told.unwrap_or_else(|| wrist(&person, i));
            }
            Ok(person)
        })
        .collect()
}

/// Where the joints are as the skin is bound.
fn joints_of_base(skin: &gltf::Skin<'_>, bones: &[Bone], blob: &[u8]) -> Result<[DVec3; BONES], Error> {
    let reader = skin.reader(|buffer| (buffer.index() == 0).then_some(blob));
    let binds = reader.read_inverse_bind_matrices().ok_or_else(|| missing("inverse bind matrices"))?;
    let mut joints_m = [DVec3::ZERO; BONES];
    for (bone, bind) in bones.iter().zip(binds) {
        let place = DMat4::from_cols_array_2d(&bind.map(|column| column.map(f64::from))).inverse() * DVec4::W;
        joints_m[*bone as usize] = ours(place.truncate().to_array());
    }
    Ok(joints_m)
}

fn piece(primitive: &gltf::Primitive<'_>, bones: &[Bone], blob: &[u8]) -> Result<Piece, Error> {
    if primitive.mode() != gltf::mesh::Mode::Triangles {
        return Err(missing("primitives of triangles"));
    }
    let reader = primitive.reader(|buffer| (buffer.index() == 0).then_some(blob));
    let metres = |at: [f32; 3]| ours(at.map(f64::from));
    let base: Vec<DVec3> = reader.read_positions().ok_or_else(|| missing("positions"))?.map(metres).collect();
    let mut people = vec![base];
    for (moved, _, _) in reader.read_morph_targets() {
        let moved = moved.ok_or_else(|| missing("positions in each morph target"))?.map(metres);
        people.push(people[0].iter().zip(moved).map(|(at, by)| at + by).collect());
    }
    let count = people[0].len();
    let joints: ReadJoints<'_> = reader.read_joints(0).ok_or_else(|| missing("JOINTS_0"))?;
    let weights = reader.read_weights(0).ok_or_else(|| missing("WEIGHTS_0"))?.into_f32();
    let of_vertex = |(joints, weights): ([u16; 4], [f32; 4])| -> Result<Vec<(Bone, f64)>, Error> {
        let mut shares: Vec<(Bone, f64)> = Vec::new();
        for (joint, weight) in joints.into_iter().zip(weights).filter(|(_, weight)| *weight > 0.0) {
            let bone = *bones.get(usize::from(joint)).ok_or_else(|| missing("joints of the skin"))?;
            match shares.iter_mut().find(|share| share.0 == bone) {
                Some(share) => share.1 += f64::from(weight),
                None => shares.push((bone, f64::from(weight))),
            }
        }
        let sum: f64 = shares.iter().map(|share| share.1).sum();
        shares.iter_mut().for_each(|share| share.1 /= sum);
        shares.sort_by(|a, b| b.1.total_cmp(&a.1));
        if sum > 0.0 { Ok(shares) } else { Err(missing("a bone for each vertex")) }
    };
    let of_vertices: Vec<_> = joints.into_u16().zip(weights).map(of_vertex).collect::<Result<_, _>>()?;
    let corners: Vec<u32> = match reader.read_indices() {
        Some(indices) => indices.into_u32().collect(),
        None => (0..count as u32).collect(),
    };
    if people.iter().any(|person| person.len() != count)
        || of_vertices.len() != count
        || corners.iter().any(|corner| *corner as usize >= count)
    {
        return Err(missing(&format!("{count} vertices in all accessors of a primitive")));
    }
    let extras = primitive.extras().as_ref().map_or("", |extras| extras.get());
    Ok(Piece {
        shell: extras.contains("\"shell\""),
        people,
        bones: of_vertices,
        triangles: corners.as_chunks::<3>().0.to_vec(),
    })
}

/// From the elbow this much of the way to the finger's tip: .153 of the stature against .110 (ANSUR II).
const FOREARM: f64 = 0.153 / (0.153 + 0.110);

fn wrist(person: &Person, side: usize) -> DVec3 {
    let forearm = [Bone::ForearmLeft, Bone::ForearmRight][side];
    let elbow_m = person.joints_m[forearm as usize];
    let own = person.vertices.iter().filter(|vertex| vertex.bones[0].0 == forearm).map(|vertex| vertex.at_m);
    let tip = own.max_by(|a, b| a.distance(elbow_m).total_cmp(&b.distance(elbow_m)));
    elbow_m.lerp(tip.unwrap_or(elbow_m), FOREARM)
}

fn bone(name: Option<&str>) -> Result<Bone, Error> {
    let names = || Bone::ALL.map(|bone| format!("{bone:?}")).join(", ");
    let found = Bone::ALL.into_iter().find(|bone| Some(format!("{bone:?}").as_str()) == name);
    found.ok_or_else(|| {
        let name = name.unwrap_or_default();
        Error::new(format!("glTF: expected joints called {}, found {name:?}", names()))
    })
}

fn missing(what: &str) -> Error {
    Error::new(format!("glTF: expected {what}, found none"))
}

/// glTF has x to the left, y up and z ahead.
fn ours([left, up, ahead]: [f64; 3]) -> DVec3 {
    DVec3::new(ahead, left, up)
}
