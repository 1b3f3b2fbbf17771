//! A node's front end, and where its packets come from: sockets, topics of ROS 2, a recording.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use umbracast::{Config, Error, Frame};
use umbracast_io::fields;
use umbracast_io::nodes::{Foreground, Priors};
use umbracast_io::point_cloud::PointCloud;
use umbracast_live::queue::{Queue, WhenFull};
use umbracast_live::receive::{Arrived, Receivers};
use umbracast_live::run::{PACKETS_BYTES, PACKETS_WAITING};

use super::{Node, Source, lock};
use crate::front::{Expected, Front, takes_clouds};
use crate::hall::{Hall, Urgency};
use crate::role::Role;
use crate::{ros2, share};

/// Clouds that wait for it: the newest are worth most.
const CLOUDS_WAITING: usize = 3;
/// How often those are looked for whom a replay waits for.
const LOOK: Duration = Duration::from_millis(50);
/// What is there is known to all others so much later.
const SETTLED: Duration = Duration::from_millis(500);

impl Node {
    pub(super) fn open_front(
        &mut self,
        config: &Config,
        own: &[usize],
        empty: &[Frame],
        source: Source,
    ) -> Result<(), Error> {
        let clock = self.clock;
        let expected = Arc::<Expected>::default();
        let mut front = Front::new(config, own, empty, expected.clone(), clock)?;
        self._subscribers.push(self.hall.hear(&self.hall.keys().of("priors"), move |_, bytes| {
            if let Some(priors) = fields::decode::<Priors>(&bytes.to_bytes()) {
                expected.hear(priors, clock.now_ns());
            }
        })?);
        let names: Vec<&str> = own.iter().map(|&s| config.site.sensors[s].name.as_str()).collect();
        let name = crate::network::chunk(&names.join(",")).map_err(|e| e.within("site.sensors: name"))?;
        let outlet = self.hall.outlet(&self.hall.keys().foreground(&name), Urgency::Points)?;
        let counted = self.front_counted.clone();
        let publish = move |mut foreground: Foreground| {
            outlet.put(&mut foreground);
            counted.frames.fetch_add(1, Ordering::Relaxed);
            let took = Duration::from_nanos((clock.now_ns() - foreground.closed_ns).max(0) as u64);
            lock(&counted.latency).add(took);
            *lock(&counted.health) = foreground.health;
        };
        let late = Arc::<Mutex<Option<Vec<Frame>>>>::default();
        if empty.is_empty() {
            let (late, known) = (late.clone(), self.empty_hall.clone());
            let (hall, site, own) = (self.hall.clone(), config.site.clone(), own.to_vec());
            self.asks = Some(share::ask_empty_until(hall, site, own, self.stop.clone(), move |frames| {
                *lock(&late) = Some(frames);
                known.store(true, Ordering::Relaxed);
            }));
        }
        let config_of_front = config.clone();
        let look = move |front: &mut Front| {
            if let Some(empty) = lock(&late).take() {
                front.take_empty(&config_of_front, &empty);
            }
        };
        let counted = self.front_counted.clone();
        let taken = move |front: &Front| {
            counted.packets.fetch_add(1, Ordering::Relaxed);
            counted.priors_late.store(front.priors_late(), Ordering::Relaxed);
        };
        let first = &config.site.sensors[own[0]];
        if takes_clouds(first) {
            let Source::Ros2(domain, topics) = source else {
                let name = &first.name;
                return Err(Error::new(format!(
                    "sensor {name:?} gives clouds: expected a topic of them, found none"
                )));
            };
            let clouds = Arc::new(Queue::new(CLOUDS_WAITING, WhenFull::DropOldest));
            self.read_clouds(domain, &topics[0].1, &clouds)?;
            self.clouds = Some(clouds.clone());
            self.front = Some(std::thread::spawn(move || {
                while let Some(cloud) = clouds.pop() {
                    look(&mut front);
                    front.push_cloud(cloud, &publish);
                    taken(&front);
                }
            }));
            return Ok(());
        }
        let packets = Queue::of_bytes(PACKETS_WAITING, PACKETS_BYTES, Arrived::bytes, WhenFull::DropNewest);
        let packets = Arc::new(packets);
        let (queue, recorder) = (packets.clone(), self.recorder.clone());
        self.front = Some(std::thread::spawn(move || {
            while let Some(arrived) = queue.pop() {
                look(&mut front);
                front.push(&arrived, &publish);
                taken(&front);
                if let Some(recorder) = &recorder {
                    recorder.packet(arrived);
                }
            }
            front.finish(&publish);
        }));
        match source {
            Source::Doors(doors) => self.receivers = Some(Receivers::start(&doors, clock, &packets)?),
            Source::Ros2(domain, topics) => self.read_packets(domain, topics, &packets)?,
            Source::Replay(recorded, rate) => {
                let names = config.site.sensors.iter().map(|sensor| sensor.name.clone()).collect();
                self.fed = Some(self.replay(recorded, rate, own.to_vec(), names, packets.clone()));
            }
        }
        self.packets = Some(packets);
        Ok(())
    }

