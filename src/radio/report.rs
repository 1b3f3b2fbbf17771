//! What a network says of its devices.

/// What one access point heard of one device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    /// When it was heard.
    pub time_ns: i64,
    /// Which access point of the site.
    pub access_point: usize,
    /// The network's name of the device.
    pub device: u64,
    /// Received power of the reference signal, dBm.
    pub power_dbm: f64,
    /// Whether this access point is said to serve the device.
    pub serves: bool,
}

/// Which access point serves a person's device, as reports say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Served {
    /// The person who most likely carries the device.
    pub track: u64,
    /// Which access point of the site.
    pub access_point: usize,
    /// When it was heard with the device.
    pub heard_ns: i64,
}
