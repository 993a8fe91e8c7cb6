//! Fails what never ends, and says what it was at.

use std::collections::BTreeMap;
use std::fmt::Debug;
use std::io::Write;
use std::sync::{Mutex, Once};
use std::time::{Duration, Instant};
use std::{process, thread};

/// After this what should take milliseconds counts as endless, on a machine however busy. It tells
/// nothing about speed.
const DEADLINE: Duration = Duration::from_secs(60);

/// When the calls that are running began, and what they are at.
static RUNNING: Mutex<BTreeMap<Instant, String>> = Mutex::new(BTreeMap::new());

/// What a call returns, which must end: one that does not is the end of the program, as a thread
/// cannot be stopped from outside.
///
/// * `input` - what the call is at, told when it does not end
pub(crate) fn must_end<T>(input: &dyn Debug, call: impl FnOnce() -> T) -> T {
    static WATCH: Once = Once::new();
    WATCH.call_once(|| drop(thread::spawn(watch)));
    let _running = Running::new(format!("{input:?}"));
    call()
}

/// A call that has not ended, by when it began.
struct Running(Instant);

impl Running {
    fn new(input: String) -> Self {
        let mut running = RUNNING.lock().unwrap();
        // No two at the same time.
        let mut begin = Instant::now();
        while running.contains_key(&begin) {
            begin += Duration::from_nanos(1);
        }
        running.insert(begin, input);
        Self(begin)
    }
}

impl Drop for Running {
    /// Also when the call panics.
    fn drop(&mut self) {
        RUNNING.lock().unwrap().remove(&self.0);
    }
}

/// Ends the program when the oldest call has not ended in time.
fn watch() {
    loop {
        thread::sleep(DEADLINE / 60);
        if let Some((begin, input)) = RUNNING.lock().unwrap().first_key_value()
            && begin.elapsed() > DEADLINE
        {
            // Not through `eprintln!`: what tests print with it is shown when they have ended.
            let _ = writeln!(std::io::stderr(), "ENDLESS: {input}");
            process::exit(101);
        }
    }
}
