//! Switches of `track`.

use serde::{Deserialize, Serialize};

/// See `config/default.toml` for every value and its reason.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrackConfig {}
