use super::*;
use crate::report;
use crate::run::chain::tests::walk;
use crate::run::pooled;
use umbracast::Config;
use umbracast::geometry::DVec2;

/// Two people who walk side by side for 2.2 s, in `scenes` scenes.
fn spec(scenes: u64) -> Spec {
    Spec { ladder: true, ..walk(scenes, 2, 22, |person, i| DVec2::new(5.0 - person, -1.0 + 0.01 * i)) }
}

fn experiment<'a>(spec: &'a Spec, folder: &Path) -> Experiment<'a> {
    Experiment::new(spec, folder, b"program", b"weights").unwrap()
}

fn run(experiment: &Experiment, shard: Shard) {
    experiment.run(&experiment.missing(shard).unwrap().0, |_| {}).unwrap();
}

/// The scores and every file of the folder.
fn outcome(experiment: &Experiment) -> (String, Vec<(String, Vec<u8>)>) {
    let scores = pooled::score(&experiment.results().unwrap(), &experiment.spec.configs[0].site);
    let mut files: Vec<PathBuf> =
        fs::read_dir(&experiment.folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let named =
        |path: &PathBuf| (path.file_name().unwrap().to_string_lossy().into_owned(), fs::read(path).unwrap());
    (report::to_json(&scores), files.iter().map(named).collect())
}

#[test]
fn shards_merge_to_the_same_bytes_as_one_run() {
    let (spec, folders) = (spec(3), [0; 4].map(|_| tempfile::tempdir().unwrap()));
    let whole = experiment(&spec, folders[0].path());
    run(&whole, Shard::WHOLE);
    for index in 0..2 {
        run(&experiment(&spec, folders[1 + index].path()), Shard { index, of: 2 });
    }
    let merged = experiment(&spec, folders[3].path());
    merged.gather(&[folders[1].path().to_owned()]).unwrap();
    assert_eq!(merged.missing(Shard::WHOLE).unwrap().0, [1], "the other shard's");
    assert!(merged.results().unwrap_err().to_string().contains("found 2; missing: 1"));
    merged.gather(&[folders[1].path().to_owned(), folders[2].path().to_owned()]).unwrap();
    assert!(outcome(&merged) == outcome(&whole));
}

#[test]
fn an_interrupted_run_goes_on_and_gives_the_same_bytes() {
    let (spec, folders) = (spec(3), [0; 2].map(|_| tempfile::tempdir().unwrap()));
    let whole = experiment(&spec, folders[0].path());
    run(&whole, Shard::WHOLE);
    let expected = outcome(&whole);
    // The interrupted run has its second scene, and half of its first.
    let resumed = experiment(&spec, folders[1].path());
    fs::copy(whole.path(folders[0].path(), 1), resumed.path(folders[1].path(), 1)).unwrap();
    let first = &expected.1[0].1;
    fs::write(resumed.path(folders[1].path(), 0), &first[..first.len() / 2]).unwrap();
    let (missing, damaged) = resumed.missing(Shard::WHOLE).unwrap();
    assert_eq!(missing, [0, 2]);
    assert!(damaged.len() == 1 && damaged[0].contains("scene-0000.sums"), "{damaged:?}");
    run(&resumed, Shard::WHOLE);
    assert!(outcome(&resumed) == expected);
}

#[test]
fn a_scene_of_another_experiment_is_refused_and_left_alone() {
    let (mut spec, folder) = (spec(1), tempfile::tempdir().unwrap());
    run(&experiment(&spec, folder.path()), Shard::WHOLE);
    let path = folder.path().join("scene-0000.sums");
    let before = fs::read(&path).unwrap();
    let refused = |experiment: Experiment| {
        let message = experiment.missing(Shard::WHOLE).unwrap_err().to_string();
        assert!(message.contains("scene-0000.sums") && message.contains("another"), "{message}");
        assert!(experiment.results().is_err() && experiment.gather(&[folder.path().to_owned()]).is_err());
    };
    refused(Experiment::new(&spec, folder.path(), b"rebuilt", b"weights").unwrap());
    refused(Experiment::new(&spec, folder.path(), b"program", b"others").unwrap());
    spec.scenes[0].seed += 1;
    refused(experiment(&spec, folder.path()));
    spec.scenes[0].seed -= 1;
    spec.configs[0].track.coast_max_s += 0.1;
    refused(experiment(&spec, folder.path()));
    spec.configs[0].track.coast_max_s = Config::default().track.coast_max_s;
    assert!(experiment(&spec, folder.path()).missing(Shard::WHOLE).unwrap().0.is_empty());
    assert!(fs::read(&path).unwrap() == before);
}

#[test]
fn more_scenes_go_on_from_fewer() {
    let (few, more, folder) = (spec(1), spec(2), tempfile::tempdir().unwrap());
    run(&experiment(&few, folder.path()), Shard::WHOLE);
    assert_eq!(experiment(&more, folder.path()).missing(Shard::WHOLE).unwrap().0, [1]);
}

#[test]
fn a_shard_is_named_from_0() {
    assert_eq!("3/8".parse::<Shard>().unwrap(), Shard { index: 3, of: 8 });
    for wrong in ["8/8", "1", "a/b", "1/0", "-1/2"] {
        assert!(wrong.parse::<Shard>().unwrap_err().to_string().contains(wrong));
    }
}
