//! Outputs besides the page: ROS 2 and MQTT, if `[network]` of the site file has them. A build without nodes has
//! neither.

use std::path::Path;

use umbracast::{Error, Site};
use umbracast_live::HostClock;
use umbracast_live::heard::Ear;
use umbracast_live::log::Event;
use umbracast_live::run::Listener;

/// Nobody, or those whom the site file names.
#[derive(Default)]
pub struct Outward {
    #[cfg(feature = "node")]
    told: Option<std::sync::Arc<umbracast_node::outward::Outward>>,
}

#[cfg(feature = "node")]
impl Outward {
    /// Opens what the site file asks for. `hears` gets what access points heard, `told` what happens to a connection.
    pub fn of_site_file(
        file: Option<&Path>,
        site: &Site,
        hears: (Ear, HostClock),
        told: impl Fn(Event) + Send + 'static,
    ) -> Result<Self, Error> {
        use umbracast_node::network::Network;
        let Some(file) = file else { return Ok(Self::default()) };
        let network = Network::of_site_file(&crate::setup::read_text(file)?, file)?;
        if network.mqtt.as_ref().is_some_and(|mqtt| mqtt.objects) {
            let story = "network.mqtt.objects: `live` reads sensors' packets alone; lists of objects go to \
                         `umbracast node track,forecast,cast,serve`";
            return Err(Error::new(story).within(file.display()));
        }
        Self::of_network(
            &network,
            || network.open(),
            &network.hall(site).unwrap_or_default(),
            site,
            hears,
            told,
        )
    }

    /// The same of settings that are read already.
    pub fn of_network(
        network: &umbracast_node::network::Network,
        session: impl Fn() -> Result<umbracast_node::Session, Error>,
        hall: &str,
        site: &Site,
        hears: (Ear, HostClock),
        told: impl Fn(Event) + Send + 'static,
    ) -> Result<Self, Error> {
        use umbracast_node::outward::Outward;
        let opened = Outward::open(session, hall, site, network.ros2, network.mqtt.as_ref(), hears, told)?;
        Ok(Self { told: opened })
    }

    /// Who tells `listener` tells them too.
    pub fn beside(&self, listener: Listener) -> Listener {
        umbracast_node::outward::Outward::beside(self.told.clone(), listener)
    }

    /// Another site with the same sensors from the next frame on.
    pub fn take_over(&self, site: &Site) {
        if let Some(told) = &self.told {
            told.take_over(site);
        }
    }
}

#[cfg(not(feature = "node"))]
impl Outward {
    pub fn of_site_file(
        _: Option<&Path>,
        _: &Site,
        _: (Ear, HostClock),
        _: impl Fn(Event),
    ) -> Result<Self, Error> {
        Ok(Self {})
    }

    pub fn beside(&self, listener: Listener) -> Listener {
        listener
    }

    pub fn take_over(&self, _: &Site) {}
}
