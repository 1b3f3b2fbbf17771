//! Makes `models/paper_lstm.safetensors` and its card, with EPOCHS 15: `paper_lstm DIR COMMIT [EPOCHS]`. Stopped and
//! started again, it goes on after the last whole epoch.

use std::path::Path;
use std::{env, fs};

use umbracast_train::{TrainOptions, train};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = env::args().collect();
    let [directory, commit] = [1, 2].map(|i| arguments.get(i).expect("paper_lstm DIR COMMIT [EPOCHS]"));
    let directory = Path::new(directory);
    let mut options = TrainOptions::paper();
    options.commit.clone_from(commit);
    options.checkpoint = Some(directory.join("paper_lstm.checkpoint"));
    if let Some(epochs) = arguments.get(3) {
        options.epochs = epochs.parse()?;
    }
    let model = train(&options, &mut |progress| {
        if progress.batch % 16 == 0 {
            let (epoch, of, loss) = (progress.epoch + 1, progress.epochs, progress.training_loss);
            eprint!("epoch {epoch} of {of}, batch {}: loss {loss:.4}", progress.batch);
            eprintln!(
                "{}",
                progress.validation_loss.map_or(String::new(), |loss| format!(", validation {loss:.4}"))
            );
        }
    })?;
    fs::write(directory.join("paper_lstm.safetensors"), model.safetensors)?;
    fs::write(directory.join("paper_lstm.md"), model.card)?;
    Ok(())
}
