//! The repository's place, and running other programs.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Everything that goes wrong here is told to a developer, as text.
pub type Result<T> = std::result::Result<T, String>;

/// The repository's folder.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().map(Path::to_path_buf).unwrap_or_default()
}

/// Cargo's build folder.
pub fn target() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from)
}

/// The folder of the real data, where there is one.
pub fn data() -> Option<PathBuf> {
    std::env::var_os("UMBRACAST_DATA").map(PathBuf::from).filter(|folder| folder.is_dir())
}

/// What a program prints in `folder`, its end cut off. Fails when the program does.
pub fn output(folder: &Path, program: &str, arguments: &[&str]) -> Result<String> {
    let done = Command::new(program).args(arguments).current_dir(folder).stderr(Stdio::inherit()).output();
    let done = done.map_err(|e| format!("{program}: {e}"))?;
    if !done.status.success() {
        return Err(format!("{program} {}: {}", arguments.join(" "), done.status));
    }
    Ok(String::from_utf8_lossy(&done.stdout).trim_end().to_owned())
}

/// The command `umbracast`, built from the sources in `folder`.
pub fn built(folder: &Path, target: &Path) -> Result<PathBuf> {
    let mut cargo = Command::new("cargo");
    cargo.args(["build", "--release", "--quiet", "--package", "umbracast-cli"]);
    // The sources decide with which compiler they are built, not the one that this program was built with.
    cargo.env_remove("RUSTUP_TOOLCHAIN").env("CARGO_TARGET_DIR", target).current_dir(folder);
    let status = cargo.status().map_err(|e| format!("cargo: {e}"))?;
    if !status.success() {
        return Err(format!("cargo build in {}: {status}", folder.display()));
    }
    Ok(target.join("release").join(format!("umbracast{}", std::env::consts::EXE_SUFFIX)))
}

/// Every file below a folder whose name ends so, in order of path.
pub fn files_below(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut entries: Vec<PathBuf> =
        fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            found.extend(files_below(&path, ending));
        } else if path.to_string_lossy().ends_with(ending) {
            found.push(path);
        }
    }
    found
}

/// A folder that is removed when it goes out of scope.
pub struct Scratch(pub PathBuf);

impl Scratch {
    /// Empty, in the system's folder for such things.
    pub fn new(name: &str) -> Result<Self> {
        let folder = std::env::temp_dir().join(format!("umbracast-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        Ok(Self(folder))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A path as an argument.
pub fn argument(path: impl Into<PathBuf>) -> OsString {
    path.into().into_os_string()
}
