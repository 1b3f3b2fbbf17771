//! A long experiment in a folder of scene files: a finished scene stays finished, whatever happens to the rest.
//! Scenes may run on several machines; together they give the same bytes as one run.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use rayon::prelude::*;
use umbracast::Error;

use crate::run::chain::{Chain, Progress, SceneResult, Spec};
use crate::run::scene_file::{self, Fault, Stamp};
use crate::score::fingerprint::fingerprint;

/// Where the sums of an experiment are kept.
#[derive(Debug)]
pub struct Experiment<'a> {
    spec: &'a Spec,
    folder: PathBuf,
    stamps: Vec<Stamp>,
}

/// Every `of`-th scene, from the `index`-th on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// From 0.
    pub index: usize,
    /// How many there are.
    pub of: usize,
}

impl Shard {
    /// All scenes.
    pub const WHOLE: Self = Self { index: 0, of: 1 };
}

impl std::str::FromStr for Shard {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let parsed = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parsed {
            Some((index, of)) if index < of => Ok(Self { index, of }),
            _ => Err(Error::new(format!("expected i/n with i from 0 to n - 1, found {text:?}"))),
        }
    }
}

impl<'a> Experiment<'a> {
    /// In `folder`, which is made where it is not there. `program` and `weights` are bytes that tell the program
    /// and the network's weights from others.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub fn new(spec: &'a Spec, folder: &Path, program: &[u8], weights: &[u8]) -> Result<Self, Error> {
        fs::create_dir_all(folder).map_err(|e| Error::new(e.to_string()).within(folder.display()))?;
        let configs: String = spec.configs.iter().map(umbracast::Config::to_toml).collect();
        let (program, shared) = (fingerprint(&[program]), fingerprint(&[configs.as_bytes(), weights]));
        let stamp = |(scene, people)| {
            let people = format!("{people:?} ladder: {}", spec.ladder);
            let inputs = fingerprint(&[&shared.to_le_bytes(), people.as_bytes()]);
            Stamp { program, inputs, scene: scene as u32 }
        };
        let stamps = spec.scenes.iter().enumerate().map(stamp).collect();
        Ok(Self { spec, folder: folder.to_owned(), stamps })
    }

    /// The scenes of a shard that have no whole file here yet, and the names of those whose file is damaged.
    ///
    /// # Errors
    /// A file of another experiment: nothing is overwritten that may be worth something.
    pub fn missing(&self, shard: Shard) -> Result<(Vec<usize>, Vec<String>), Error> {
        let (mut missing, mut damaged) = (Vec::new(), Vec::new());
        for scene in (shard.index..self.stamps.len()).step_by(shard.of) {
            match self.read(&self.folder, scene) {
                Ok(Some(_)) => {}
                Ok(None) => missing.push(scene),
                Err(Unusable::Damaged(story)) => {
                    damaged.push(story.to_string());
                    missing.push(scene);
                }
                Err(Unusable::Foreign(error)) => return Err(error),
            }
        }
        Ok((missing, damaged))
    }

    /// Runs these scenes, several at a time; each has its file when it is done. `progress` is called after each
    /// frame, from any thread.
    ///
    /// # Errors
    /// A setting that cannot work, a file that cannot be written. Scenes that are done stay done.
    pub fn run(&self, scenes: &[usize], progress: impl Fn(Progress) + Sync) -> Result<(), Error> {
        if scenes.is_empty() {
            return Ok(());
        }
        let chain = Chain::new(self.spec)?;
        // One by one, so that no thread idles while another has a heap of scenes left.
        scenes.par_iter().with_max_len(1).try_for_each(|&scene| {
            let result = chain.scene(scene, &progress)?;
            self.write(scene, &scene_file::to_bytes(&self.stamps[scene], &result))
        })
    }

    /// Takes over every scene of this experiment that these folders hold.
    ///
    /// # Errors
    /// A damaged file, one of another experiment, or two that differ.
    pub fn gather(&self, folders: &[PathBuf]) -> Result<(), Error> {
        for folder in folders {
            if !folder.is_dir() {
                return Err(Error::new("expected a folder of scenes, found none").within(folder.display()));
            }
            for scene in 0..self.stamps.len() {
                let Some(there) = self.read(folder, scene).map_err(Unusable::into_error)? else { continue };
                match self.read(&self.folder, scene).map_err(Unusable::into_error)? {
                    Some(here) if here.bytes != there.bytes => {
                        let (a, b) = (self.path(&self.folder, scene), self.path(folder, scene));
                        let story = format!("the same scene as {} with other sums", a.display());
                        return Err(Error::new(story).within(b.display()));
                    }
                    Some(_) => {}
                    None => self.write(scene, &there.bytes)?,
                }
            }
        }
        Ok(())
    }

    /// Every scene's sums, in order.
    ///
    /// # Errors
    /// A scene without a whole file.
    pub fn results(&self) -> Result<Vec<SceneResult>, Error> {
        let (mut results, mut missing) = (Vec::new(), Vec::new());
        for scene in 0..self.stamps.len() {
            match self.read(&self.folder, scene).map_err(Unusable::into_error)? {
                Some(file) => results.push(file.result),
                None => missing.push(scene.to_string()),
            }
        }
        if missing.is_empty() {
            return Ok(results);
        }
        let (all, found, missing) = (self.stamps.len(), results.len(), missing.join(", "));
        let story = format!("expected the sums of {all} scenes, found {found}; missing: {missing}");
        Err(Error::new(story).within(self.folder.display()))
    }

    fn path(&self, folder: &Path, scene: usize) -> PathBuf {
        folder.join(format!("scene-{scene:04}.sums"))
    }

    fn read(&self, folder: &Path, scene: usize) -> Result<Option<SceneFile>, Unusable> {
        let path = self.path(folder, scene);
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(Unusable::Foreign(Error::new(e.to_string()).within(path.display()))),
        };
        let stamp = &self.stamps[scene];
        match scene_file::from_bytes(&bytes, stamp) {
            Ok(result) => Ok(Some(SceneFile { bytes, result })),
            Err(Fault::Damaged(found)) => {
                Err(Unusable::Damaged(Error::new(format!("expected {found}")).within(path.display())))
            }
            Err(Fault::Foreign(found)) => {
                let story = format!(
                    "expected program {:016x}, inputs {:016x}, scene {}, found {:016x}, {:016x}, {}: made by \
                     another build of the program, or with other settings, weights or seed; take another folder",
                    stamp.program, stamp.inputs, stamp.scene, found.program, found.inputs, found.scene
                );
                Err(Unusable::Foreign(Error::new(story).within(path.display())))
            }
        }
    }

    /// The file appears under its name when it is whole; two writers of one scene do not meet, though they be the
    /// same process number on two machines.
    fn write(&self, scene: usize, bytes: &[u8]) -> Result<(), Error> {
        let path = self.path(&self.folder, scene);
        let since = SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default().as_nanos();
        let part = path.with_extension(format!("part-{}-{since}", std::process::id()));
        fs::File::create_new(&part)
            .and_then(|mut file| file.write_all(bytes))
            .and_then(|()| fs::rename(&part, &path))
            .map_err(|e| Error::new(e.to_string()).within(path.display()))
    }
}

/// A whole file of this experiment.
struct SceneFile {
    bytes: Vec<u8>,
    result: SceneResult,
}

/// Why a file that is there cannot be used.
enum Unusable {
    /// Worth nothing: to be made again.
    Damaged(Error),
    /// Another's, or not to be read: to be left alone.
    Foreign(Error),
}

impl Unusable {
    fn into_error(self) -> Error {
        match self {
            Self::Damaged(error) | Self::Foreign(error) => error,
        }
    }
}

#[cfg(test)]
mod tests;
