//! What scores are computed from, and how: the rows of a scene, who counts, which track is whose, sums that can be
//! pooled, and their intervals. Runs no pipeline and plays no scene.

pub mod fingerprint;
pub mod scene;
#[cfg(test)]
pub(crate) mod hand_made;
pub mod counts;
pub mod bootstrap;
pub mod instances;
pub mod link_counts;
pub mod matching;
pub mod device;
pub mod identity;
pub mod stage1;
pub mod displacement;
pub mod links;
pub mod times;
pub mod labels;
