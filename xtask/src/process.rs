//! Running other programs: what was run, what it said, and how it ended.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// Why a command of the project stopped, in one line.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// A program could not be started.
    #[error("cannot start `{program}`: {source}")]
    NotStarted {
        /// What was to run.
        program: String,
        /// Why it did not.
        source: std::io::Error,
    },
    /// A program ended badly.
    #[error("`{command}` ended with {status}")]
    Ended {
        /// What ran.
        command: String,
        /// Its exit status in words.
        status: String,
    },
    /// Something of the machine is missing.
    #[error("missing {what}; install with: {how}")]
    Missing {
        /// What is missing.
        what: String,
        /// The command that installs it.
        how: String,
    },
    /// A file could not be read or written.
    #[error("{path}: {source}")]
    File {
        /// Which.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// A check found something that must not be.
    #[error("{0}")]
    Found(String),
}

/// What a program wrote, standard output and standard error in the order of arrival per stream.
pub struct Said {
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

/// The cargo that runs this program, or the one on the PATH.
pub fn cargo() -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(crate::root());
    command
}

/// Builds a program of the workspace and tells where it is. `kind` is `--bin` or `--example`.
///
/// The whole workspace is named with all features, as in the tests, whose libraries are then built already; and an example
/// beside a program, which alone would lack the features that only tests ask for. What is released here is measured, not
/// looked at: without the window it is built in half the time.
pub fn build(profile: &str, kind: &str, name: &str) -> Result<PathBuf, Failure> {
    let mut words = vec!["build", "--locked", "--workspace", "--example", "selftest", "--profile", profile, kind, name];
    words.push(if profile == "release" { "--no-default-features" } else { "--all-features" });
    run(cargo().args(&words))?;
    // Built now: the second call only says where, wherever the target folder of this machine may be.
    let said = read(cargo().args(&words).args(["--message-format", "json"]))?;
    let messages = said.out.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
    let mut built = messages.filter(|message| message["target"]["name"] == name);
    let built = built.find_map(|message| message["executable"].as_str().map(PathBuf::from));
    built.ok_or_else(|| Failure::Found(format!("cargo built no `{name}`")))
}

/// A program and its arguments in the root of the checkout.
pub fn program<S: AsRef<OsStr>>(name: &str, arguments: impl IntoIterator<Item = S>) -> Command {
    let mut command = Command::new(name);
    command.current_dir(crate::root()).args(arguments);
    command
}

/// The command as one would type it.
pub fn typed(command: &Command) -> String {
    let name = std::path::Path::new(command.get_program()).file_name().unwrap_or(command.get_program());
    let words = std::iter::once(name).chain(command.get_args());
    words.map(OsStr::to_string_lossy).collect::<Vec<_>>().join(" ")
}

/// Runs a command on this terminal.
pub fn run(command: &mut Command) -> Result<(), Failure> {
    let status = command.status().map_err(|source| not_started(command, source))?;
    if status.success() { Ok(()) } else { Err(ended(command, &status.to_string())) }
}

/// Runs a command silently. Its output is shown only when it fails.
pub fn read(command: &mut Command) -> Result<Said, Failure> {
    let output = command.stdin(Stdio::null()).output().map_err(|source| not_started(command, source))?;
    let said = Said {
        out: String::from_utf8_lossy(&output.stdout).into_owned(),
        err: String::from_utf8_lossy(&output.stderr).into_owned(),
    };
    if output.status.success() {
        return Ok(said);
    }
    eprint!("{}{}", said.out, said.err);
    Err(ended(command, &output.status.to_string()))
}

/// Runs a command with its output shown as it comes and kept. The output is returned also when the command failed.
pub fn show_and_read(command: &mut Command) -> (Said, Result<(), Failure>) {
    let nothing = Said { out: String::new(), err: String::new() };
    let started = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let mut child = match started {
        Ok(child) => child,
        Err(source) => return (nothing, Err(not_started(command, source))),
    };
    let (out, err) = (child.stdout.take(), child.stderr.take());
    let said = thread::scope(|scope| {
        let err = scope.spawn(move || err.map(|pipe| copy(pipe, std::io::stderr())).unwrap_or_default());
        let out = out.map(|pipe| copy(pipe, std::io::stdout())).unwrap_or_default();
        Said { out, err: err.join().unwrap_or_default() }
    });
    let result = match child.wait() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(ended(command, &status.to_string())),
        Err(source) => Err(not_started(command, source)),
    };
    (said, result)
}

