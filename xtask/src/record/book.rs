//! One record while it is made: commands as a reader would type them, and what they printed.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use crate::tools::{Result, Scratch, data, root};

/// What the lines of a record's head begin with, right below its first command: the commit that it was made from, the digest
/// of the program's answers, the machine, and the seconds that it took. Documents do not quote them.
pub const COMMIT: &str = "# commit ";
pub const ANSWERS: &str = "# answers ";
pub const MACHINE: &str = "# machine ";
pub const TOOK: &str = "# took ";

/// What every job works with.
pub struct Bench {
    /// The command.
    pub umbracast: PathBuf,
    /// Written as `/tmp` in the record.
    pub scratch: Scratch,
}

/// A record. Paths of this machine are written as `$UMBRACAST_DATA` and `/tmp`.
pub struct Book {
    name: &'static str,
    commit: String,
    answers: String,
    text: String,
    bench: Bench,
    begun: Instant,
    /// Folders of the scores that [`Book::compare`] lays side by side.
    scored: Vec<PathBuf>,
    /// Whether the file is added to, not made anew.
    pub adds: bool,
}

impl Book {
    /// Empty.
    #[allow(clippy::disallowed_methods)] // A record says what it took.
    pub fn new(name: &'static str, commit: &str, answers: &str, bench: Bench) -> Self {
        let (commit, answers) = (commit.to_owned(), answers.to_owned());
        let (text, scored, begun) = (String::new(), Vec::new(), Instant::now());
        Self { name, commit, answers, text, bench, begun, scored, adds: false }
    }

    /// A path below the scratch folder.
    pub fn scratch(&self, name: &str) -> PathBuf {
        self.bench.scratch.0.join(name)
    }

    /// The command.
    pub fn umbracast(&self) -> &Path {
        &self.bench.umbracast
    }

    /// A path below the real data.
    pub fn data(&self, name: &str) -> Result<OsString> {
        let path = data().ok_or("expected UMBRACAST_DATA, found none")?.join(name);
        if path.exists() { Ok(path.into()) } else { Err(format!("{}: not there", path.display())) }
    }

    /// The line of a command.
    pub fn command(&mut self, line: &str) {
        if !self.text.is_empty() {
            self.text.push('\n');
        }
        self.line(&format!("$ {line}"));
    }

    /// A line, or several.
    pub fn line(&mut self, text: &str) {
        let scrubbed = self.scrubbed(text);
        self.text.push_str(scrubbed.trim_end());
        self.text.push('\n');
    }

    /// Runs `umbracast` with these words and `--quiet`, and writes down what it printed.
    pub fn umbracast_says<A: Into<OsString>>(&mut self, words: impl IntoIterator<Item = A>) -> Result<()> {
        let words: Vec<OsString> = words.into_iter().map(Into::into).collect();
        self.command(&format!("umbracast {}", spoken(&words)));
        let said = self.quietly(&words)?;
        self.line(&said);
        Ok(())
    }

    /// What `umbracast` prints with these words and `--quiet`, its warnings last.
    pub fn quietly(&self, words: &[OsString]) -> Result<String> {
        let (out, err) = self.streams(words)?;
        Ok(out + &err)
    }

    /// Scores in memory of mode `default` under a name, for [`Book::compare`].
    pub fn score<A: Into<OsString>>(&mut self, name: &str, words: impl IntoIterator<Item = A>) -> Result<()> {
        self.score_in("default", name, words)
    }

    /// The same of the given modes.
    pub fn score_in<A: Into<OsString>>(
        &mut self,
        modes: &str,
        name: &str,
        words: impl IntoIterator<Item = A>,
    ) -> Result<()> {
        let words: Vec<OsString> = ["evaluate", "--mode", modes]
            .map(OsString::from)
            .into_iter()
            .chain(words.into_iter().map(Into::into))
            .collect();
        self.line(&format!("# {name}: umbracast {}", spoken(&words)));
        let folder = self.scratch(name);
        let scores = self.streams(&words.into_iter().chain(["--json".into()]).collect::<Vec<OsString>>())?.0;
        fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
        fs::write(folder.join("scores.json"), scores).map_err(|e| e.to_string())?;
        self.scored.push(folder);
        Ok(())
    }

