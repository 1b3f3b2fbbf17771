//! What a fleet meets from day to day: nodes that start in any order, connections that say nothing, wrong passwords, a node that
//! hangs, two nodes at one broker, a front end that forges. On the loopback interface of this host.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::sleep;
use std::time::Duration;

use umbracast::Error;
use umbracast_node::network::Network;
use zenoh::{Session, Wait};

use super::{Running, clock, shell};

/// Connections without a word.
const IDLE: usize = 150;
/// Whoever has not ended this long after it was asked to, does not.
const ENDS_S: f64 = 12.0;
const MOMENT: Duration = Duration::from_secs(2);

/// What happened, and whether that is what must happen.
type Seen = Result<(String, bool), Error>;

/// A table of all of them; an error where one is not what it must be.
pub fn cases(command: &Path, folder: &Path) -> Result<(), Error> {
    let bench = Bench { command, folder };
    bench.files()?;
    let (right, found) = (bench.warnings(true)?, bench.warnings(false)?);
    let as_many = found > 0 && right.abs_diff(found) <= right / 10;
    println!("\n{:68} {:44} happened", "what failed, on one host", "what must happen");
    let cases: [(&str, &str, Seen); 8] = [
        (
            "a front end starts 5 s before the tracker, which has the empty hall",
            "as many warnings as the other way round",
            Ok((format!("{found} warnings, {right} the other way round"), as_many)),
        ),
        (
            "150 connections without a word, again and again",
            "a front end that comes back is let in",
            bench.idle(),
        ),
        ("a client whose router is not there", "it says so and ends when asked to", bench.client(false)),
        ("a client with a wrong password", "it says so and ends when asked to", bench.client(true)),
        (
            "a users file that others can read",
            "refused, with the chmod that closes it",
            bench.open_users_file(),
        ),
        ("the only caster hangs", "fleet names it and ends with code 1", bench.hangs()),
        ("two nodes serve one hall at one MQTT broker", "neither throws the other out", bench.brokers()),
        (
            "a front end answers for the empty hall, and sends for another",
            "nobody gets either",
            bench.forges(),
        ),
    ];
    let mut wrong = Vec::new();
    for (what, must, seen) in cases {
        let (happened, well) = seen.map_err(|e| e.within(what))?;
        println!("{what:68} {must:44} {happened}");
        wrong.extend((!well).then_some(what));
    }
    if wrong.is_empty() {
        Ok(())
    } else {
        Err(Error::new(format!("not as it must be: {}", wrong.join("; "))))
    }
}

/// The same without the rest, in a folder of its own.
pub fn alone(command: &Path) -> Result<(), Error> {
    let folder = std::env::temp_dir().join(format!("umbracast-fleet-{}", std::process::id()));
    let sim = folder.join("sim");
    shell(&format!(
        "mkdir -p {0} && {1} simulate --out {2} --quiet",
        folder.display(),
        command.display(),
        sim.display()
    ))?;
    let outcome = cases(command, &folder);
    shell(&format!("rm -r {}", folder.display()))?;
    outcome
}

struct Bench<'a> {
    command: &'a Path,
    folder: &'a Path,
}

