//! What people see while they wait, on stderr.
#![expect(
    clippy::print_stderr,
    reason = "this is where the program talks to people"
)]

use indicatif::{ProgressBar, ProgressStyle};
use std::time::{Duration, Instant};

/// Talks to people on stderr; bars and spinners only where stderr is a terminal.
#[derive(Clone, Copy, Debug)]
pub struct Console;

impl Console {
    /// Runs a stage and says how long it took and how much memory the program has needed so far.
    pub(crate) fn stage<T>(&self, name: &str, work: impl FnOnce() -> T) -> T {
        let spinner = ProgressBar::new_spinner().with_message(name.to_owned());
        spinner.enable_steady_tick(Duration::from_millis(100));
        let start = Instant::now();
        let result = work();
        spinner.finish_and_clear();
        let seconds = start.elapsed().as_secs_f64();
        let memory = peak_rss_bytes() as f64 / 1e6;
        eprintln!("  {name:<24} {seconds:>8.3} s {memory:>9.0} MB at most");
        result
    }

    /// A bar for `count` steps.
    pub(crate) fn bar(&self, name: &str, count: u64) -> ProgressBar {
        let style = ProgressStyle::with_template("  {msg:<24} {bar:40} {pos}/{len}, {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        ProgressBar::new(count)
            .with_style(style)
            .with_message(name.to_owned())
    }

    /// One line.
    pub(crate) fn say(&self, line: impl std::fmt::Display) {
        eprintln!("{line}");
    }

    /// Something that should be known but stops nothing.
    pub(crate) fn warn(&self, line: impl std::fmt::Display) {
        eprintln!("warning: {line}");
    }

    /// Why the work failed.
    pub fn error(&self, error: &anyhow::Error) {
        eprintln!("error: {error:#}");
    }
}

/// The most memory the program has had at any time so far, in bytes; 0 where the system does not
/// tell.
pub(crate) fn peak_rss_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kilobytes = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))
        .and_then(|rest| rest.trim().trim_end_matches(" kB").parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024
}
