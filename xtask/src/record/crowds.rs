//! One table over several halls, crowds and bodies, and recorded people.

use std::ffi::OsString;
use std::fs;

use super::book::Book;
use crate::tools::{Result, argument, root};

/// How recorded walkers of the circle antipode experiment are read.
const ANTIPODE: [&str; 6] = ["--centre", "--unit", "cm", "--fps", "25", "--trajectories"];

/// Where sensors hang, how many sensors there are, how many people walk and how.
pub fn sites(book: &mut Book) -> Result<()> {
    book.command("cargo xtask record sites");
    let crowd = ["--scenes", "20", "--preset", "orca-03"];
    book.score("default", crowd)?;
    for site in ["height-3", "height-5", "height-6", "height-8", "lost-sensor", "out-of-step"] {
        let file = format!("config/sites/{site}.toml");
        book.score(site, crowd.into_iter().chain(["--site", &file]))?;
    }
    for people in ["20", "40"] {
        book.score(&format!("people-{people}"), crowd.into_iter().chain(["--people", people]))?;
    }
    book.score("pairs", ["--scenes", "20", "--preset", "pairs"])?;
    book.compare()
}

/// The default hall with revolutions cut elsewhere than behind the sensors, who see people within a quarter of a turn to
/// either side: soon after these, their points are 25 ms younger when the frame closes, and before these as much older.
pub fn cut(book: &mut Book) -> Result<()> {
    book.command("cargo xtask record cut");
    let crowd = ["--scenes", "20", "--preset", "orca-03"];
    for (name, cut_deg) in [("after people", 95.0), ("behind", 180.0), ("before people", 265.0)] {
        let sensor = |name: &str, x_m: f64, yaw_deg: f64| {
            format!(
                "[[site.sensors]]\nname = \"{name}\"\nmodel = \"hdl-32e\"\nposition_m = [{x_m:.1}, 0.0, 9.0]\n\
                 rotation_deg = {{ yaw = {yaw_deg:.1}, pitch = 35.0, roll = 0.0 }}\ncut_deg = {cut_deg:.1}\n"
            )
        };
        let file = book.scratch(&format!("cut-{cut_deg}.toml"));
        let text = sensor("lidar_east", 16.0, 180.0) + &sensor("lidar_west", -16.0, 0.0);
        fs::write(&file, text).map_err(|e| e.to_string())?;
        let words = crowd.map(OsString::from).into_iter().chain(["--site".into(), argument(&file)]);
        book.score(name, words)?;
    }
    book.compare()
}

/// Halls of other shapes with devices in the right hand: links blocked by others, by their owners, by the hall, and by any
/// of them.
pub fn shapes(book: &mut Book) -> Result<()> {
    book.command("cargo xtask record shapes");
    for site in ["l-hall", "hexagon", "corridor"] {
        let file = format!("config/sites/{site}.toml");
        let words =
            ["evaluate", "--mode", "default", "--scenes", "10", "--preset", "orca-03,mixed", "--site", &file];
        let said = book.quietly(&words.map(OsString::from))?;
        book.line(&format!("{site}: 20 scenes of 10 people, half of them orca-03, half mixed"));
        let mut shown = false;
        let stage1 = ["all      MOTA", "all      switches", "all      position"];
        for line in said.lines() {
            shown = (shown || line.starts_with("Blockage by cause")) && !line.is_empty();
            let others = line.contains(" 300 ms  default  ") && !shown;
            if shown || others || stage1.iter().any(|start| line.starts_with(start)) {
                book.line(line);
            }
        }
        book.line("");
    }
    Ok(())
}

/// Whether the owner's body blocks a device in the hand, in halls of other shapes: of who stops, queues and meets, and of people
/// of many kinds among them.
pub fn hands(book: &mut Book) -> Result<()> {
    book.command("cargo xtask record hands");
    let kinds = "bag=0.15,phone=0.15,child=0.15,gesturing=0.15,rucksack=0.1,wheelchair=0.1";
    for (people, bodies) in [("mixed", ""), ("kinds", kinds)] {
        for site in ["l-hall", "hexagon", "corridor"] {
            let file = format!("config/sites/{site}.toml");
            let mut words =
                vec!["evaluate", "--mode", "default", "--scenes", "20", "--preset", "mixed", "--site", &file];
            if !bodies.is_empty() {
                words.extend(["--bodies", bodies]);
            }
            book.line(&format!("# {people}, {site}: umbracast {}", words.join(" ")));
            let said = book.quietly(&words.into_iter().map(OsString::from).collect::<Vec<_>>())?;
            let by_cause = said.lines().skip_while(|line| !line.starts_with("Blockage by cause"));
            for line in
                by_cause.filter(|line| line.starts_with("access point") || line.contains("the owner  "))
            {
                book.line(line);
            }
            book.line("");
        }
    }
    Ok(())
}