impl Bench<'_> {
    fn files(&self) -> Result<(), Error> {
        let write = |name: &str, text: &str| {
            let file = self.folder.join(name);
            std::fs::write(&file, text).map_err(|e| Error::new(e.to_string()).within(file.display()))?;
            shell(&format!("chmod 600 {}", file.display()))
        };
        write("one.toml", "[network]\nhall = \"lab\"\n")?;
        write("users.txt", "edge:right\nserver:right\n")?;
        write("right.txt", "right\n")?;
        write("wrong.txt", "wrong\n").map(drop)
    }

    /// A client that its router does not let in, or whose router is not there.
    fn client(&self, wrong: bool) -> Seen {
        let port = free_port()?;
        let _router = if wrong { Some(self.router(port)?) } else { None };
        let site = self.client_file(port, "edge", if wrong { "wrong" } else { "right" })?;
        let said = self.folder.join("client.txt");
        let file = std::fs::File::create(&said).map_err(|e| Error::new(e.to_string()))?;
        let mut command = Command::new(self.command);
        command.args(["node", "sensor", "--hall", "lab", "--site", &site, "--port", "0"]);
        let child = command.stdout(Stdio::null()).stderr(file).spawn();
        let mut client = Running(child.map_err(|e| Error::new(e.to_string()))?);
        sleep(2 * MOMENT);
        let ended_s = ended_s(&mut client)?;
        let told = std::fs::read_to_string(&said).unwrap_or_default();
        let word = if wrong { "does not let this node in" } else { "refused" };
        let well = told.contains(word) && ended_s < 1.0;
        let told =
            if told.contains(word) { format!("it says \"{word}\"") } else { "it says nothing".to_owned() };
        Ok((format!("{told}; ends after {ended_s:.2} s"), well))
    }

    /// The site file of somebody at this door, with a password of a file.
    fn client_file(&self, port: u16, user: &str, password: &str) -> Result<String, Error> {
        let file = self.folder.join(format!("{user}-{password}.toml"));
        let text = format!(
            "[network]\nmode = \"client\"\nconnect = [\"tcp/127.0.0.1:{port}\"]\nuser = \"{user}\"\npassword_file = \
             \"{password}.txt\"\n"
        );
        std::fs::write(&file, text).map_err(|e| Error::new(e.to_string()))?;
        Ok(file.display().to_string())
    }

    fn router_file(&self, port: u16) -> Result<String, Error> {
        let file = self.folder.join("router.toml");
        let text = format!(
            "[network]\nhall = \"doors\"\nmode = \"router\"\nlisten = [\"tcp/127.0.0.1:{port}\"]\nusers_file = \"users.txt\"\n\
             [network.roles]\nedge = \"lab/sensor:lidar_east\"\nserver = [\"lab/track\", \"lab/forecast\", \"lab/cast\"]\n"
        );
        std::fs::write(&file, text).map_err(|e| Error::new(e.to_string()))?;
        Ok(file.display().to_string())
    }

    fn router(&self, port: u16) -> Result<Running, Error> {
        self.node(&format!("router --site {}", self.router_file(port)?))
    }

    /// A node, once it is ready.
    fn node(&self, words: &str) -> Result<Running, Error> {
        let child = Command::new(self.command)
            .args(["node", "--no-serve"])
            .args(words.split_whitespace())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let mut child = child.map_err(|e| Error::new(e.to_string()))?;
        let mut said = BufReader::new(child.stdout.take().ok_or_else(|| Error::new("no pipe"))?);
        let mut line = String::new();
        while !line.trim_end().ends_with("ready") {
            line.clear();
            if said.read_line(&mut line).map_err(|e| Error::new(e.to_string()))? == 0 {
                return Err(Error::new(format!("{words}: ended before it was ready")));
            }
        }
        child.stdout = Some(said.into_inner());
        Ok(Running(child))
    }

    /// How many warnings a scene of both sensors brings, where the front end starts after, or before, the tracker that has the
    /// empty hall.
    fn warnings(&self, tracker_first: bool) -> Result<usize, Error> {
        let (port, udp) = (free_port()?, free_udp_ports()?);
        let site = self.folder.join("one.toml").display().to_string();
        let sim = self.folder.join("sim").display().to_string();
        let door =
            |first: bool| format!("--{} tcp/127.0.0.1:{port}", if first { "listen" } else { "connect" });
        let stages = "track,forecast,cast";
        let track = format!("{stages} --site {site} --empty {sim}/empty.mcap {}", door(tracker_first));
        let front = format!("sensor --site {site} --port {udp} {}", door(!tracker_first));
        let (first, second) = if tracker_first { (&track, &front) } else { (&front, &track) };
        let _first = self.node(first)?;
        let network = Network { connect: vec![format!("tcp/127.0.0.1:{port}")], ..Network::default() };
        let (session, warnings) = (network.open()?, Arc::<AtomicUsize>::default());
        let counted = warnings.clone();
        let _heard = session
            .declare_subscriber("umbracast/lab/warnings/*")
            .callback(move |_| {
                counted.fetch_add(1, Ordering::Relaxed);
            })
            .wait()
            .map_err(|e| Error::new(e.to_string()))?;
        sleep(Duration::from_secs(5));
        let _second = self.node(second)?;
        sleep(MOMENT);
        shell(&format!(
            "{} replay {sim}/scene-0000.mcap --to 127.0.0.1:{udp} --quiet",
            self.command.display()
        ))?;
        sleep(MOMENT);
        Ok(warnings.load(Ordering::Relaxed))
    }

    fn idle(&self) -> Seen {
        let port = free_port()?;
        let _router = self.router(port)?;
        let words = format!("sensor --hall lab --port 0 --site {}", self.client_file(port, "edge", "right")?);
        drop(self.node(&words)?);
        let stop = Arc::new(AtomicBool::new(false));
        let holding = std::thread::spawn({
            let stop = stop.clone();
            move || hold(port, &stop)
        });
        sleep(MOMENT);
        let begun = clock();
        let back = self.node(&words);
        let took_s = begun.elapsed().as_secs_f64();
        stop.store(true, Ordering::Relaxed);
        let _ = holding.join();
        back.map(|_| (format!("it is back after {took_s:.1} s"), took_s < 5.0))
    }

    fn open_users_file(&self) -> Seen {
        let site = self.router_file(free_port()?)?;
        let users = self.folder.join("users.txt");
        shell(&format!("chmod 644 {}", users.display()))?;
        let done = Command::new(self.command).args(["node", "router", "--site", &site]).output();
        shell(&format!("chmod 600 {}", users.display()))?;
        let done = done.map_err(|e| Error::new(e.to_string()))?;
        let well =
            done.status.code() == Some(1) && String::from_utf8_lossy(&done.stderr).contains("chmod 600");
        Ok((format!("code {}", done.status.code().unwrap_or(-1)), well))
    }

    fn hangs(&self) -> Seen {
        let port = free_port()?;
        let site = self.folder.join("one.toml").display().to_string();
        let _track = self.node(&format!("track,forecast --site {site} --listen tcp/127.0.0.1:{port}"))?;
        let cast = self.node(&format!("cast --site {site} --connect tcp/127.0.0.1:{port}"))?;
        shell(&format!("kill -STOP {}", cast.0.id()))?;
        let begun = clock();
        let look = format!("{} fleet --connect tcp/127.0.0.1:{port}; echo code $?", self.command.display());
        for _ in 0..10 {
            let said = shell(&look)?;
            if said.contains("no node runs cast: nobody warns") {
                let seconds = begun.elapsed().as_secs_f64();
                return Ok((format!("after {seconds:.1} s: no node runs cast"), said.contains("code 1")));
            }
        }
        Ok(("fleet says nothing".to_owned(), false))
    }

    fn brokers(&self) -> Seen {
        let broker = TcpListener::bind("127.0.0.1:0").map_err(|e| Error::new(e.to_string()))?;
        let address = broker.local_addr().map_err(|e| Error::new(e.to_string()))?;
        let site = self.folder.join("mqtt.toml");
        let text = format!("[network]\nhall = \"lab\"\n[network.mqtt]\nbroker = \"{address}\"\n");
        std::fs::write(&site, text).map_err(|e| Error::new(e.to_string()))?;
        let counted = Arc::<Counted>::default();
        let serving = counted.clone();
        std::thread::spawn(move || broker.incoming().flatten().for_each(|stream| serving.serve(stream)));
        let (port, site) = (free_port()?, site.display());
        let _one = self.node(&format!("serve --site {site} --listen tcp/127.0.0.1:{port}"))?;
        let _other = self.node(&format!("serve --site {site} --connect tcp/127.0.0.1:{port}"))?;
        sleep(3 * MOMENT);
        let (names, thrown) = (counted.names(), counted.thrown.load(Ordering::Relaxed));
        Ok((format!("{names} names, {thrown} thrown out in 6 s"), (names, thrown) == (2, 0)))
    }

    fn forges(&self) -> Seen {
        let port = free_port()?;
        let _router = self.router(port)?;
        let session = |user: &str| -> Result<Session, Error> {
            let file = self.client_file(port, user, "right")?;
            let text = std::fs::read_to_string(&file).map_err(|e| Error::new(e.to_string()))?;
            Network::of_site_file(&text, Path::new(&file))?.visit()
        };
        let failed = |e: zenoh::Error| Error::new(e.to_string());
        let (edge, server) = (session("edge")?, session("server")?);
        let key = "umbracast/lab/config/background/lidar_east";
        let answered =
            move |word: &'static str| move |query: zenoh::query::Query| drop(query.reply(key, word).wait());
        let _forged = edge.declare_queryable(key).callback(answered("forged")).wait().map_err(failed)?;
        let _true = server.declare_queryable(key).callback(answered("true")).wait().map_err(failed)?;
        let sent = Arc::<Mutex<Vec<String>>>::default();
        let heard = sent.clone();
        let _heard = server
            .declare_subscriber("umbracast/lab/sensor/*/foreground")
            .callback(move |sample| lock(&heard).push(sample.key_expr().to_string()))
            .wait()
            .map_err(failed)?;
        sleep(MOMENT);
        for name in ["lidar_west", "lidar_east"] {
            edge.put(format!("umbracast/lab/sensor/{name}/foreground"), "word").wait().map_err(failed)?;
        }
        sleep(MOMENT);
        let own = lock(&sent).iter().all(|key| key.contains("lidar_east")) && lock(&sent).len() == 1;
        let asker = session("server")?;
        let (mut forged, mut right) = (0, 0);
        for _ in 0..10 {
            let asked = asker.get(key).target(zenoh::query::QueryTarget::All).timeout(MOMENT);
            for reply in asked.wait().map_err(failed)? {
                match reply.result().is_ok_and(|reply| *reply.payload().to_bytes() == b"true"[..]) {
                    true => right += 1,
                    false => forged += 1,
                }
            }
        }
        let happened = format!(
            "of 10 questions {right} answered by the tracker, {forged} forged; of both messages its own came"
        );
        Ok((happened, own && (right, forged) == (10, 0)))
    }
}

