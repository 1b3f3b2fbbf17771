//! `view` in a headless Chromium: any frame at any speed, the truth and a second mode beside, and well at the end.

#[path = "chromium/mod.rs"]
mod chromium;

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::Command;

use chromium::{Page, Served};

/// Two people cross the hall for four seconds.
fn recorded(folder: &Path) {
    let mut text = "t_s,id,x_m,y_m\n".to_owned();
    for k in 0..40 {
        let x = -2.5 + 0.12 * f64::from(k);
        text +=
            &format!("{:.1},1,{x:.2},0.5\n{:.1},2,{:.2},-0.8\n", 0.1 * f64::from(k), 0.1 * f64::from(k), -x);
    }
    let walks = folder.join("walks.csv");
    std::fs::create_dir_all(folder).expect("a folder");
    std::fs::write(&walks, text).expect("writes");
    let done = Command::new(env!("CARGO_BIN_EXE_umbracast"))
        .args(["simulate", "--quiet", "--trajectories"])
        .arg(&walks)
        .arg("--out")
        .arg(folder)
        .output()
        .expect("starts");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
}

/// The status of a page's health.
fn health(address: &str) -> String {
    let host = address.trim_start_matches("http://").trim_end_matches('/');
    let mut stream = TcpStream::connect(host).expect("connects");
    write!(stream, "GET /health HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").expect("asks");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer");
    answer.lines().next().unwrap_or_default().to_owned()
}

#[test]
fn any_frame_is_shown_at_any_speed_with_the_truth_and_a_second_mode_beside() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let (profile, recording) = (folder.join("chromium-view"), folder.join("viewed"));
    let _ = std::fs::remove_dir_all(&profile);
    let _ = std::fs::remove_dir_all(&recording);
    recorded(&recording);
    let scene = recording.join("scene-0000.mcap").display().to_string();
    let (_viewing, address) = Served::start([
        "view",
        "--serve",
        "127.0.0.1:0",
        "--beside",
        "paper",
        "--rate",
        "2",
        "--quiet",
        &scene,
    ]);
    let Some(mut page) = Page::open(&address, &profile) else { return };
    page.size(1400, 900);
    page.until("recording && recording.about.done && recording.about.frames > 30");
    assert_eq!(page.value("$('speed').value"), "2");

    // Any place, and histories of what was before it.
    page.value("goTo(25); pause(true); true");
    page.until("shown && shown.frame === 25 && beside && beside.frame === 25 && !recording.before");
    page.until("[...shown.looks.values()].every(look => look.kept.states.length >= 3 * 10)");
    page.until("shown.truth.people.length === 2 && shown.tracks.filter(t => t.confirmed).length === 2");
    page.until("[...document.querySelectorAll('.link .more')].some(more => more.textContent.includes('truth: ') && more.textContent.includes('paper: '))");
    page.until("scene.rects.length === 2 && drawn");
    page.screenshot("view.png");
    page.value("dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowLeft' })); true");
    page.until("shown.frame === 24");

    // Slow, then fast to the end, which stays and is well.
    page.value("$('speed').value = '0.25'; pause(false); true");
    page.until("recording.at > 24.3");
    page.value("$('speed').value = '10'; true");
    page.until("paused && Math.floor(recording.at) === recording.about.frames - 1");
    std::thread::sleep(std::time::Duration::from_millis(1500));
    assert_eq!(health(&address), "HTTP/1.1 200 OK");

    // The whole scan of that place.
    page.value("$('scan').value = 'whole'; $('scan').dispatchEvent(new Event('change')); goTo(12); true");
    page.until("+document.body.dataset.scanned > 1000 && shown.frame === 12");
    page.size(390, 844);
    page.until("document.documentElement.scrollWidth <= 390");
}
