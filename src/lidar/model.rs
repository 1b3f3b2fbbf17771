//! What a sensor model is, and what each family of models must provide.

use std::fmt::{self, Debug};
use std::sync::Arc;

use super::{Beam, Column};

/// Times beyond this (146 years from the epoch) are no sensor's; below it sums of times cannot overflow.
pub(super) const TIME_LIMIT_NS: u64 = 1 << 62;
/// A whole turn, hundredths of a degree.
pub(super) const TURN_CDEG: u32 = 36_000;

/// A spinning sensor.
///
/// ```
/// let model = umbracast::lidar::Model::vlp_16();
/// assert_eq!((model.name, model.beams.len()), ("vlp-16", 16));
/// ```
#[derive(Clone)]
pub struct Model {
    /// Its name in a site file.
    pub name: &'static str,
    /// The beams of a column in firing order.
    pub beams: Arc<[Beam]>,
    /// From one column to the next.
    pub column_period_ns: f64,
    /// Of a sensor whose columns are the same in every revolution.
    pub turn: Option<Turn>,
    /// How columns stand in its packets.
    pub(super) format: Arc<dyn Format>,
}

/// Columns that fire at the same azimuths in every revolution.
///
/// ```
/// let turn = umbracast::lidar::Model::by_name("os0-128")?.turn.expect("an Ouster's columns repeat");
/// assert_eq!((turn.columns, turn.first_cdeg), (1024, 18_000.0));
/// # Ok::<(), umbracast::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turn {
    /// How many there are.
    pub columns: u32,
    /// Azimuth of the head at the first, hundredths of a degree.
    pub first_cdeg: f64,
}

impl Model {
    /// Length of a whole packet of columns, bytes.
    ///
    /// ```
    /// use umbracast::lidar::Model;
    ///
    /// assert_eq!(Model::hdl_32e().packet_bytes(), 1206);
    /// assert_eq!(Model::by_name("os0-128")?.packet_bytes(), 8448);
    /// # Ok::<(), umbracast::Error>(())
    /// ```
    pub fn packet_bytes(&self) -> usize {
        self.format.packet_bytes(self)
    }
}

impl fmt::Debug for Model {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Model")
            .field("name", &self.name)
            .field("format", &self.format)
            .finish_non_exhaustive()
    }
}

/// What a site file says of a model.
pub(super) struct Setting<'a> {
    /// As the table spells it.
    pub name: &'static str,
    /// Revolutions a second, where the sensor's own file does not say.
    pub rate_hz: f64,
    /// The text of the sensor's own file.
    pub calibration: Option<&'a str>,
}

/// Takes a column with its ranges and reflectivities.
pub(super) type Sink<'a> = &'a mut dyn FnMut(Column, &[f32], &[u8]);

/// How columns stand in the packets of a family.
pub(super) trait Format: Debug + Send + Sync {
    /// Of a whole packet.
    fn columns_per_packet(&self, model: &Model) -> usize;
    /// Length of a whole packet.
    fn packet_bytes(&self, model: &Model) -> usize;
    /// Gives each column, in order of time, to `sink`, or none and why.
    fn decode(&self, model: &Model, received_ns: i64, payload: &[u8], sink: Sink) -> Result<(), Refused>;
    /// The payload of columns that follow one another: what `packet::encode` promises. Ranges that are missing are no returns.
    fn encode(&self, model: &Model, columns: &[Column], range_m: &[f32], reflectivity: &[u8]) -> Vec<u8>;
}

/// Why a packet gives no column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Refused {
    /// The sensor sends it too, but it holds no ranges: its position, its motion.
    NoRanges,
    /// Longer or shorter than a packet of this sensor.
    WrongSize,
    /// Of the right length, and not what this sensor sends.
    NotUnderstood,
}

/// Whole units of a range, 0 for what is negative, not a number or more than `most`.
pub(super) fn units_of(range_m: f32, unit_m: f32, most: u32) -> u32 {
    // The cast takes what is negative or not a number to 0. Of what is not, the sum with a half is exact and its whole part what
    // `round` gives, which is a call where it is no instruction.
    let units = (f64::from(range_m / unit_m) + 0.5) as u32;
    if units > most { 0 } else { units }
}

/// The azimuth of column `c` of a packet in whole hundredths of a degree; past the last one the head turns on.
pub(super) fn whole_azimuth_cdeg(model: &Model, columns: &[Column], c: usize) -> u16 {
    let last = c.min(columns.len() - 1);
    let past_ns = (c - last) as f64 * model.column_period_ns;
    let column = &columns[last];
    let azimuth_cdeg = f64::from(column.azimuth_cdeg) + f64::from(column.azimuth_rate_cdeg_per_ns) * past_ns;
    (azimuth_cdeg.round() as i64).rem_euclid(i64::from(TURN_CDEG)) as u16
}

/// A name as it is compared.
pub(super) fn letters(name: &str) -> String {
    name.to_ascii_lowercase().replace(['-', '_', ' '], "")
}

#[cfg(test)]
mod tests {
    use super::units_of;

    #[test]
    fn units_are_rounded_as_round_does() {
        let halves = (0..200_000).map(|k| k as f32 * 0.5);
        let ranges_m = halves.flat_map(|range_m| [range_m, range_m.next_up(), range_m.next_down()]);
        let odd = [8_388_609.0, 3e9, 1e20, f32::INFINITY, f32::NAN, -0.3, -0.7, -1e20];
        for range_m in ranges_m.chain(odd) {
            assert_eq!(units_of(range_m, 1.0, u32::MAX), range_m.round() as u32, "{range_m}");
        }
    }
}
