//! What a hall sends to other systems and takes from them: topics of ROS 2; warnings, decisions, frames and lists of objects over
//! MQTT.

use std::sync::{Arc, Mutex, PoisonError, RwLock};

use serde::Deserialize;
use umbracast::{Error, Site};
use umbracast_io::reports;
use umbracast_live::heard::Ear;
use umbracast_live::log::Event;
use umbracast_live::run::Listener;
use umbracast_live::{HostClock, Published};
use zenoh::{Session, Wait};

use crate::keys::{Keys, chunk};
use crate::mqtt::{Hears, Mqtt, Sender};
use crate::ros2::{Face, names};

/// `[network.ros2]` of the site file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ros2 {
    /// `ROS_DOMAIN_ID`.
    #[serde(default)]
    pub domain: u32,
    /// True where halls share a domain: every topic begins with the hall's name.
    #[serde(default)]
    pub namespace: bool,
}

/// Tells every frame. Shared by whoever tells it.
pub struct Outward {
    face: Option<Mutex<Face>>,
    sender: Option<Sender>,
    /// As it was last read: reports name its access points.
    site: Arc<RwLock<Site>>,
}

impl Outward {
    /// Opens what is asked for; `None` where that is nothing. Only ROS 2 needs a session. `hears` gets what access points heard,
    /// `told` what happens to the connection with a broker.
    ///
    /// # Errors
    /// A session that cannot be opened, a hall that ROS 2 cannot name, a broker's name that is none.
    pub fn open(
        session: impl Fn() -> Result<Session, Error>,
        hall: &str,
        site: &Site,
        ros2: Option<Ros2>,
        mqtt: Option<&Mqtt>,
        hears: (Ear, HostClock),
        told: impl Fn(Event) + Send + 'static,
    ) -> Result<Option<Arc<Self>>, Error> {
        let face = |Ros2 { domain, namespace }| {
            let namespace = if namespace { names::namespace(hall)? } else { String::new() };
            Face::new(&session()?, domain, &namespace, site).map(Mutex::new)
        };
        let face = ros2.map(face).transpose().map_err(|e| e.within("network.ros2"))?;
        let site = Arc::new(RwLock::new(site.clone()));
        let (known, (ear, clock)) = (site.clone(), hears);
        let reports = move |json: &[u8]| {
            let site = known.read().unwrap_or_else(PoisonError::into_inner);
            reports::from_json(json, &site, clock.now_ns()).map(|reports| ear(&reports))
        };
        let lists = mqtt.filter(|mqtt| mqtt.objects).map(|_| session()).transpose()?;
        let pass_on = lists.map(|session| lists_into(session, hall));
        let objects = move |source: &str, list: &[u8]| pass_on.iter().for_each(|put| put(source, list));
        let hears = Hears { reports: Box::new(reports), objects: Box::new(objects) };
        let sender = mqtt.map(|mqtt| Sender::start(mqtt, hall, hears, told)).transpose()?;
        Ok((face.is_some() || sender.is_some()).then(|| Arc::new(Self { face, sender, site })))
    }

    /// Who tells `listener` tells this too.
    pub fn beside(this: Option<Arc<Self>>, listener: Listener) -> Listener {
        match this {
            None => listener,
            Some(this) => Box::new(move |published| {
                listener(published);
                this.tell(published);
            }),
        }
    }

    /// Another site with the same sensors from the next frame on.
    pub fn take_over(&self, site: &Site) {
        self.site.write().unwrap_or_else(PoisonError::into_inner).clone_from(site);
        if let Some(face) = &self.face {
            face.lock().unwrap_or_else(PoisonError::into_inner).take_over(site);
        }
    }

    /// Tells a frame; waits for nobody.
    fn tell(&self, published: &Published) {
        if let Some(sender) = &self.sender {
            sender.frame(published);
            published.events.iter().for_each(|event| sender.send(event, published.term));
            published.advice.iter().for_each(|advice| sender.advise(advice, published.term));
        }
        let Some(face) = &self.face else { return };
        let mut face = face.lock().unwrap_or_else(PoisonError::into_inner);
        // An error is a session that was closed: then nobody is there to be told.
        let _ = face.publish(&published.results());
    }
}

/// Puts lists that come otherwise than over Zenoh where the tracker of a hall hears them: takes the source's name, and the bytes.
pub fn lists_into(session: Session, hall: &str) -> impl Fn(&str, &[u8]) + Send + Sync + 'static {
    let keys = Keys::new(hall);
    move |source, list| {
        // A source that is no chunk of a key, or a session that was closed: nobody can be told.
        if let Ok(source) = chunk(source) {
            let _ = session.put(keys.of(&format!("objects/{source}")), list).wait();
        }
    }
}
