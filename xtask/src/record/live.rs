//! What a live run promises: it loses nothing, keeps time and flat memory, survives faults, and its page costs it nothing.

use std::ffi::OsString;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use super::book::{Book, spoken};
use super::house::script;
use crate::tools::{Result, argument, files_below, root};

/// How long the sensors of [`live`] send.
const SECONDS: u64 = 600;
/// So long after their start everybody is followed, every buffer is there, and the page is open.
const START: Duration = Duration::from_secs(10);
/// How long the page's stream is listened to after that.
const LISTEN: Duration = Duration::from_secs(10);
/// Where the page is.
const PAGE: &str = "127.0.0.1:8600";

/// A live run in which something fails. Fails itself where what must happen does not; needs root for the rows of a disk that is full,
/// slow or stands still, which it leaves out without.
pub fn faults(book: &mut Book) -> Result<()> {
    let faults = "cargo run --release --quiet --package umbracast-live --features serve --example faults";
    script(book, faults, faults)
}

/// A day of people through the stages and an hour of it through the whole program. Fails where the program says that something is
/// not at the end as it was at the beginning.
pub fn soak(book: &mut Book) -> Result<()> {
    let soak = "cargo run --release --quiet --package umbracast-node --example soak";
    book.command(soak);
    let said = book.bash(&root(), soak)?;
    book.line(&said);
    if said.lines().any(|line| line == "Every condition is kept.") { Ok(()) } else { Err(said) }
}

/// Ten minutes of simulated sensors over loopback, recorded, the page open: what was lost, how late warnings came, and
/// how much memory it and the browser took in the first minute and in the last. One run is made once more without a
/// browser: the difference is what the page costs. Sensors are a process of their own, as in a hall: how their memory
/// grows is not what is asked.
pub fn live(book: &mut Book) -> Result<()> {
    let ouster = book.scratch("ouster.toml");
    let site = "[[site.sensors]]\nname = \"lidar\"\nmodel = \"os0-128\"\nposition_m = [16.0, 0.0, 9.0]\n\
                rotation_deg = { yaw = 180.0, pitch = 35.0, roll = 0.0 }\nrange_noise_m = 0.02\n";
    std::fs::write(&ouster, site).map_err(|e| format!("{}: {e}", ouster.display()))?;
    live_run(book, "10", None, true)?;
    live_run(book, "40", None, true)?;
    live_run(book, "40", None, false)?;
    live_run(book, "10", Some(&ouster), true)?;
    book.line(&format!("# ouster.toml:\n{site}"));
    Ok(())
}

/// Sensors, the run that they send to, and who looks on if anybody does, each a process of its own.
fn live_run(book: &mut Book, people: &str, site: Option<&Path>, watched: bool) -> Result<()> {
    let (hall, folder) = (book.scratch("hall"), book.scratch("live"));
    let of_site: Vec<OsString> =
        site.into_iter().flat_map(|site| ["--site".into(), argument(site)]).collect();
    let words = |line: &str, further: &[OsString]| -> Vec<OsString> {
        line.split(' ').map(OsString::from).chain(further.iter().chain(&of_site).cloned()).collect()
    };
    book.umbracast_says(words("simulate --people 1 --stroll 1 --out", &[argument(&hall)]))?;
    // It ends by itself some seconds after the last packet.
    let listen = words(
        &format!("live --port 24000 --json --quiet --serve {PAGE} --seconds {}", SECONDS + 10),
        &["--empty".into(), argument(hall.join("empty.mcap")), "--record".into(), argument(&folder)],
    );
    let send = words(
        &format!(
            "simulate --people {people} --packets udp:127.0.0.1:24000 --json --quiet --stroll {SECONDS}"
        ),
        &[],
    );
    let browser = if watched { " & chrt --idle 0 chromium --headless ..." } else { "" };
    book.command(&format!("umbracast {} & umbracast {}{browser}", spoken(&listen), spoken(&send)));
    if !watched {
        book.line("Without a browser:");
    }
    let start = |words: &[OsString]| {
        let mut command = Command::new(book.umbracast());
        command.args(words).stdout(Stdio::piped()).stderr(Stdio::null());
        command.spawn().map_err(|e| format!("umbracast: {e}"))
    };
    let live = start(&listen)?;
    sleep(Duration::from_secs(1));
    let sensors = start(&send)?;
    let mut page = watched.then(look_on).transpose()?;
    sleep(START);
    let weight = if watched {
        Some(weight()?)
    } else {
        sleep(LISTEN);
        None
    };
    let (mut resident_kb, mut open, mut browser_kb) = (Vec::new(), Vec::new(), Vec::new());
    while let Some(kb) = resident(live.id()) {
        resident_kb.push(kb);
        if let Some(page) = &page {
            open.extend(streams());
            browser_kb.push(proportional(page.id()));
        }
        sleep(Duration::from_secs(1));
    }
    if let Some(page) = &mut page {
        page.kill().and_then(|()| page.wait()).map_err(|e| e.to_string())?;
    }
    for process in [live, sensors] {
        let output = process.wait_with_output().map_err(|e| e.to_string())?;
        book.line(String::from_utf8_lossy(&output.stdout).trim_end());
    }
    book.line(&first_and_last("resident", &resident_kb));
    if let Some(weight) = weight {
        book.line(&weight);
        book.line(&first_and_last("browser, its share of what its processes hold", &browser_kb));
        book.line(&seen_open(&open)?);
    }
    book.line("");
    [hall, folder].iter().try_for_each(|folder| {
        std::fs::remove_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))
    })
}

