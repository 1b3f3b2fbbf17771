//! What the default mode does beyond the plainest way, each to be left out alone: `umbracast ablate`.

use super::{
    Assignment, BackgroundMethod, BlockageMethod, Config, ForecastMethod, MeasuredAt, PositionMethod,
    SplitMethod,
};

/// A part of the default mode that can be left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mechanism {
    /// The network of the body axis; plainest: points moved 0.1 m away from their sensor, and their mean.
    AxisNetwork,
    /// Ranges of the empty scene by pixel; plainest: voxels.
    RangeModel,
    /// The count test of clusters; plainest: DP-means.
    CountTest,
    /// Clusters guided by where people are expected.
    GuidedAssignment,
    /// Points moved behind the surface before they are clustered.
    ClusterShift,
    /// A radius of clusters that grows with the range.
    ClusterRadiusGrowth,
    /// What a known person's parts count for where they do not look like a person.
    ExpectedParts,
    /// Whether sensors can see a person.
    Visibility,
    /// Several densities of white acceleration; plainest: one, 0.1 m^2/s^3.
    MotionModels,
    /// The model of people who stand.
    StandingModel,
    /// The sway of the body followed; plainest: more noise.
    Sway,
    /// The phase of the gait from the sway.
    GaitFromSway,
    /// The phase of the gait from arms and legs.
    GaitFromLimbs,
    /// Any phase of the gait.
    GaitPhase,
    /// Stage 3: arms.
    Arms,
    /// Stage 3: arms that swing.
    ArmSwing,
    /// Stage 3: a trunk that sways.
    TrunkSway,
    /// How stout a track's person is.
    BodyWidth,
    /// How tall.
    Height,
    /// Children and people who sit.
    ChildrenAndSeated,
    /// The time of each detection's points; plainest: the frame's end.
    PointTimes,
    /// Assignment by the least sum; plainest: nearest first.
    OptimalAssignment,
    /// Little belief in what shows few returns.
    HiddenNoise,
    /// Slack of the gate for who stops at once.
    GateSlack,
    /// Two people who stand close often give one detection.
    Resolution,
    /// Two tracks of one body are one.
    Duplicates,
    /// A track is confirmed by its second detection.
    Confirmation,
    /// Tracks long out of sight are not reported.
    ReportedSigma,
    /// The residual network; plainest: constant velocity.
    Residual,
    /// Its departures; plainest: its spread alone.
    ResidualDeparture,
    /// What it reads of a person's neighbours.
    ResidualNeighbours,
    /// One sampled trajectory for all steps; plainest: each step by itself.
    JointSampling,
    /// Samples; plainest: one body at the mean.
    Sampling,
    /// Bodies that differ from what tracks know of them.
    BodySpread,
    /// A threshold tuned for F1; plainest: one half.
    Threshold,
    /// Bodies; plainest: Algorithm 1.
    Bodies,
}

impl Mechanism {
    /// All, in the order of the data.
    pub const ALL: [Self; 36] = [
        Self::RangeModel,
        Self::CountTest,
        Self::GuidedAssignment,
        Self::ClusterShift,
        Self::ClusterRadiusGrowth,
        Self::ExpectedParts,
        Self::AxisNetwork,
        Self::PointTimes,
        Self::Visibility,
        Self::Resolution,
        Self::OptimalAssignment,
        Self::GateSlack,
        Self::Confirmation,
        Self::Duplicates,
        Self::ReportedSigma,
        Self::HiddenNoise,
        Self::MotionModels,
        Self::StandingModel,
        Self::Sway,
        Self::GaitFromSway,
        Self::GaitFromLimbs,
        Self::GaitPhase,
        Self::BodyWidth,
        Self::Height,
        Self::ChildrenAndSeated,
        Self::Residual,
        Self::ResidualDeparture,
        Self::ResidualNeighbours,
        Self::Bodies,
        Self::Arms,
        Self::ArmSwing,
        Self::TrunkSway,
        Self::Sampling,
        Self::JointSampling,
        Self::BodySpread,
        Self::Threshold,
    ];

    /// As tables call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::AxisNetwork => "axis network",
            Self::RangeModel => "range model",
            Self::CountTest => "count test",
            Self::GuidedAssignment => "guided assignment",
            Self::ClusterShift => "cluster shift",
            Self::ClusterRadiusGrowth => "radius growth",
            Self::ExpectedParts => "expected parts",
            Self::Visibility => "visibility",
            Self::MotionModels => "motion models",
            Self::StandingModel => "standing model",
            Self::Sway => "sway",
            Self::GaitFromSway => "gait from sway",
            Self::GaitFromLimbs => "gait from limbs",
            Self::GaitPhase => "gait phase",
            Self::Arms => "arms",
            Self::ArmSwing => "arm swing",
            Self::TrunkSway => "trunk sway",
            Self::BodyWidth => "body width",
            Self::Height => "height",
            Self::ChildrenAndSeated => "children, seated",
            Self::PointTimes => "point times",
            Self::OptimalAssignment => "optimal assignment",
            Self::HiddenNoise => "hidden noise",
            Self::GateSlack => "gate slack",
            Self::Resolution => "resolution",
            Self::Duplicates => "duplicates",
            Self::Confirmation => "confirmation",
            Self::ReportedSigma => "reported sigma",
            Self::Residual => "residual",
            Self::ResidualDeparture => "residual departure",
            Self::ResidualNeighbours => "residual neighbours",
            Self::JointSampling => "joint sampling",
            Self::Sampling => "sampling",
            Self::BodySpread => "body spread",
            Self::Threshold => "threshold",
            Self::Bodies => "bodies",
        }
    }
}

