//! What differs between two Ousters: the profile of their packets and the directions of their beams.

/// Beams of the largest sensor there is, twice.
pub(super) const BEAMS_MAX: usize = 256;

/// What a cell of a packet holds. Ranges stand at its beginning, the second one 4 bytes further.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Profile {
    /// As the metadata names it.
    pub name: &'static str,
    /// Length of a cell.
    pub cell_bytes: usize,
    /// Bits of a range.
    pub range_bits: u32,
    /// Its unit, mm.
    pub range_mm: u32,
    /// Where the reflectivity stands, and that of the second return.
    pub reflectivity_at: usize,
    pub second_at: Option<usize>,
    pub layout: Layout,
}

/// What stands around the cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Layout {
    Legacy,
    Standard,
    /// As standard, but for the places of the header's numbers.
    FunctionalSafety,
}

pub(super) const PROFILES: [Profile; 6] = [
    profile("LEGACY", 12, (20, 1), 4, None, Layout::Legacy),
    profile("RNG15_RFL8_NIR8", 4, (15, 8), 2, None, Layout::Standard),
    profile("RNG15_RFL8_NIR8_DUAL", 8, (15, 8), 2, Some(6), Layout::Standard),
    profile("RNG19_RFL8_SIG16_NIR16", 12, (19, 1), 4, None, Layout::Standard),
    profile("RNG19_RFL8_SIG16_NIR16_DUAL", 16, (19, 1), 3, Some(7), Layout::Standard),
    profile("FUSA_RNG15_RFL8_NIR8_DUAL", 8, (15, 8), 2, Some(6), Layout::FunctionalSafety),
];

const fn profile(
    name: &'static str,
    cell_bytes: usize,
    (range_bits, range_mm): (u32, u32),
    reflectivity_at: usize,
    second_at: Option<usize>,
    layout: Layout,
) -> Profile {
    Profile { name, cell_bytes, range_bits, range_mm, reflectivity_at, second_at, layout }
}

/// All that differs between two sensors.
#[derive(Debug, Clone)]
pub(super) struct Geometry {
    pub profile: Profile,
    pub columns: u32,
    pub columns_per_packet: usize,
    pub rate_hz: f64,
    /// From the highest beam down, as cells come.
    pub elevation_deg: Vec<f64>,
    /// To the right of the column.
    pub azimuth_deg: Vec<f64>,
    /// From the lidar's middle to where a beam starts: outwards and up.
    pub arm_m: f64,
    pub lift_m: f64,
    /// From the lidar to the sensor's frame: a turn about z, counter-clockwise from above, and a step up.
    pub yaw_rad: f64,
    pub up_m: f64,
}

impl Geometry {
    /// The data sheet's: beams evenly over the field of view, four azimuths in turn as the captures of an OS-0-128 and
    /// an OS-1-128 have them, and the manufacturer's design values for the rest. Each sensor departs from it by
    /// up to a degree: its own metadata tell.
    pub fn nominal(name: &'static str, rate_hz: f64) -> Self {
        let (line, rows) = name.split_once('-').unwrap_or((name, "128"));
        let rows: usize = rows.parse().unwrap_or(128);
        let (half_fov_deg, aside_deg, arm_m) = match line {
            "os0" => (45.0, 3.6, 0.027_67),
            "os1" => (22.5, 1.4, 0.015_806),
            _ => (11.25, 0.7, 0.013_762),
        };
        let elevation = |row: usize| half_fov_deg * (1.0 - 2.0 * row as f64 / (rows - 1) as f64);
        Self {
            profile: PROFILES[1],
            columns: 1024,
            columns_per_packet: 16,
            rate_hz,
            elevation_deg: (0..rows).map(elevation).collect(),
            azimuth_deg: (0..rows).map(|row| aside_deg * [3.0, 1.0, -1.0, -3.0][row % 4]).collect(),
            arm_m,
            lift_m: 0.0,
            yaw_rad: std::f64::consts::PI,
            up_m: 0.036_18,
        }
    }
}
