//! scratch
use umbracast::{Config, Mode};
use umbracast_eval::chain::*;
use umbracast_eval::pooled::score;
use umbracast_eval::report;
use umbracast_sim::crowd::Preset;
fn main() {
    let modes: Vec<Mode> = std::env::args().nth(1).unwrap().split(',').map(|m| m.parse().unwrap()).collect();
    let n: usize = std::env::args().nth(2).unwrap().parse().unwrap();
    let weights = std::env::args()
        .nth(3)
        .map(|f| umbracast::forecast::Weights::from_safetensors(&std::fs::read(f).unwrap()).unwrap());
    let configs: Vec<Config> = modes
        .iter()
        .map(|&m| {
            let mut c = Config::for_mode(m);
            if weights.is_none() {
                c.forecast.method = umbracast::config::ForecastMethod::ConstantVelocity;
            }
            c
        })
        .collect();
    let names: Vec<String> = configs[0].site.access_points.iter().map(|a| a.name.clone()).collect();
    let spec = Spec {
        configs,
        weights,
        scenes: drawn_scenes(&[Preset::Orca03, Preset::Orca06], n, 10, TEST_SEEDS),
        keep: Some(0),
        ladder: std::env::args().nth(4).is_none(),
    };
    let t = std::time::Instant::now();
    let results = run(&spec, |p| {
        if p.frames_done == p.frames {
            eprintln!("{p:?}")
        }
    })
    .unwrap();
    eprintln!("{:?}", t.elapsed());
    let scores = score(&results, &spec.configs[0].site);
    print!("{}", report::to_text(&scores));
    let (truth, runs) = results[0].kept.as_ref().unwrap();
    let config = spec.configs.last().unwrap();
    let kept = report::Kept {
        label: "orca-03, seed 200000",
        mode: config.mode,
        site: &config.site,
        truth,
        run: runs.last().unwrap(),
    };
    let context = report::Context {
        configs: &spec.configs,
        command: "umbracast evaluate --scenes 2 --preset orca-03 --seed 200000",
        kept: Some(kept),
        explanations: &[],
    };
    report::write(std::path::Path::new("/tmp/report"), &scores, &context).unwrap();
    let d = std::path::Path::new("/tmp/tables");
    std::fs::create_dir_all(d).unwrap();
    use umbracast_io::tables::write;
    write(d, &names, true, &truth.people).unwrap();
    write(d, &names, true, &truth.links).unwrap();
    write(d, &names, true, &runs.last().unwrap().tracks).unwrap();
    write(d, &names, true, &runs.last().unwrap().links).unwrap();
}