/// Crowds that are asked with fewer samples beside the same crowds asked with all: two of them cross the default circle, for three
/// hundred people there is room in a concourse.
pub fn shedding(book: &mut Book) -> Result<()> {
    const ALL: &str = "[blockage]\nsamples_min = 128\n";
    book.command("cargo xtask record shedding");
    let concourse =
        fs::read_to_string(root().join("config/sites/concourse.toml")).map_err(|e| e.to_string())?;
    let crowds = [("40", "4", "orca-03", ""), ("100", "2", "orca-03", ""), ("300", "2", "mixed", &concourse)];
    for (people, scenes, preset, site) in crowds {
        for (name, settings) in [("as-shipped", site.to_owned()), ("all-samples", ALL.to_owned() + site)] {
            let name = format!("{people}-{name}");
            let file = book.scratch(&format!("{name}.toml"));
            fs::write(&file, settings).map_err(|e| e.to_string())?;
            let crowd = ["--scenes", scenes, "--preset", preset, "--people", people, "--site"];
            book.score(&name, crowd.map(OsString::from).into_iter().chain([argument(&file)]))?;
        }
    }
    book.compare()
}

/// Other bodies and real people beside the ORCA row.
pub fn people(book: &mut Book) -> Result<()> {
    book.command("cargo xtask record people");
    book.score("plain", ["--scenes", "6", "--preset", "orca-03"])?;
    bodies(book, &["--scenes", "6", "--preset", "orca-03"], "cmu_walk/scaled_131_01.bvh")?;
    let walkers =
        ["08-2", "16-2", "32-2x", "64-2x"].map(|name| format!("circle_antipode/circle-10m-{name}.txt"));
    recorded(book, "antipode", &ANTIPODE, &walkers)?;
    // Of the bottlenecks the part in which people wait and push through; the corridor's people trained the residual,
    // as did other clips of the crowd in the street.
    let middle = ["--centre", "--seconds", "20", "--trajectories"];
    recorded(book, "bottleneck", &middle, &["pedpy/030_c_56_h0.txt", "pedpy/040_c_56_h-.txt"])?;
    recorded(book, "trained-on", &middle, &["pedpy/traj_UNI_CORR_500_01.txt"])?;
    let street = ["1A", "1C", "2F"].map(|name| format!("madras/Topview_{name}.csv"));
    recorded(book, "madras", &["--centre", "--trajectories"], &street)?;
    book.compare()
}

/// The three methods, beside one another.
const EVERY_MODE: &str = "hdl,paper,default";

/// Bodies of the family that nothing was fitted to, and what people carry and push, 20 scenes each.
pub fn strangers(book: &mut Book) -> Result<()> {
    book.command("cargo xtask record strangers");
    let crowd = ["--scenes", "20", "--preset", "orca-03"];
    book.score_in(EVERY_MODE, "own", crowd)?;
    book.score_in(EVERY_MODE, "b", crowd.into_iter().chain(["--meshes", "b"]))?;
    let third = ["--meshes", "b", "--bodies", "phone=0.17,pockets=0.17"];
    book.score_in(EVERY_MODE, "b-phones", crowd.into_iter().chain(third))?;
    // What the network of the pose learned of, on bodies that it did not, and what nothing was fitted to on either.
    let learned = ["--meshes", "b", "--bodies", "wheelchair=0.2,pram=0.2,frame=0.2,umbrella=0.2"];
    book.score_in(EVERY_MODE, "b-things", crowd.into_iter().chain(learned))?;
    let untaught = ["--meshes", "b", "--bodies", "bags=0.2,screen=0.2,carrying=0.2,trolley=0.2,pushed=0.2"];
    book.score_in(EVERY_MODE, "b-untaught", crowd.into_iter().chain(untaught))?;
    for kind in ["bag", "phone", "child", "rucksack", "umbrella", "pram", "frame", "wheelchair"] {
        book.score_in(EVERY_MODE, kind, crowd.into_iter().chain(["--bodies", kind]))?;
    }
    let mixed = ["--scenes", "20", "--preset", "mixed"];
    book.score_in(EVERY_MODE, "mixed", mixed)?;
    book.score_in(EVERY_MODE, "gesturing", mixed.into_iter().chain(["--bodies", "gesturing"]))?;
    book.compare()
}

