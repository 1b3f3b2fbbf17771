//! What a network says of its devices, and what is made of it.

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

/// How likely a device is carried by a person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Binding {
    /// As its reports name it.
    pub device: u64,
    /// The person.
    pub track: u64,
    /// The probability. Those of a device sum to less than 1 where it may be with nobody who is followed.
    pub p: f64,
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