/// A broker that says yes to all, and as brokers do, throws out whoever had a newcomer's name.
#[derive(Default)]
struct Counted {
    known: Mutex<BTreeMap<Vec<u8>, TcpStream>>,
    thrown: AtomicUsize,
}

impl Counted {
    fn names(&self) -> usize {
        lock(&self.known).len()
    }

    fn serve(self: &Arc<Self>, mut stream: TcpStream) {
        let this = self.clone();
        std::thread::spawn(move || -> std::io::Result<()> {
            loop {
                let mut head = [0; 2];
                stream.read_exact(&mut head)?;
                // Nobody here sends more than a byte of length says, but for a long will: two bytes.
                let mut length = usize::from(head[1] & 127);
                if head[1] > 127 {
                    let mut more = [0; 1];
                    stream.read_exact(&mut more)?;
                    length += usize::from(more[0]) << 7;
                }
                let mut rest = vec![0; length];
                stream.read_exact(&mut rest)?;
                match head[0] >> 4 {
                    1 => {
                        let name = rest[12..12 + usize::from(rest[11])].to_vec();
                        let before = lock(&this.known).insert(name, stream.try_clone()?);
                        if let Some(before) = before {
                            this.thrown.fetch_add(1, Ordering::Relaxed);
                            before.shutdown(std::net::Shutdown::Both)?;
                        }
                        stream.write_all(&[0x20, 2, 0, 0])?;
                    }
                    3 => {
                        let number = 2 + usize::from(rest[1]);
                        stream.write_all(&[0x40, 2, rest[number], rest[number + 1]])?;
                    }
                    8 => stream.write_all(&[0x90, 3, rest[0], rest[1], 1])?,
                    12 => stream.write_all(&[0xd0, 0])?,
                    _ => {}
                }
            }
        });
    }
}