/// Every kind of body but the plain one, each walked by everybody of a crowd; the captured gait is that of a file.
pub fn bodies(book: &mut Book, crowd: &[&str], gait: &str) -> Result<()> {
    for kind in ["bag", "phone", "pockets", "child", "wheelchair"] {
        book.score(kind, crowd.iter().copied().chain(["--bodies", kind]))?;
    }
    let gait = book.data(gait)?;
    let words = crowd.iter().copied().chain(["--bodies", "cmu-walk", "--gait"]).map(OsString::from);
    book.score("cmu-walk", words.chain([gait]))
}

/// Recorded people under a name.
pub fn recorded<S: AsRef<str>>(book: &mut Book, name: &str, how: &[&str], files: &[S]) -> Result<()> {
    let files: Vec<OsString> = files.iter().map(|file| book.data(file.as_ref())).collect::<Result<_>>()?;
    book.score(name, how.iter().map(OsString::from).chain(files))
}

/// What the residual network adds to the filtered state carried on.
pub fn forecasts(book: &mut Book) -> Result<()> {
    book.command("cargo xtask record forecasts");
    let plain = book.scratch("constant-velocity.toml");
    fs::write(&plain, "[forecast]\nmethod = \"constant-velocity\"\n").map_err(|e| e.to_string())?;
    let walkers =
        ["08-2", "16-2", "32-2x", "64-2x"].map(|name| format!("circle_antipode/circle-10m-{name}.txt"));
    for method in ["residual", "constant-velocity"] {
        let site: Vec<OsString> = match method {
            "residual" => Vec::new(),
            _ => vec!["--site".into(), argument(&plain)],
        };
        for preset in ["orca-03", "mixed"] {
            let words = ["--scenes", "20", "--preset", preset].map(OsString::from);
            book.score(&format!("{preset}-{method}"), words.into_iter().chain(site.clone()))?;
        }
        let mut words: Vec<OsString> = ANTIPODE.map(OsString::from).into();
        for file in &walkers {
            words.push(book.data(file)?);
        }
        book.score(&format!("walkers-{method}"), words.into_iter().chain(site))?;
    }
    book.compare()
}

/// Sixteen real walkers with ten draws of bodies, then where their F1 is lost: error budget and ladder of oracles, access
/// point `side`, within 300 ms; as they walk, and once more with their hands in their pockets, so that no arm swings.
pub fn walkers(book: &mut Book) -> Result<()> {
    book.command("cargo xtask record walkers");
    let file = book.data("circle_antipode/circle-10m-16-2.txt")?;
    let words = ["evaluate", "--mode", "default"].into_iter().chain(ANTIPODE).map(OsString::from);
    let ten = std::iter::repeat_n(file.clone(), 10);
    let said = book.quietly(&words.clone().chain(ten).collect::<Vec<_>>())?;
    book.line("Ten draws of bodies");
    let wanted = ["access point", "side", "centre", "position RMSE", "velocity", "displacement"];
    for line in said.lines() {
        let line = line.strip_prefix("circle-10m-16-2  ").unwrap_or(line);
        if wanted.iter().any(|start| line.starts_with(start)) {
            book.line(line);
        }
    }
    for bodies in ["plain", "pockets"] {
        let out = book.scratch(bodies);
        let mut words: Vec<OsString> =
            words.clone().chain([file.clone(), "--out".into(), argument(&out)]).collect();
        if bodies != "plain" {
            words.extend(["--bodies".into(), bodies.into()]);
        }
        book.quietly(&words)?;
        let report = fs::read_to_string(out.join("report.txt")).map_err(|e| format!("report.txt: {e}"))?;
        let rows = losses(&report);
        if rows.is_empty() {
            return Err(
                "report.txt: expected an error budget and a ladder of oracles, found neither".to_owned()
            );
        }
        book.line(&format!("\n{bodies:<10} within 300 ms                 base rate     F1  onset F1"));
        for (name, [base_rate, f1, onset_f1]) in rows {
            book.line(&format!("{name:<42} {base_rate:>9}  {f1} {onset_f1:>9}"));
        }
    }
    let (how, files_follow) = ANTIPODE.split_at(5);
    for (name, meshes) in [("own", "own"), ("family b", "b")] {
        let meshes = ["--meshes", meshes];
        let words = how.iter().chain(&meshes).chain(files_follow).map(OsString::from);
        book.score_in(EVERY_MODE, name, words.chain(std::iter::repeat_n(file.clone(), 20)))?;
    }
    book.compare()
}

