//! What has to be so, and what is not.

use std::fmt::Debug;
use std::ops::RangeBounds;

/// What was asked so far, and whether any of it is not so.
#[derive(Debug, Default)]
pub struct Verdict {
    pub broken: usize,
}

impl Verdict {
    /// Tells what was found, and whether that may be.
    pub fn expect(&mut self, what: &str, found: f64, bounds: impl RangeBounds<f64> + Debug) {
        let kept = bounds.contains(&found);
        self.broken += usize::from(!kept);
        println!("{:10} {what}: {found:.4}, must be in {bounds:?}", if kept { "kept" } else { "NOT KEPT" });
    }
}