/// Keeps so many connections open that say nothing, anew when they are closed.
fn hold(port: u16, stop: &AtomicBool) {
    let call = || {
        let stream = TcpStream::connect(("127.0.0.1", port)).ok()?;
        stream.set_nonblocking(true).ok()?;
        Some(stream)
    };
    let mut held: Vec<Option<TcpStream>> = (0..IDLE).map(|_| call()).collect();
    while !stop.load(Ordering::Relaxed) {
        for stream in &mut held {
            let open = stream.as_mut().is_some_and(|stream| {
                stream.read(&mut [0]).is_err_and(|e| e.kind() == std::io::ErrorKind::WouldBlock)
            });
            if !open {
                *stream = call();
            }
        }
        sleep(Duration::from_millis(20));
    }
}

/// Seconds until it ends that was asked to end.
fn ended_s(running: &mut Running) -> Result<f64, Error> {
    shell(&format!("kill -TERM {}", running.0.id()))?;
    let begun = clock();
    while begun.elapsed().as_secs_f64() < ENDS_S {
        if running.0.try_wait().map_err(|e| Error::new(e.to_string()))?.is_some() {
            break;
        }
        sleep(Duration::from_millis(5));
    }
    Ok(begun.elapsed().as_secs_f64())
}

fn free_port() -> Result<u16, Error> {
    let free = TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr());
    free.map(|address| address.port()).map_err(|e| Error::new(e.to_string()))
}

/// The first of two.
fn free_udp_ports() -> Result<u16, Error> {
    let free = UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.local_addr());
    free.map(|address| address.port() & !1).map_err(|e| Error::new(e.to_string()))
}

fn lock<T>(shared: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}