/// What a process held, one look a second.
fn first_and_last(what: &str, kb: &[u64]) -> String {
    let minute = kb.len().min(60);
    let mean = |kb: &[u64]| kb.iter().sum::<u64>() as f64 / kb.len().max(1) as f64 / 1024.0;
    let (first, last) = (mean(&kb[..minute]), mean(&kb[kb.len() - minute..]));
    let grown = 100.0 * (last / first - 1.0);
    format!(
        "{what}, mean of the minute after the first twenty seconds and of the last: {first:.1} MiB, {last:.1} MiB ({grown:+.1} %)"
    )
}

/// A browser with the page, which it draws by software. Who looks has a computer of his own: here he takes what is left, and
/// leaves at once what is wanted.
fn look_on() -> Result<Child> {
    let mut browser = Command::new("chrt");
    browser.args(["--idle", "0", "chromium", "--headless", "--no-sandbox", "--disable-gpu"]);
    browser.args(["--remote-debugging-port=0", &format!("http://{PAGE}/")]);
    let browser = browser.stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    browser.map_err(|e| format!("expected chromium to look at the page, found none: {e}"))
}

/// How many pages and other readers of the stream the running program counts now.
fn streams() -> Option<u64> {
    counted("umbracast_streams")
}

/// What the running program counts under such a name.
fn counted(name: &str) -> Option<u64> {
    let said = answered("GET /metrics HTTP/1.1\r\nConnection: close", Duration::from_secs(1))?;
    let said = String::from_utf8_lossy(&said);
    said.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '))?.parse().ok()
}

/// What the page weighs: its one file on the wire, heads included, and the frames that the browser takes in ten seconds.
fn weight() -> Result<String> {
    let page = answered("GET / HTTP/1.1\r\nConnection: close", LISTEN);
    let page = page.filter(|page| page.starts_with(b"HTTP/1.1 200"));
    let page = page.ok_or_else(|| format!("expected a page at {PAGE}, found none"))?.len();
    let streamed = || counted("umbracast_streamed_bytes_total").filter(|bytes| *bytes > 0);
    let before = streamed().ok_or("expected the browser at the stream behind the page, found nobody")?;
    sleep(LISTEN);
    let sent = streamed().unwrap_or(before) - before;
    Ok(format!("page: {page} bytes once, then {:.1} kB a second", 1e-3 * sent as f64 / LISTEN.as_secs_f64()))
}

/// All that the server of the page answers to a request until it closes the connection or the time is over.
fn answered(head: &str, within: Duration) -> Option<Vec<u8>> {
    let mut server = TcpStream::connect(PAGE).ok()?;
    write!(server, "{head}\r\nHost: {PAGE}\r\n\r\n").ok()?;
    #[expect(clippy::disallowed_methods, reason = "a server is given so long and no longer")]
    let from = Instant::now();
    let (mut said, mut part) = (Vec::new(), [0; 65536]);
    while let Some(left) = within.checked_sub(from.elapsed()).filter(|left| !left.is_zero()) {
        server.set_read_timeout(Some(left)).ok()?;
        match server.read(&mut part) {
            Ok(bytes @ 1..) => said.extend_from_slice(&part[..bytes]),
            _ => break,
        }
    }
    Some(said)
}

