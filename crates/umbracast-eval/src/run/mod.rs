//! Scenes run through the whole chain, scored one by one, kept on disk, and pooled.

pub mod scene_score;
pub mod chain;
pub mod scene_file;
pub mod experiment;
pub mod pooled;
pub mod recorded;
pub mod ablate;
