//! The network keys of a hall.

use umbracast::Error;

use crate::role::Role;

/// Keys of one hall, `umbracast/HALL/...`.
///
/// | key | who writes | what |
/// |---|---|---|
/// | `sensor/NAMES/foreground` | front end, by its sensors with commas between | new points and views of one frame |
/// | `priors` | tracker that leads | where people are expected in the next frame |
/// | `followed` | tracker that leads | everybody followed, for a forecast in another process |
/// | `state` | tracker that leads | what a tracker needs to go on, twice a second; query: the newest that is known |
/// | `detections` | tracker that leads | rows |
/// | `tracks` | forecast | everybody followed with forecasts |
/// | `links` | cast | rows of every link |
/// | `losses`, `bindings`, `decisions` | cast | rows of the radio, where the site has one |
/// | `warnings/AP` | cast | what changed of the links of an access point |
/// | `json` | cast | tracks, links, losses and decisions of a frame as JSON, while somebody listens |
/// | `health/ROLE/ID` | everybody | load and what was skipped, once a second |
/// | `objects/SOURCE` | others' perception | lists of objects in place of stage 1 |
/// | `reports/SOURCE` | controllers, serving nodes | JSON of what access points heard of devices: `umbracast_io::reports` |
/// | `config/site`, `config/background/NAME`, `config/weights` | query | settings, from whoever has them |
/// | `node/ROLE/ID` | liveliness | who is there |
#[derive(Debug, Clone)]
pub struct Keys {
    hall: String,
}

impl Keys {
    /// Of a hall, whose name is one chunk: [`chunk`].
    pub fn new(hall: &str) -> Self {
        Self { hall: hall.to_owned() }
    }

    /// The hall.
    pub fn hall(&self) -> &str {
        &self.hall
    }

    /// A key of the hall, by its end: `links`, or `sensor/*/foreground` of all front ends.
    pub fn of(&self, end: &str) -> String {
        format!("umbracast/{}/{end}", self.hall)
    }

    /// Foreground of a front end, by its name: [`front_end`].
    pub fn foreground(&self, front_end: &str) -> String {
        self.of(&format!("sensor/{front_end}/foreground"))
    }

    /// Warnings of an access point.
    pub fn warnings(&self, access_point: &str) -> String {
        self.of(&format!("warnings/{access_point}"))
    }

    /// The packets of one sensor in the empty hall.
    pub fn background(&self, sensor: &str) -> String {
        self.of(&format!("config/background/{sensor}"))
    }

    /// The liveliness token of a node.
    pub fn node(&self, role: Role, id: &str) -> String {
        self.of(&format!("node/{}/{id}", role.name()))
    }

    /// Health of a node.
    pub fn health(&self, role: Role, id: &str) -> String {
        self.of(&format!("health/{}/{id}", role.name()))
    }
}

/// The name of a front end in its key: those of the sensors that it covers, by their places, in the site's order. What a
/// message covers must be what its key names, because a router lets a front end write by the key. `None` where a place is none.
pub fn front_end(sensors: &[String], covers: &[u32]) -> Option<String> {
    let names: Option<Vec<&str>> =
        covers.iter().map(|&place| sensors.get(place as usize).map(String::as_str)).collect();
    names.map(|names| names.join(","))
}

/// A name as one chunk of a key: not empty, without what Zenoh gives a meaning.
///
/// # Errors
/// What was found.
pub fn chunk(name: &str) -> Result<String, Error> {
    let fits = !name.is_empty() && !name.starts_with('@') && !name.contains(['/', '*', '$', '?', '#']);
    match fits {
        true => Ok(name.to_owned()),
        false => Err(Error::new(format!(
            "expected a name without / * $ ? # that does not begin with @, found {name:?}"
        ))),
    }
}