    fn read_packets(
        &mut self,
        domain: u32,
        topics: Vec<(usize, String)>,
        packets: &Arc<Queue<Arrived>>,
    ) -> Result<(), Error> {
        let node = ros2::Node::new(self.hall.session(), domain, "", "umbracast_sensor")?;
        for (sensor, topic) in topics {
            let (queue, counted) = (packets.clone(), self.front_counted.clone());
            self.drivers.extend(ros2::packets(&node, &topic, move |packet| match packet {
                Some(packet) => queue.push(Arrived { sensor, packet }),
                None => drop(counted.broken.fetch_add(1, Ordering::Relaxed)),
            })?);
        }
        self.driven = Some(node);
        Ok(())
    }

    fn read_clouds(
        &mut self,
        domain: u32,
        topic: &str,
        clouds: &Arc<Queue<PointCloud>>,
    ) -> Result<(), Error> {
        let node = ros2::Node::new(self.hall.session(), domain, "", "umbracast_sensor")?;
        let (queue, counted) = (clouds.clone(), self.front_counted.clone());
        self.drivers.push(ros2::clouds(&node, topic, move |cloud| match cloud {
            Some(cloud) => queue.push(cloud),
            None => drop(counted.broken.fetch_add(1, Ordering::Relaxed)),
        })?);
        self.driven = Some(node);
        Ok(())
    }

    fn replay(
        &self,
        recorded: Box<dyn Iterator<Item = Arrived> + Send>,
        rate: f64,
        own: Vec<usize>,
        sensors: Vec<String>,
        packets: Arc<Queue<Arrived>>,
    ) -> JoinHandle<()> {
        let (hall, clock, stop) = (self.hall.clone(), self.clock, self.stop.clone());
        std::thread::spawn(move || {
            while !stop.load(Ordering::Relaxed) && !all_there(&hall, &sensors) {
                std::thread::sleep(LOOK);
            }
            std::thread::sleep(SETTLED);
            let mut begun = None;
            for arrived in recorded {
                if stop.load(Ordering::Relaxed) {
                    break;
                }
                let time_ns = arrived.packet.time_ns;
                let (host_ns, first_ns) = *begun.get_or_insert((clock.now_ns(), time_ns));
                clock.sleep_until(host_ns + ((time_ns - first_ns) as f64 / rate) as i64);
                if own.contains(&arrived.sensor) {
                    packets.push(arrived);
                }
            }
            packets.close();
        })
    }
}

/// Whether front ends of all sensors are there, and all stages behind them.
fn all_there(hall: &Hall, sensors: &[String]) -> bool {
    let there = hall.nodes(Role::Sensor, LOOK);
    let named =
        |name: &String| there.iter().any(|id| id.rsplit_once('.').is_some_and(|(own, _)| own == name));
    sensors.iter().all(named)
        && [Role::Track, Role::Forecast, Role::Cast]
            .into_iter()
            .all(|role| !hall.nodes(role, LOOK).is_empty())
}
