//! A small training, whole and resumed.

use std::cell::Cell;
use std::fs;
use std::path::PathBuf;

use umbracast::forecast::Weights;
use umbracast_train_lstm::network::Size;
use umbracast_train_lstm::{TrainOptions, TrainedModel, train};

fn small(checkpoint: Option<PathBuf>) -> TrainOptions {
    TrainOptions {
        scenes: 1..7,
        people: 3,
        radius_m: 5.0,
        size: Size { embedded: 16, units: 32 },
        epochs: 3,
        windows_per_epoch: 512,
        batch: 64,
        checkpoint,
        ..TrainOptions::paper()
    }
}

fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// The model, and a copy of the checkpoint as it stood after the first epoch.
fn train_and_keep_the_first_epoch(folder: &std::path::Path) -> (TrainedModel, PathBuf) {
    let (checkpoint, kept) = (folder.join("checkpoint"), folder.join("first"));
    let model = train(&small(Some(checkpoint.clone())), &mut |progress| {
        if (progress.epoch, progress.batch) == (1, 1) {
            fs::copy(&checkpoint, &kept).unwrap();
        }
    });
    (model.unwrap(), kept)
}

#[test]
fn a_resumed_training_ends_in_the_same_bytes() {
    let (whole, first_epoch) = train_and_keep_the_first_epoch(&folder("resumed"));
    let updates = Cell::new(0);
    let resumed = train(&small(Some(first_epoch)), &mut |_| updates.set(updates.get() + 1)).unwrap();
    assert_eq!(updates.get(), 2 * 8, "the first epoch is not done again");
    assert!(resumed == whole);
}

#[test]
fn training_lowers_the_loss_and_gives_weights_that_the_runtime_reads() {
    let mut losses = Vec::new();
    let model = train(&small(None), &mut |progress| losses.extend(progress.validation_loss)).unwrap();
    assert_eq!(losses.len(), 3);
    assert!(losses[2] < losses[0], "{losses:?}");
    Weights::from_safetensors(&model.safetensors).unwrap();
    assert!(model.card.contains("scene seeds 1 to 6"), "{}", model.card);
}

#[test]
fn a_checkpoint_of_other_options_is_refused() {
    let (_, first_epoch) = train_and_keep_the_first_epoch(&folder("refused"));
    let options = TrainOptions { clip: 2.0, ..small(Some(first_epoch)) };
    let message = train(&options, &mut |_| {}).unwrap_err().to_string();
    assert!(message.contains("clip: 2.0") && message.contains("clip: 1.0"), "{message}");
}

#[test]
fn seeds_of_other_purposes_are_refused() {
    let options = TrainOptions { scenes: 99_990..100_010, ..small(None) };
    let message = train(&options, &mut |_| {}).unwrap_err().to_string();
    assert!(message.contains("seeds of 1 to 99,999, found 99990..100010"), "{message}");
}
