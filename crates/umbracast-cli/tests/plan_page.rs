//! The page of `plan` in a headless Chromium: a sensor is dragged, the maps follow within a second, the best places are taken
//! over, the file keeps its comments.

#[path = "chromium/mod.rs"]
mod chromium;

use std::path::PathBuf;

use chromium::{Page, Served};
use serde_json::json;

/// The pixel of a place on the floor.
fn pixel(page: &mut Page, x: f64, y: f64) -> [f64; 2] {
    let at = page.value(&format!(
        "(() => {{ const corner = $('overlay').getBoundingClientRect(), [u, v] = scene.camera.project({x}, {y}, 0); return [corner.left + u, corner.top + v]; }})()"
    ));
    [0, 1].map(|i| at[i].as_f64().expect("a number"))
}

fn drag(page: &mut Page, from_m: [f64; 2], to_m: [f64; 2]) {
    let ends = [from_m, to_m].map(|[x, y]| pixel(page, x, y));
    for (kind, [x, y]) in [("mousePressed", ends[0]), ("mouseMoved", ends[1]), ("mouseReleased", ends[1])] {
        let button = if kind == "mouseMoved" { "none" } else { "left" };
        let event = json!({ "type": kind, "x": x, "y": y, "button": button, "buttons": 1, "clickCount": 1 });
        page.call("Input.dispatchMouseEvent", event);
    }
}

#[test]
fn a_sensor_is_dragged_the_maps_follow_and_the_file_keeps_its_comments() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let (profile, file) = (folder.join("chromium-plan"), folder.join("plan.toml"));
    let _ = std::fs::remove_dir_all(&profile);
    // The default hall is 34 x 34 m.
    let text = "# Above the doors.\n[site]\nname = \"planned\"\n\n[[site.sensors]] # the first\nname = \"east\"\n\
                position_m = [12.5, 0.0, 6.0]\nrotation_deg = { yaw = 180.0, pitch = 35.0, roll = 0.0 } # measured\n";
    std::fs::write(&file, text).expect("writes");
    let named = file.display().to_string();
    let (_planning, address) = Served::start(["plan", "--serve", "127.0.0.1:0", "--site", &named]);
    let Some(mut page) = Page::open(&address, &profile) else { return };
    page.size(1400, 900);
    page.until("+document.body.dataset.mapped >= 1 && !dirty");
    let before = page.value("answered.means[1]").as_f64().expect("a share");
    assert!((0.2..1.0).contains(&before), "{before}");

    // Each drag is followed by new maps, the quickest within a second whatever else this machine does.
    let mut quickest = f64::INFINITY;
    let mut at = [12.5, 0.0];
    for k in 0..4 {
        let to = [10.0 - f64::from(k), 2.0 * f64::from(k)];
        let done = page.value("+document.body.dataset.mapped").as_f64().expect("a number");
        drag(&mut page, at, to);
        at = to;
        page.until(&format!("+document.body.dataset.mapped > {done} && !asking && !dirty"));
        quickest = quickest.min(page.value("+document.body.dataset.took").as_f64().expect("milliseconds"));
    }
    assert!(quickest < 1000.0, "maps of a 34 x 34 m hall took {quickest} ms");
    let place = page.value("site.sensors[0].position_m");
    assert!((place[0].as_f64().unwrap() - 7.0).abs() < 0.2 && (place[1].as_f64().unwrap() - 6.0).abs() < 0.2);
    assert_ne!(page.value("answered.means[1]").as_f64(), Some(before));
    page.screenshot("plan.png");

    // Other things, by mouse and by keyboard; a change is undone.
    page.value("dispatchEvent(new KeyboardEvent('keydown', { key: 'f' })); true");
    let [x, y] = pixel(&mut page, -3.0, -4.0);
    page.call(
        "Input.dispatchMouseEvent",
        json!({ "type": "mousePressed", "x": x, "y": y, "button": "left", "clickCount": 1 }),
    );
    page.until("site.furniture.length === 6 && chosen.list === 'furniture'");
    page.value("dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowRight', shiftKey: true })); true");
    page.until("Math.abs(site.furniture[5].position_m[0] + 2) < 0.1");
    page.value("$('undo').click(); $('undo').click(); true");
    page.until("site.furniture.length === 5 && !asking && !dirty");

    // The best places are better than where the sensor was, and are taken over beside it.
    page.value("$('count_sensors').value = 1; $('beside').checked = true; $('best').click(); true");
    page.until("!$('take').hidden && offered.answer.sensors.placed.length === 1");
    assert_eq!(page.value("offered.answer.sensors.values[0] > answered.means[1]"), true);
    page.value("$('take').click(); $('save').click(); true");
    page.until("document.body.dataset.saved");
    let saved = std::fs::read_to_string(&file).expect("reads");
    for kept in ["# Above the doors.", "# the first", "# measured", "name = \"lidar_1\""] {
        assert!(saved.contains(kept), "{kept}: {saved}");
    }

    // What cannot be is said, and a drawing gives walls.
    page.value("site.sensors[1].name = site.sensors[0].name; changed(); true");
    page.until("$('state').className === 'bad' && $('state').textContent.includes('site.sensors')");
    let drawing = "dxf('0\\nSECTION\\n2\\nENTITIES\\n0\\nLWPOLYLINE\\n70\\n1\\n10\\n0\\n20\\n0\\n10\\n9000\\n20\\n0\\n10\\n9000\\n20\\n4000\\n0\\nENDSEC\\n', 'a.dxf')";
    assert_eq!(
        page.value(&format!("(d => [d.lines.length, d.closed.length, d.wide * d.unit_m])({drawing})")),
        json!([3, 3, 9])
    );
    assert_eq!(
        page.value("(() => { try { dxf('nothing', 'a.dxf'); } catch (e) { return e.message; } })()"),
        "expected lines or polylines in its ENTITIES, found none"
    );

    page.size(390, 844);
    page.until("document.documentElement.scrollWidth <= 390 && $('overlay').clientWidth > 300");
    page.screenshot("plan_telephone.png");
}