/// How a command that was watched ended.
pub struct Ended {
    /// What it wrote.
    pub said: Said,
    /// Its exit code; none when it was stopped, by us or by a signal.
    pub code: Option<i32>,
}

/// Runs a command silently, asking `keep` about ten times each second; it is stopped when that says no.
pub fn watch(command: &mut Command, mut keep: impl FnMut() -> bool) -> Result<Ended, Failure> {
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|source| not_started(command, source))?;
    let (out, err) = (child.stdout.take(), child.stderr.take());
    Ok(thread::scope(|scope| {
        let out = scope.spawn(move || out.map(all).unwrap_or_default());
        let err = scope.spawn(move || err.map(all).unwrap_or_default());
        let mut pause = Duration::from_millis(1);
        let code = loop {
            match child.try_wait() {
                Ok(Some(status)) => break status.code(),
                Ok(None) if keep() => thread::sleep(pause),
                _ => {
                    // Killing fails only for a child that has just ended by itself.
                    let _ = child.kill();
                    let _ = child.wait();
                    break None;
                }
            }
            pause = (2 * pause).min(Duration::from_millis(100));
        };
        Ended { said: Said { out: out.join().unwrap_or_default(), err: err.join().unwrap_or_default() }, code }
    }))
}

/// Runs a command silently and stops it when it takes longer than `limit`. Its output is shown only when it fails.
pub fn read_within(command: &mut Command, limit: Duration) -> Result<Said, Failure> {
    let start = Instant::now();
    let Ended { said, code } = watch(command, || start.elapsed() < limit)?;
    if code == Some(0) {
        return Ok(said);
    }
    eprint!("{}{}", said.out, said.err);
    let status = match code {
        Some(code) => format!("exit code {code}"),
        None if start.elapsed() >= limit => format!("no end after {} s", limit.as_secs_f64()),
        None => "a signal".into(),
    };
    Err(ended(command, &status))
}

/// Asks a program to end, as Ctrl-C does, and waits so long for it; none if it goes on.
pub fn interrupt(child: &mut Child, patience: Duration) -> Result<Option<ExitStatus>, Failure> {
    let waited = |child: &mut Child| child.try_wait().map_err(|error| Failure::Found(format!("a program: {error}")));
    if let Some(status) = waited(child)? {
        return Ok(Some(status));
    }
    read(&mut program("kill", ["-INT", &child.id().to_string()]))?;
    let begun = Instant::now();
    loop {
        match waited(child)? {
            None if begun.elapsed() < patience => thread::sleep(Duration::from_millis(50)),
            ended => return Ok(ended),
        }
    }
}

fn all(mut pipe: impl Read) -> String {
    let mut bytes = Vec::new();
    // A pipe that breaks ends the output; the exit status tells the rest.
    let _ = pipe.read_to_end(&mut bytes);
    String::from_utf8_lossy(&bytes).into_owned()
}

fn copy(pipe: impl Read, mut to: impl Write) -> String {
    let mut kept = String::new();
    let mut pipe = BufReader::new(pipe);
    let mut line = Vec::new();
    while pipe.read_until(b'\n', &mut line).is_ok_and(|count| count > 0) {
        // Nobody reading this terminal is no reason to stop the checks.
        let _ = to.write_all(&line).and_then(|()| to.flush());
        kept.push_str(&String::from_utf8_lossy(&line));
        line.clear();
    }
    kept
}

fn not_started(command: &Command, source: std::io::Error) -> Failure {
    Failure::NotStarted { program: command.get_program().to_string_lossy().into_owned(), source }
}

fn ended(command: &Command, status: &str) -> Failure {
    Failure::Ended { command: typed(command), status: status.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_hangs_is_stopped() {
        let failure = read_within(&mut program("sleep", ["30"]), Duration::from_millis(100)).err();
        assert_eq!(
            failure.map(|failure| failure.to_string()).as_deref(),
            Some("`sleep 30` ended with no end after 0.1 s")
        );
    }

    #[test]
    fn a_program_that_is_not_there_is_named() {
        let failure = read(&mut program("no-such-program", [""; 0])).err().map(|failure| failure.to_string());
        assert!(failure.is_some_and(|text| text.starts_with("cannot start `no-such-program`: ")));
    }

    #[test]
    fn output_is_kept_though_the_program_failed() {
        let (said, result) = show_and_read(&mut program("sh", ["-c", "echo kept; exit 3"]));
        assert_eq!(said.out, "kept\n");
        assert!(result.is_err());
    }
}
