//! The page as somebody sees it, in a headless Chromium: people move, a link turns red after it turned amber, the last
//! minute can be gone back through, the whole scan comes when it is asked for, warnings hold, a telephone's width holds.

#[path = "chromium/mod.rs"]
mod chromium;

use std::path::Path;

use chromium::{Page, Served};

#[test]
fn people_move_links_turn_and_the_last_minute_can_be_gone_back_through() {
    let profile = Path::new(env!("CARGO_TARGET_TMPDIR")).join("chromium");
    let _ = std::fs::remove_dir_all(&profile);
    let (_demo, address) = Served::start([
        "live",
        "--demo",
        "--people",
        "8",
        "--serve",
        "127.0.0.1:0",
        "--seed",
        "100300",
        "--quiet",
    ]);
    let Some(mut page) = Page::open(&address, &profile) else { return };
    page.size(1400, 900);
    page.until("document.body.dataset.people >= 6");

    // People move.
    let place =
        "(() => { const t = shown.tracks.find(t => t.confirmed); return [t.track, t.x_m, t.y_m]; })()";
    let before = page.value(place);
    let moved = format!(
        "(() => {{ const t = shown.tracks.find(t => t.track === {}); return !t || Math.hypot(t.x_m - {}, t.y_m - {}) > 0.5; }})()",
        before[0], before[1], before[2]
    );
    page.until(&moved);

    // Links are told before they are blocked: some link that is blocked now was amber in a frame before.
    page.until(
        "kept.some((frame, i) => frame.blockages.some(link => link.blocked_now && kept.slice(0, i).some(earlier => \
         earlier.blockages.some(l => l.track === link.track && l.access_point === link.access_point && \
         !l.blocked_now && l.blocked_w9))))",
    );
    page.until("document.body.dataset.blocked > 0");
    page.screenshot("page.png");
    page.until("document.querySelectorAll('#links .link.blocked').length > 0");

    // A frame before now stays while new ones come.
    page.until("kept.length > 25");
    page.value("$('scrub').value = kept.length - 20; $('scrub').dispatchEvent(new Event('input')); true");
    page.until("paused && drawn && +document.body.dataset.frame === shown.frame");
    let held = page.value("shown.frame");
    page.until(&format!("kept[kept.length - 1].frame > {held} + 25"));
    assert_eq!(page.value("+document.body.dataset.frame"), held);
    page.value("$('pause').click(); true");
    page.until(&format!("+document.body.dataset.frame > {held} + 25"));

    // A person is picked by a click, in the plan and in a row.
    page.value("way('plan'); true");
    page.until("scene.camera.flat && !scene.fresh && shown.placed && shown.placed.size > 0");
    let click = "(() => { picked = null; scene.steer(shown); scene.draw([shown], 0); \
                 const [track, [x, y, z]] = [...shown.placed][0], [u, v] = scene.camera.project(x, y, z + 0.9), o = $('overlay'), \
                 corner = o.getBoundingClientRect(), at = { clientX: corner.left + u, clientY: corner.top + v, pointerId: 1, bubbles: true }; \
                 o.setPointerCapture = () => {}; o.dispatchEvent(new PointerEvent('pointerdown', at)); o.dispatchEvent(new PointerEvent('pointerup', at)); \
                 return picked != null; })()";
    assert_eq!(page.value(click), true);
    page.until("$('person').textContent.includes('m/s')");

    // Whoever asks gets the whole scan, in a bounded number of points; every camera draws.
    page.value(
        "$('scan').value = 'whole'; $('scan').dispatchEvent(new Event('change')); way('corner'); true",
    );
    page.until("+document.body.dataset.scanned > 10000 && +document.body.dataset.scanned <= 30000");
    page.screenshot("scan.png");
    for key in ["4", "5", "v", "2", "1"] {
        page.value(&format!("dispatchEvent(new KeyboardEvent('keydown', {{ key: '{key}' }})); true"));
        page.until("drawn && performance.now() > boarded");
    }
    page.until("scheme.way === 'fit' && scheme.fields");
    page.value("$('scan').value = 'none'; $('scan').dispatchEvent(new Event('change')); turn('fields', 'fields'); true");

    // A warning stays for 0.8 s unless the link is blocked, and nothing that is blocked looks clear.
    let hold = "(() => { const until = new Map(); for (const frame of kept) for (const [name, { state, link }] of frame.looks) { \
                if (steps(link, 0) >= 0.5 && state !== 'blocked') return `${name} ${state}`; const before = until.get(name); \
                if (state === 'warning' && !before) until.set(name, frame.time_ns); \
                if (state === 'clear' && before && frame.time_ns - before < 0.75e9 && kept[0].time_ns < before - 1e9) return `${name} held ${frame.time_ns - before}`; \
                if (state !== 'warning') until.delete(name); } return 'well'; })()";
    assert_eq!(page.value(hold), "well");
    page.until("document.querySelectorAll('#told li.kind-true').length > 0 && document.querySelectorAll('#sensors li').length === 2");

    // All of the window is used, and on a telephone nothing stands beyond the edge.
    page.until(
        "$('view').getBoundingClientRect().bottom > 880 && $('sensors').getBoundingClientRect().bottom > 880",
    );
    page.size(390, 844);
    page.until("document.documentElement.scrollWidth <= 390 && $('overlay').clientWidth > 300");
    page.until("[...document.querySelectorAll('.link:not([hidden])')].every(row => row.getBoundingClientRect().right <= 390)");
    page.screenshot("telephone.png");

    // Both themes.
    page.size(1400, 900);
    let ground = "getComputedStyle(document.body).backgroundColor";
    let first = page.value(ground);
    page.value("$('theme').click(); true");
    assert_ne!(page.value(ground), first);
    page.until("drawn");
    page.screenshot("dark.png");
}
