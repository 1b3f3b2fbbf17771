//! The arguments of who walks, how recorded people are read, and what bodies they have.

use std::path::PathBuf;

use clap::Args;
use umbracast::Error;
use umbracast_io::trajectories::Unit;
use umbracast_sim::body::kind::Kind;
use umbracast_sim::crowd::Preset;

/// Who walks.
#[derive(Debug, Clone, Args)]
pub struct CrowdArgs {
    /// The crowd: orca-03, orca-06, mixed, natural (as mixed, and people wander and stop) or pairs.
    #[arg(long, default_value = "orca-03")]
    pub preset: Preset,
    /// People in each scene.
    #[arg(long, default_value_t = 10, value_name = "N", value_parser = one_or_more)]
    pub people: usize,
    /// Seed of the first scene; each next scene has the next number. Test seeds begin at 200000.
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
}

/// How recorded people are read.
#[derive(Debug, Clone, Args)]
pub struct Replay {
    /// Frames a second of trajectories, if their file does not say.
    #[arg(long, value_name = "HZ")]
    pub fps: Option<f64>,
    /// Unit of PeTrack text, m or cm. Default: what the file says, else m.
    #[arg(long)]
    pub unit: Option<Unit>,
    /// Smoothing of the trajectories, standard deviation in seconds; 0 for none.
    #[arg(long, default_value_t = 0.12, value_name = "S")]
    pub smooth: f64,
    /// Replay this many seconds from the middle of a longer recording.
    #[arg(long, value_name = "S")]
    pub seconds: Option<f64>,
    /// Move people to the middle of the site's hall, for recordings with a frame of their own.
    #[arg(long)]
    pub centre: bool,
}

/// What bodies they have.
#[derive(Debug, Clone, Args)]
pub struct BodyArgs {
    /// Kinds of bodies with their shares of the people: bag, phone (at the ear), pockets (hands in them), child,
    /// wheelchair, cmu-walk (needs --gait), gesturing (with both hands), sitting (where they stay), rucksack, bags (one in each
    /// hand), umbrella (open), screen (a telephone before the face), carrying (a small child), pram, trolley (a suitcase
    /// behind), frame (a rollator), pushed (a wheelchair, by the person). All others are plain. Separate several with commas.
    #[arg(long, value_name = "KIND[=SHARE]", value_delimiter = ',', value_parser = body_share)]
    pub bodies: Vec<(Kind, f64)>,
    /// Motion captures of walks, for people of the kind cmu-walk: BVH, or text of joints' turns. Each person walks as one of
    /// them. Separate several with commas.
    #[arg(long, value_name = "FILE", requires = "bodies", value_delimiter = ',')]
    pub gait: Vec<PathBuf>,
    /// Whose bodies they have: own (drawn measures), a or b (families of 16 third-party meshes each), or a binary glTF file of
    /// people with a skin. Children keep bodies of our own.
    #[arg(long, value_name = "own|a|b|FILE", default_value = "own")]
    pub meshes: String,
}

pub(super) fn one_or_more(text: &str) -> Result<usize, Error> {
    let number = text.parse().ok().filter(|number| *number > 0);
    number.ok_or_else(|| Error::new(format!("expected 1 or more, found {text}")))
}

fn body_share(text: &str) -> Result<(Kind, f64), Error> {
    let (kind, share) = text.split_once('=').unwrap_or((text, "1"));
    let wrong = || Error::new(format!("share of {kind}: expected a number, found {share:?}"));
    Ok((kind.parse()?, share.parse().map_err(|_| wrong())?))
}
