//! What a report needs besides the scores.

use umbracast::{Config, Mode, Site};

use crate::score::scene::{SceneRun, SceneTruth};

/// What a report is made of, beside the scores.
#[derive(Debug, Clone, Copy)]
pub struct Context<'a> {
    /// The configuration of each mode.
    pub configs: &'a [Config],
    /// The command line that makes the same report.
    pub command: &'a str,
    /// The scene that is shown by itself.
    pub kept: Option<Kept<'a>>,
    /// What a reader must know of how it was made, a paragraph each.
    pub notes: &'a [String],
}

impl Context<'_> {
    pub(super) fn site(&self) -> Option<&Site> {
        self.configs.first().map(|config| &config.site)
    }
}

/// One scene of one mode, for the figures that show an instant and a link.
#[derive(Debug, Clone, Copy)]
pub struct Kept<'a> {
    /// Its name in captions: preset and seed.
    pub label: &'a str,
    /// Whose run it is.
    pub mode: Mode,
    /// Where it took place.
    pub site: &'a Site,
    /// What was so.
    pub truth: &'a SceneTruth,
    /// What we said.
    pub run: &'a SceneRun,
}
