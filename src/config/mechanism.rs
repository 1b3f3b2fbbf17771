//! The mechanisms of the default mode. Each can be left out alone: `umbracast ablate`.

use serde::{Deserialize, Serialize};

/// A part of the default mode that can be left out.
///
/// ```
/// use umbracast::{Config, config::Mechanism};
///
/// let no_arms = Config::default().without(Mechanism::Arms);
/// assert_eq!(no_arms.blockage.without, [Mechanism::Arms]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mechanism {
    /// Stage 1: ranges of the empty scene by pixel; plainest: voxels.
    RangeModel,
    /// Stage 1: evidence for one person more or fewer; plainest: DP-means.
    CountTest,
    /// Stage 1: clusters guided by where people are expected.
    GuidedAssignment,
    /// Stage 1: the network of the pose; plainest: points moved away from their sensor, and their mean, no phase of the gait, and
    /// no heading of who never walked.
    Pose,
    /// Stage 1: whether sensors can see a person.
    Visibility,
    /// Stage 1: several motion models; plainest: one density of white acceleration for all.
    MotionModels,
    /// Stage 1: the motion model of people who stand.
    StandingModel,
    /// Stage 1: the sway of the body followed; plainest: more noise.
    Sway,
    /// Stage 1: the phase of the gait and how far each hand swings; plainest: any phase, and hands that swing as most do.
    Stride,
    /// Stage 1: how tall a person is; plainest: as tall as adults on the mean.
    Height,
    /// Stage 1: the outline of each body, learned by watching; plainest: a usual one.
    Outline,
    /// Stage 1: where the points of each body lie, learned by watching, and what is carried over the head; plainest: a usual body.
    Shape,
    /// Stage 1: prams, walking frames and laps that go with somebody; plainest: people.
    Things,
    /// Stage 1: children and people who sit.
    ChildrenAndSeated,
    /// Stage 2: the residual network; plainest: constant velocity.
    Residual,
    /// Stage 2: its departures from constant velocity; plainest: its spread alone.
    ResidualDeparture,
    /// Stage 2: what it reads of a person's neighbours.
    ResidualNeighbours,
    /// Stage 3: arms.
    Arms,
    /// Stage 3: arms that swing.
    ArmSwing,
    /// Stage 3: a trunk that sways.
    TrunkSway,
    /// Stage 3: one sampled trajectory for all steps; plainest: each step by itself.
    JointSampling,
}

impl Mechanism {
    /// All, in the order of the data.
    pub const ALL: [Self; 21] = [
        Self::RangeModel,
        Self::CountTest,
        Self::GuidedAssignment,
        Self::Pose,
        Self::Visibility,
        Self::MotionModels,
        Self::StandingModel,
        Self::Sway,
        Self::Stride,
        Self::Height,
        Self::Outline,
        Self::Shape,
        Self::Things,
        Self::ChildrenAndSeated,
        Self::Residual,
        Self::ResidualDeparture,
        Self::ResidualNeighbours,
        Self::Arms,
        Self::ArmSwing,
        Self::TrunkSway,
        Self::JointSampling,
    ];

    /// The stages whose `without` may name it; none for those that a plainer method takes the place of.
    ///
    /// ```
    /// use umbracast::config::Mechanism;
    ///
    /// assert_eq!(Mechanism::Sway.stages(), ["track"]);
    /// assert!(Mechanism::Residual.stages().is_empty(), "constant velocity takes its place");
    /// ```
    pub fn stages(self) -> &'static [&'static str] {
        match self {
            Self::RangeModel | Self::CountTest | Self::Residual => &[],
            Self::GuidedAssignment => &["detect"],
            Self::ChildrenAndSeated => &["detect", "track"],
            Self::Pose
            | Self::Visibility
            | Self::MotionModels
            | Self::StandingModel
            | Self::Sway
            | Self::Stride
            | Self::Height
            | Self::Outline
            | Self::Shape
            | Self::Things => &["track"],
            Self::ResidualDeparture | Self::ResidualNeighbours => &["forecast"],
            Self::Arms | Self::ArmSwing | Self::TrunkSway | Self::JointSampling => &["blockage"],
        }
    }

    /// As tables and files call it.
    ///
    /// ```
    /// assert_eq!(umbracast::config::Mechanism::Stride.name(), "stride");
    /// ```
    pub fn name(self) -> &'static str {
        match self {
            Self::RangeModel => "range-model",
            Self::CountTest => "count-test",
            Self::GuidedAssignment => "guided-assignment",
            Self::Pose => "pose",
            Self::Visibility => "visibility",
            Self::MotionModels => "motion-models",
            Self::StandingModel => "standing-model",
            Self::Sway => "sway",
            Self::Stride => "stride",
            Self::Height => "height",
            Self::Outline => "outline",
            Self::Shape => "shape",
            Self::Things => "things",
            Self::ChildrenAndSeated => "children-and-seated",
            Self::Residual => "residual",
            Self::ResidualDeparture => "residual-departure",
            Self::ResidualNeighbours => "residual-neighbours",
            Self::Arms => "arms",
            Self::ArmSwing => "arm-swing",
            Self::TrunkSway => "trunk-sway",
            Self::JointSampling => "joint-sampling",
        }
    }
}
