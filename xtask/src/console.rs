//! What people see while they wait, on stderr.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::Write;
use std::time::{Duration, Instant};

/// Where people are told what is going on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Console {
    /// On stderr, with bars and spinners where that is a terminal.
    Stderr,
    /// Nowhere.
    Silent,
}

impl Console {
    /// Runs a stage and says how long it took and how much memory the program has needed so far.
    pub fn stage<T>(&self, name: &str, work: impl FnOnce() -> T) -> T {
        let spinner = match self {
            Self::Stderr => ProgressBar::new_spinner().with_message(name.to_owned()),
            Self::Silent => ProgressBar::hidden(),
        };
        spinner.enable_steady_tick(Duration::from_millis(100));
        let start = Instant::now();
        let result = work();
        spinner.finish_and_clear();
        let seconds = start.elapsed().as_secs_f64();
        let memory = peak_rss_bytes() as f64 / 1e6;
        self.say(format_args!(
            "  {name:<24} {seconds:>8.3} s {memory:>9.0} MB at most"
        ));
        result
    }

    /// A bar for `count` steps.
    pub(crate) fn bar(&self, name: &str, count: u64) -> ProgressBar {
        if *self == Self::Silent {
            return ProgressBar::hidden();
        }
        let style = ProgressStyle::with_template("  {msg:<24} {bar:40} {pos}/{len}, {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        ProgressBar::new(count)
            .with_style(style)
            .with_message(name.to_owned())
    }

    /// One line.
    pub fn say(&self, line: impl std::fmt::Display) {
        if *self == Self::Stderr {
            // Where nobody listens, nothing needs to be said.
            let _ = writeln!(std::io::stderr(), "{line}");
        }
    }

    /// Something that should be known but stops nothing.
    pub(crate) fn warn(&self, line: impl std::fmt::Display) {
        self.say(format_args!("warning: {line}"));
    }

    /// Why the work failed.
    pub fn error(&self, error: &anyhow::Error) {
        self.say(format_args!("error: {error:#}"));
    }
}

/// The most memory the program has had at any time so far, in bytes; 0 where the system does not
/// tell.
pub fn peak_rss_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kilobytes = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))
        .and_then(|rest| rest.trim().trim_end_matches(" kB").parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024
}