/// In words, at how many of the looks somebody had the page open. Fails below nine of ten: a record of a run that nobody
/// watched must not say what a page costs.
fn seen_open(streams: &[u64]) -> Result<String> {
    let open = streams.iter().filter(|streams| **streams > 0).count();
    if open == 0 || 10 * open < 9 * streams.len() {
        return Err(format!(
            "expected the page open all the time, found it so at {open} of {} looks",
            streams.len()
        ));
    }
    Ok(format!("page open at {open} of {} looks, one a second", streams.len()))
}

/// KiB that a process holds; `None` once it has ended.
fn resident(id: u32) -> Option<u64> {
    kilobytes(id, "status", "VmRSS:")
}

/// What such a file of a process says of it.
fn kilobytes(id: u32, file: &str, what: &str) -> Option<u64> {
    let said = std::fs::read_to_string(format!("/proc/{id}/{file}")).ok()?;
    let line = said.lines().find_map(|line| line.strip_prefix(what))?;
    line.trim().trim_end_matches(" kB").trim().parse().ok()
}

/// KiB that a process and those that it started hold; what they share with others counts in part.
fn proportional(id: u32) -> u64 {
    let threads = std::fs::read_dir(format!("/proc/{id}/task")).into_iter().flatten().flatten();
    let children: Vec<u32> = threads
        .filter_map(|thread| std::fs::read_to_string(thread.path().join("children")).ok())
        .flat_map(|ids| ids.split_whitespace().filter_map(|id| id.parse().ok()).collect::<Vec<u32>>())
        .collect();
    kilobytes(id, "smaps_rollup", "Pss:").unwrap_or(0) + children.into_iter().map(proportional).sum::<u64>()
}

/// A recording run killed at twenty moments, drawn by chance: what each file still holds.
pub fn kills(book: &mut Book) -> Result<()> {
    const KILLS: u64 = 20;
    book.command(
        "umbracast live --demo --people 4 --no-serve --record /tmp/live, killed (SIGKILL) twenty times",
    );
    book.line("killed after, s   bytes      `umbracast inspect`  frames with results   seconds of them");
    // A row of numbers that nobody chose, the same in every record.
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    for _ in 0..KILLS {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let after = Duration::from_millis(1500 + (state >> 33) % 5000);
        let folder = book.scratch("live");
        let mut live = Command::new(book.umbracast());
        live.args(["live", "--demo", "--people", "4", "--no-serve", "--quiet", "--record"]).arg(&folder);
        let live = live.stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        let mut live = live.map_err(|e| format!("umbracast: {e}"))?;
        sleep(after);
        live.kill().and_then(|()| live.wait()).map_err(|e| e.to_string())?;
        let files = files_below(&folder, ".mcap");
        let [file] = &files[..] else { return Err(format!("expected one recording, found {}", files.len())) };
        let bytes = std::fs::metadata(file).map_err(|e| e.to_string())?.len();
        let looked = Command::new(book.umbracast()).arg("inspect").arg(file).output();
        let looked = looked.map_err(|e| format!("umbracast: {e}"))?;
        let said = String::from_utf8_lossy(&looked.stdout).into_owned();
        let results = said.lines().find(|line| line.contains("/umbracast/blockages"));
        let messages = results.and_then(|line| line.split_whitespace().rev().nth(1)).unwrap_or("0");
        let frames: u32 =
            messages.parse().map_err(|_| format!("expected a number of messages, found {messages}"))?;
        let opened = match looked.status.code() {
            Some(0) => "opens whole".to_owned(),
            Some(3) => "opens, end cut".to_owned(),
            code => format!("fails: {code:?}"),
        };
        let lived = after.as_secs_f64();
        book.line(&format!(
            "{lived:15.3} {bytes:11}   {opened:20} {frames:18} {:17.1}",
            f64::from(frames) * 0.1
        ));
        std::fs::remove_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::seen_open;

    #[test]
    fn a_run_without_an_open_page_is_no_record() {
        assert!(seen_open(&[]).is_err() && seen_open(&[0; 600]).is_err());
        assert!(seen_open(&[vec![1; 300], vec![0; 300]].concat()).is_err(), "closed half way");
        let missed_once = [vec![1; 599], vec![0]].concat();
        assert_eq!(seen_open(&missed_once).unwrap(), "page open at 599 of 600 looks, one a second");
    }
}
