//! The turning head of a sensor: the time and direction of each column.

use std::ops::Range;

use umbracast::lidar::{Column, Model, packet};
use umbracast::site::Sensor;
use umbracast::{Health, STEP_NS};

/// A sensor's clock and motor. Column 0 of a scene fires at time 0, at the cut.
#[derive(Debug, Clone)]
pub struct Head {
    /// What turns.
    pub model: Model,
    /// Azimuth at time 0, hundredths of a degree.
    pub cut_cdeg: f64,
    /// How fast it turns.
    pub rate_cdeg_per_ns: f64,
}

impl Head {
    /// The head of a sensor of a site.
    pub fn new(model: Model, sensor: &Sensor) -> Self {
        let (cut_cdeg, rate_hz) = (sensor.cut_deg * 100.0, sensor.rate_hz);
        match model.turn {
            None => Self { cut_cdeg, rate_cdeg_per_ns: rate_hz * 36_000.0e-9, model },
            // Where columns repeat, the cut is at the packet that begins next to it, and the sensor's own file may
            // name the speed.
            Some(turn) => {
                let column_cdeg = 36_000.0 / f64::from(turn.columns);
                let packet_cdeg = column_cdeg * packet::columns_per_packet(&model) as f64;
                let packets = ((cut_cdeg - turn.first_cdeg) / packet_cdeg).round();
                Self {
                    cut_cdeg: turn.first_cdeg + packets * packet_cdeg,
                    rate_cdeg_per_ns: column_cdeg / model.column_period_ns,
                    model,
                }
            }
        }
    }

    /// Columns in a packet.
    pub fn packet_columns(&self) -> u64 {
        packet::columns_per_packet(&self.model) as u64
    }

    /// Azimuth swept since azimuth 0, not wrapped. Clockwise from above.
    pub fn turned_cdeg(&self, time_ns: i64) -> f64 {
        self.cut_cdeg + self.rate_cdeg_per_ns * time_ns as f64
    }

    /// When a column fires. A packet tells the time of its first column in whole microseconds; the head fires at
    /// the time that the packet tells, so that what is decoded is exact.
    pub fn time_ns(&self, column: u64) -> i64 {
        let in_packet = column % self.packet_columns();
        // Casts leave the part below one away as `floor` does, and `round` of what is at least a half is this sum's whole part:
        // both are calls where they are no instructions. A column takes more than a nanosecond.
        let packet_ns = ((column - in_packet) as f64 * self.model.column_period_ns) as i64;
        packet_ns / 1000 * 1000 + (in_packet as f64 * self.model.column_period_ns + 0.5) as i64
    }

    /// The columns that fire in frame `index`: from its start, before its end.
    pub fn frame_columns(&self, index: u64) -> Range<u64> {
        self.first_column_from(index as i64 * STEP_NS)..self.first_column_from((index as i64 + 1) * STEP_NS)
    }

    fn first_column_from(&self, time_ns: i64) -> u64 {
        let mut column = (time_ns as f64 / self.model.column_period_ns) as u64;
        while self.time_ns(column) < time_ns {
            column += 1;
        }
        column
    }

    /// The columns of a packet as the head turns through them.
    pub fn turn(&self, packet: u64) -> Vec<Column> {
        let first = packet * self.packet_columns();
        let column = |i| {
            let time_ns = self.time_ns(first + i);
            Column {
                time_ns,
                azimuth_cdeg: within_turn(self.turned_cdeg(time_ns)) as f32,
                azimuth_rate_cdeg_per_ns: self.rate_cdeg_per_ns as f32,
            }
        };
        (0..self.packet_columns()).map(column).collect()
    }

    /// Columns as a decoder gives them. A packet holds rounded azimuths, and the decoder interpolates and rounds
    /// again: the simulated beams are fired along exactly these directions, so that range and decoded direction
    /// belong together. (A real head is up to 0.01 degrees beside what it reports.)
    pub fn reported(&self, columns: Range<u64>) -> Vec<Column> {
        let per_packet = self.packet_columns();
        let mut reported = Vec::with_capacity((columns.end - columns.start) as usize);
        for packet in columns.start / per_packet..columns.end.div_ceil(per_packet) {
            let turn = self.turn(packet);
            let packet_ns = turn[0].time_ns;
            let sent = packet::encode_columns(&self.model, &turn, packet_ns);
            let mut number = packet * per_packet;
            packet::decode(&self.model, &sent, &mut Health::default(), |column, _, _| {
                if columns.contains(&number) {
                    reported.push(column);
                }
                number += 1;
            });
        }
        reported
    }
}

/// An azimuth without whole turns: what `rem_euclid` gives, which divides bit after bit.
fn within_turn(azimuth_cdeg: f64) -> f64 {
    const TURN_CDEG: f64 = 36_000.0;
    // Up to here multiples of a turn are exact, and so is their difference to what is less than a turn away.
    if !(0.0..1e12).contains(&azimuth_cdeg) {
        return azimuth_cdeg.rem_euclid(TURN_CDEG);
    }
    // The quotient may have been rounded up to a whole number.
    let rest_cdeg = azimuth_cdeg - (azimuth_cdeg / TURN_CDEG) as i64 as f64 * TURN_CDEG;
    if rest_cdeg < 0.0 { rest_cdeg + TURN_CDEG } else { rest_cdeg }
}

#[cfg(test)]
mod tests {
    use umbracast::Config;
    use umbracast::lidar::Model;

    use super::{Head, within_turn};

    #[test]
    fn a_column_fires_in_the_whole_nanosecond_that_is_nearest() {
        for model in ["hdl-32e", "vlp-16", "os0-32", "xt32"] {
            let head = Head::new(Model::by_name(model).unwrap(), &Config::default().site.sensors[0]);
            let (period_ns, columns) = (head.model.column_period_ns, head.packet_columns());
            for column in (0..100_000).chain(1 << 40..(1 << 40) + 100) {
                let (first, within) = (column - column % columns, column % columns);
                let packet_us = (first as f64 * period_ns).floor() as i64 / 1000;
                let expected_ns = packet_us * 1000 + (within as f64 * period_ns).round() as i64;
                assert_eq!(head.time_ns(column), expected_ns, "{model}, {column}");
            }
        }
    }

    #[test]
    fn an_azimuth_within_the_turn_is_the_euclidean_remainder_to_the_last_bit() {
        let turns = (0..2_000).map(|k| f64::from(k * 7_919 % 10_007) * 36_000.0);
        let azimuths_cdeg = turns.flat_map(|cdeg| {
            [cdeg, cdeg.next_up(), cdeg.next_down(), cdeg + 0.1, cdeg + 17_999.3, cdeg * 45.7, -cdeg - 0.3]
        });
        for azimuth_cdeg in azimuths_cdeg {
            let expected_cdeg = azimuth_cdeg.rem_euclid(36_000.0);
            assert_eq!(within_turn(azimuth_cdeg).to_bits(), expected_cdeg.to_bits(), "{azimuth_cdeg}");
        }
    }
}
