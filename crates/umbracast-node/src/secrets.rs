//! Files that hold passwords and keys: only their owner, and their owner's group, may read them.

use std::fs;
use std::path::Path;

use umbracast::Error;

/// Refuses a file that every user of this host can read, change or run. The group may read it: that is how Kubernetes gives
/// a secret to a process that is not root.
///
/// # Errors
/// A file that is not there, and one that is open to others, with the `chmod` that closes it.
pub fn closed_to_others(file: &Path) -> Result<(), Error> {
    let about = fs::metadata(file).map_err(|e| Error::new(e.to_string()).within(file.display()))?;
    match open_to_others(&about) {
        None => Ok(()),
        Some(mode) => Err(Error::new(format!(
            "expected a file that other users cannot read, because it holds a secret, found mode {mode:03o}: chmod 600 {}",
            file.display()
        ))
        .within(file.display())),
    }
}

/// The first line of such a file.
///
/// # Errors
/// As [`closed_to_others`], and what is no text.
pub fn first_line(file: &Path) -> Result<String, Error> {
    closed_to_others(file)?;
    let text = fs::read_to_string(file).map_err(|e| Error::new(e.to_string()).within(file.display()))?;
    Ok(text.lines().next().unwrap_or_default().to_owned())
}

/// The mode of a file that others may use.
#[cfg(unix)]
fn open_to_others(about: &fs::Metadata) -> Option<u32> {
    use std::os::unix::fs::PermissionsExt;
    let mode = about.permissions().mode() & 0o777;
    (mode & 0o007 != 0).then_some(mode)
}

/// Rights of other systems are not read.
#[cfg(not(unix))]
fn open_to_others(_: &fs::Metadata) -> Option<u32> {
    None
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn a_file_that_others_can_read_is_refused_with_the_chmod_that_closes_it() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("users.txt");
        fs::write(&file, "edge:hidden\nserver:hidden\n").unwrap();
        for (mode, closed) in [(0o600, true), (0o440, true), (0o640, true), (0o644, false), (0o602, false)] {
            fs::set_permissions(&file, fs::Permissions::from_mode(mode)).unwrap();
            let said = first_line(&file).map_err(|error| error.to_string());
            assert_eq!(said.is_ok(), closed, "{mode:o}: {said:?}");
            assert!(said.is_ok_and(|line| line == "edge:hidden") || !closed);
        }
        let refused = closed_to_others(&file).unwrap_err().to_string();
        assert!(refused.contains("chmod 600") && refused.contains("users.txt"), "{refused}");
        assert!(!refused.contains("hidden"));
    }
}