impl Config {
    /// The same without a mechanism.
    #[must_use]
    pub fn without(&self, mechanism: Mechanism) -> Self {
        let mut config = self.clone();
        let Self { detect, track, forecast, blockage, .. } = &mut config;
        match mechanism {
            Mechanism::AxisNetwork => {
                // What a constant shift leaves of the error of one frame (models/body_axis.md).
                (detect.measure.position, track.noise_floor_m) = (PositionMethod::ShiftedMean, 0.04);
            }
            Mechanism::RangeModel => detect.background.method = BackgroundMethod::Voxel,
            Mechanism::CountTest => detect.split.method = SplitMethod::DpMeans,
            Mechanism::GuidedAssignment => detect.split.evidence.guided = false,
            Mechanism::ClusterShift => detect.cluster.shift_m = 0.0,
            Mechanism::ClusterRadiusGrowth => detect.cluster.radius_per_range = 0.0,
            Mechanism::ExpectedParts => detect.measure.expected_m = 0.0,
            Mechanism::Visibility => track.visibility = false,
            Mechanism::MotionModels => {
                (track.acceleration_m2ps3, track.model_share) = (vec![0.1], vec![1.0 - track.standing_share]);
            }
            Mechanism::StandingModel => {
                let walking = 1.0 - track.standing_share;
                track.model_share.iter_mut().for_each(|share| *share /= walking);
                track.standing_share = 0.0;
            }
            Mechanism::Sway => {
                let swayed = 0.5 * (track.sway_left_m.powi(2) + track.sway_ahead_m.powi(2));
                (track.sway_left_m, track.sway_ahead_m) = (0.0, 0.0);
                track.noise_floor_m = (track.noise_floor_m.powi(2) + swayed).sqrt();
            }
            Mechanism::GaitFromSway => track.gait_from_sway = false,
            Mechanism::GaitFromLimbs => track.gait_from_limbs = false,
            Mechanism::GaitPhase => (track.gait_from_sway, track.gait_from_limbs) = (false, false),
            Mechanism::Arms => {
                (blockage.body.arms.upper_radius, blockage.body.arms.fore_radius) = (0.0, 0.0);
            }
            Mechanism::ArmSwing => blockage.body.arms.still_share = 1.0,
            Mechanism::TrunkSway => (blockage.body.sway, blockage.body.surge) = (0.0, 0.0),
            Mechanism::BodyWidth => track.girth = false,
            Mechanism::Height => (track.height_sigma_m, track.children_share) = (1e-3, 0.0),
            Mechanism::ChildrenAndSeated => {
                (track.children_share, detect.measure.seated_height_m) = (0.0, 0.0);
            }
            Mechanism::PointTimes => track.measured_at = MeasuredAt::Frame,
            Mechanism::OptimalAssignment => track.assignment = Assignment::Greedy,
            Mechanism::HiddenNoise => track.hidden_noise_m = 0.0,
            Mechanism::GateSlack => track.gate_slack_m = 0.0,
            Mechanism::Resolution => track.resolution_m = 0.0,
            Mechanism::Duplicates => track.duplicate_m = 0.0,
            Mechanism::Confirmation => track.confirm_hits = 1,
            Mechanism::ReportedSigma => track.told_sigma_max_m = f64::INFINITY,
            Mechanism::Residual => forecast.method = ForecastMethod::ConstantVelocity,
            Mechanism::ResidualDeparture => forecast.believed = 0.0,
            Mechanism::ResidualNeighbours => forecast.neighbours = false,
            Mechanism::JointSampling => blockage.joint = false,
            Mechanism::Sampling => blockage.samples = 1,
            Mechanism::BodySpread => {
                (blockage.girth_sigma, blockage.height_sigma_m, blockage.heading_sigma_deg) = (0.0, 0.0, 0.0);
            }
            Mechanism::Threshold => {
                blockage.threshold_now = 0.5;
                blockage.threshold = [0.5; crate::STEPS];
            }
            Mechanism::Bodies => blockage.method = BlockageMethod::Algorithm1,
        }
        config
    }
}
