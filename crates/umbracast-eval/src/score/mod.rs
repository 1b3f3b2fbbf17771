//! How scores are computed: the rows of a scene, who counts, matching, sums that can be pooled, and their intervals.
//! This module runs no pipeline and no scene.

pub mod fingerprint;
pub mod scene;
#[cfg(test)]
pub(crate) mod hand_made;
pub mod counts;
pub mod bootstrap;
pub mod instances;
pub mod link_counts;
pub mod matching;
pub mod matches;
pub mod device;
pub mod identity;
pub mod stage1;
pub mod displacement;
pub mod links;
pub mod times;
pub mod labels;