    /// Everything scored so far in one table.
    pub fn compare(&mut self) -> Result<()> {
        let words: Vec<OsString> = [OsString::from("compare")]
            .into_iter()
            .chain(self.scored.drain(..).map(OsString::from))
            .collect();
        let table = self.quietly(&words)?;
        self.text.push('\n');
        self.line(&table);
        Ok(())
    }

    /// What a line of bash prints in `folder`, both streams as they come; whether it failed is for the reader to see.
    pub fn bash(&self, folder: &Path, line: &str) -> Result<String> {
        let mut bash = Command::new("bash");
        bash.args(["-c", &format!("exec 2>&1; {line}")]).current_dir(folder);
        let folder = self.bench.umbracast.parent().unwrap_or(Path::new("."));
        let path = std::env::var("PATH").unwrap_or_default();
        bash.env("PATH", format!("{}:{path}", folder.display()));
        let done = bash.output().map_err(|e| format!("bash: {e}"))?;
        Ok(String::from_utf8_lossy(&done.stdout).into_owned())
    }

    /// Replaces this machine's paths by those of the record.
    pub fn scrubbed(&self, text: &str) -> String {
        let mut text = text.replace(&*self.bench.scratch.0.to_string_lossy(), "/tmp");
        if let Some(data) = data() {
            text = text.replace(&*data.to_string_lossy(), "$UMBRACAST_DATA");
        }
        text.replace(&*root().to_string_lossy(), ".")
    }

    /// Writes the file and tells its name and what it took.
    pub fn close(self) -> Result<String> {
        let name = format!("record/{}.txt", self.name);
        let place = root().join(&name);
        let before = if self.adds { fs::read_to_string(&place).unwrap_or_default() } else { String::new() };
        let between = if before.is_empty() { "" } else { "\n" };
        let seconds = self.begun.elapsed().as_secs();
        let text = headed(&self.text, &self.commit, &self.answers, &machine(), seconds);
        fs::write(&place, before + between + &text).map_err(|e| format!("{name}: {e}"))?;
        Ok(format!("{name}: {seconds} s"))
    }

    /// Both streams. Code 3 says that data was lost, and the warning that comes with it what.
    fn streams(&self, words: &[OsString]) -> Result<(String, String)> {
        let done =
            Command::new(&self.bench.umbracast).args(words).arg("--quiet").current_dir(root()).output();
        let done = done.map_err(|e| format!("umbracast: {e}"))?;
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        match done.status.code() {
            Some(0 | 3) => Ok((text(&done.stdout), text(&done.stderr))),
            _ => Err(format!("umbracast {}: {}{}", spoken(words), done.status, text(&done.stderr))),
        }
    }
}

/// Words as they are typed.
pub fn spoken(words: &[OsString]) -> String {
    words.iter().map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
}

/// A record with its head below the first line, whatever that is.
fn headed(text: &str, commit: &str, answers: &str, machine: &str, seconds: u64) -> String {
    let (first, rest) = text.split_once('\n').unwrap_or((text, ""));
    format!("{first}\n{COMMIT}{commit}\n{ANSWERS}{answers}\n{MACHINE}{machine}\n{TOOK}{seconds} s\n{rest}")
}

/// What times depend on: the processor, its cores, and whether it has the vectors that forecasts use where they can.
fn machine() -> String {
    let about = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let of = |key: &str| {
        let line = about.lines().find(|line| line.starts_with(key))?;
        line.split_once(':').map(|(_, value)| value.trim())
    };
    let model = of("model name").unwrap_or("unknown processor");
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let avx512 = if of("flags").unwrap_or_default().contains("avx512f") { "with" } else { "without" };
    format!("{model}, cores {cores}, {avx512} AVX-512")
}

/// Seconds that a record took; of several looks, the last.
pub fn took_s(record: &str) -> Option<f64> {
    let line = record.lines().filter_map(|line| line.strip_prefix(TOOK)).next_back()?;
    line.strip_suffix(" s")?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_says_what_it_is_of_and_what_it_took() {
        let record = headed("$ umbracast\n\nF1\n", "12ab", "99ff", "EPYC", 312);
        assert_eq!(
            record,
            "$ umbracast\n# commit 12ab\n# answers 99ff\n# machine EPYC\n# took 312 s\n\nF1\n"
        );
        assert_eq!(took_s(&record), Some(312.0));
        assert_eq!(took_s(&(record.clone() + &record.replace("312", "4"))), Some(4.0));
        assert_eq!(took_s("$ umbracast\nF1\n"), None);
    }
}
