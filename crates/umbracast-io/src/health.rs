//! The counters of `Health` as a message.

use umbracast::Health;

use crate::fields::{Fields, Message};

impl Message for Health {
    const NAME: &'static str = "Health";
    const WHAT: &'static str = "What was met that could not be used, counted.";

    fn empty() -> Self {
        Self::default()
    }

    fn visit(&mut self, f: &mut impl Fields) {
        f.u64("packets_wrong_size", &mut self.packets_wrong_size);
        f.u64("packets_not_understood", &mut self.packets_not_understood);
        f.u64("packets_late", &mut self.packets_late);
        f.u64("packets_duplicate", &mut self.packets_duplicate);
        f.u64("clock_jumps", &mut self.clock_jumps);
        f.u64("sensors_missing", &mut self.sensors_missing);
        f.u64("points_invalid", &mut self.points_invalid);
        f.u64("frames_out_of_order", &mut self.frames_out_of_order);
        f.u64("points_over_limit", &mut self.points_over_limit);
        f.u64("frames_with_fewer_samples", &mut self.frames_with_fewer_samples);
        f.u64("sensors_moved", &mut self.sensors_moved);
        f.u64("clocks_corrected", &mut self.clocks_corrected);
    }
}
