//! Counts of the input that the running pipeline could not use. It skips such input and recovers.

use serde::{Deserialize, Serialize};

/// Counters of everything broken that was skipped. All zero on clean input.
///
/// ```
/// use umbracast::{Config, Health, lidar::{Assembler, Packet}};
///
/// let mut health = Health::default();
/// let broken = Packet { time_ns: 0, payload: vec![0; 7] };
/// Assembler::new(&Config::default().site)?.push(0, &broken, &mut health);
/// assert_eq!(health.packets_wrong_size, 1);
/// # Ok::<(), umbracast::Error>(())
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)] // An account that was written before a counter came has none of it.
pub struct Health {
    /// Packets whose length is not a sensor packet's.
    pub packets_wrong_size: u64,
    /// Packets with a block flag, a model byte or a return mode that the codec does not know.
    pub packets_not_understood: u64,
    /// Packets older than a frame that is already closed.
    pub packets_late: u64,
    /// Packets with a column that is there already.
    pub packets_duplicate: u64,
    /// Jumps of a sensor's clock, or leaps of all time, by more than a frame.
    pub clock_jumps: u64,
    /// Scans that are not there: one a sensor and frame without a packet of it.
    pub sensors_missing: u64,
    /// Points dropped because they are not finite, or nearer or farther than the sensor can measure.
    pub points_invalid: u64,
    /// Frames dropped because their time does not lie after the last one's.
    pub frames_out_of_order: u64,
    /// Foreground points dropped because there were more than the configured limit in one frame.
    pub points_over_limit: u64,
    /// Frames in which so many people could come in each other's way that fewer samples were cast than the configuration
    /// says, or losses were worked out of fewer: nobody was left out, probabilities are coarser.
    pub frames_with_fewer_samples: u64,
    /// Times that a sensor was found to hang elsewhere than it was thought to, by the floor and the walls it sees. Its pose is
    /// put right while the program runs; `umbracast calibrate` puts it right in the site file.
    pub sensors_moved: u64,
    /// Times that sensors' clocks were found apart, by the people who walk before several of them, and put right.
    pub clocks_corrected: u64,
}

impl Health {
    /// True when nothing was skipped.
    ///
    /// ```
    /// use umbracast::Health;
    ///
    /// assert!(Health::default().is_clean());
    /// assert!(!Health { clock_jumps: 1, ..Health::default() }.is_clean());
    /// ```
    pub fn is_clean(&self) -> bool {
        *self == Self::default()
    }

    /// Adds another account to this one.
    ///
    /// ```
    /// use umbracast::Health;
    ///
    /// let mut day = Health { packets_late: 2, ..Health::default() };
    /// day.add(&Health { packets_late: 3, ..Health::default() });
    /// assert_eq!(day.packets_late, 5);
    /// ```
    pub fn add(&mut self, other: &Self) {
        // An account may come from outside: numbers that no program counts to must not overflow.
        let sum = |own: &mut u64, more: u64| *own = own.saturating_add(more);
        sum(&mut self.packets_wrong_size, other.packets_wrong_size);
        sum(&mut self.packets_not_understood, other.packets_not_understood);
        sum(&mut self.packets_late, other.packets_late);
        sum(&mut self.packets_duplicate, other.packets_duplicate);
        sum(&mut self.clock_jumps, other.clock_jumps);
        sum(&mut self.sensors_missing, other.sensors_missing);
        sum(&mut self.points_invalid, other.points_invalid);
        sum(&mut self.frames_out_of_order, other.frames_out_of_order);
        sum(&mut self.points_over_limit, other.points_over_limit);
        sum(&mut self.frames_with_fewer_samples, other.frames_with_fewer_samples);
        sum(&mut self.sensors_moved, other.sensors_moved);
        sum(&mut self.clocks_corrected, other.clocks_corrected);
    }
}