/// Of the error budget and the ladder, at `side` within 300 ms: who, then base rate, F1 and onset F1.
fn losses(report: &str) -> Vec<(String, [String; 3])> {
    let mut rows = Vec::new();
    let mut part = "";
    for line in report.lines() {
        if line.starts_with("Error budget, access point side") {
            part = "budget";
        } else if line.starts_with("Ladder of oracles") {
            part = "ladder";
        } else if line.is_empty() {
            part = "";
        }
        let pick = |numbers: &str, which: [usize; 3]| {
            let numbers: Vec<&str> = numbers.split_whitespace().collect();
            which.map(|i| numbers.get(i).copied().unwrap_or("-").to_owned())
        };
        if part == "budget" && line.starts_with("300 ms  default") {
            // Base rate, accuracy, precision, recall, F1, onset F1 stand after the predictor's column.
            let (name, numbers) = line.split_at(line.len().min(48));
            rows.push((name.get(17..).unwrap_or_default().trim().to_owned(), pick(numbers, [0, 4, 5])));
        } else if part == "ladder"
            && let Some((before, numbers)) = line.split_once("300 ms")
            && let Some(name) = before.trim_end().strip_suffix("  side")
        {
            rows.push((name.trim().to_owned(), pick(numbers, [0, 1, 2])));
        }
    }
    rows
}

/// Seeds of the closed loop.
const NETWORK_SEED: &str = "220000";

/// Policies of changing access points, in closed loop.
pub fn network(book: &mut Book) -> Result<()> {
    book.umbracast_says(["network", "--scenes", "40", "--seed", NETWORK_SEED])
}

/// The same over margins, procedures, crowds and access points, devices in the hand, and each model as truth and as predictor.
pub fn network_sweeps(book: &mut Book) -> Result<()> {
    let few = "--carrier 28 --seed 220100 --scenes 4";
    let straight = "--policies a3-60-40,conditional-60-40,forecast,forecast-bound,oracle";
    let beams = "--policies a3-60-40,conditional-60-40,a3-with-beams,forecast,forecast-with-beams,oracle,oracle-with-beams";
    for sweep in [
        "--truth edges --margin 5,10,15,20",
        "--truth edges --interruption 3,25,70",
        "--truth edges --people 5,20,40",
        "--truth edges --access-points 1,2,8",
        "--truth edges --own-body",
        "--truth model-b,kirchhoff,edges --predictor kirchhoff,model-b,three-edges",
    ] {
        // Reflections matter where a link can lose more than they do.
        let policies = if sweep.contains("--margin") { beams } else { straight };
        book.umbracast_says(
            ["network"].into_iter().chain([sweep, policies, few].into_iter().flat_map(str::split_whitespace)),
        )?;
    }
    Ok(())
}

/// The dB told about fades, and the shape of real ones.
pub fn network_losses(book: &mut Book) -> Result<()> {
    book.umbracast_says(["network", "--losses", "--scenes", "6", "--seed", NETWORK_SEED])?;
    let many = "--people 50 --access-points 8 --carrier 28 --truth edges";
    let losses = ["network", "--losses", "--scenes", "1", "--seed", NETWORK_SEED];
    book.umbracast_says(losses.into_iter().chain(many.split_whitespace()))?;
    let traces = book.data("immerse/traces.csv")?;
    book.umbracast_says(["network".into(), "--shape".into(), traces])
}

/// Which device is carried by whom, told from the power heard.
pub fn bindings(book: &mut Book) -> Result<()> {
    let line = "cargo run --release --quiet --package umbracast-network --example bindings -- 231000 10 20";
    super::house::script(book, line, line)
}

/// What power that is heard adds to the probabilities of links.
pub fn heard(book: &mut Book) -> Result<()> {
    let line = "cargo run --release --quiet --package umbracast-network --example heard -- 232000 20 10";
    super::house::script(book, line, line)
}
