//! Says on standard error how far the work is, where someone sits at a terminal and it takes more than a second.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What takes less is done before anybody asks.
const PATIENCE: Duration = Duration::from_secs(1);

/// For work that knows how far it is. The line is clean again when this goes.
pub struct Meter {
    always: bool,
    terminal: bool,
    begin: Instant,
    /// Percent shown last.
    shown: AtomicU32,
}

impl Meter {
    /// From now on; with `always` from the first moment and whoever reads it.
    pub fn new(always: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        Self { always, terminal, begin: Instant::now(), shown: AtomicU32::new(u32::MAX) }
    }

    /// So much is done, and this is what is being done.
    pub fn show(&self, share: f64, stage: &str) {
        let percent = (100.0 * share) as u32;
        let due = self.always || self.terminal && self.begin.elapsed() > PATIENCE;
        if due && self.shown.swap(percent, Ordering::Relaxed) != percent {
            if self.terminal {
                eprint!("\r\x1b[K{percent:3} % {stage}");
            } else {
                eprintln!("{percent:3} % {stage}");
            }
        }
    }
}

impl Drop for Meter {
    fn drop(&mut self) {
        if self.terminal && self.shown.load(Ordering::Relaxed) != u32::MAX {
            eprint!("\r\x1b[K");
        }
    }
}

/// For work that does not know how far it is: its stage, and for how long it has gone on. The line is clean again when this goes.
pub struct Clock {
    state: Arc<(Mutex<Option<String>>, Condvar)>,
    shower: Option<JoinHandle<()>>,
}

impl Clock {
    /// From now on.
    pub fn new(stage: impl Into<String>) -> Self {
        let state = Arc::new((Mutex::new(Some(stage.into())), Condvar::new()));
        let shown = Arc::clone(&state);
        let shower = std::io::stderr().is_terminal().then(|| std::thread::spawn(move || show(&shown)));
        Self { state, shower }
    }

    /// What is being done from now on.
    pub fn stage(&self, stage: impl Into<String>) {
        self.set(Some(stage.into()));
    }

    fn set(&self, stage: Option<String>) {
        *self.state.0.lock().unwrap_or_else(PoisonError::into_inner) = stage;
    }
}

impl Drop for Clock {
    fn drop(&mut self) {
        self.set(None);
        self.state.1.notify_all();
        if let Some(shower) = self.shower.take() {
            let _ = shower.join();
        }
    }
}

/// Shows the stage until there is none.
fn show((stage, ended): &(Mutex<Option<String>>, Condvar)) {
    let begin = Instant::now();
    let mut any = false;
    let mut now = stage.lock().unwrap_or_else(PoisonError::into_inner);
    while let Some(stage) = now.as_deref() {
        if begin.elapsed() > PATIENCE {
            eprint!("\r\x1b[K{:3} s {stage}", begin.elapsed().as_secs());
            any = true;
        }
        now = ended.wait_timeout(now, PATIENCE / 2).unwrap_or_else(PoisonError::into_inner).0;
    }
    if any {
        eprint!("\r\x1b[K");
    }
}
