//! Progress of long commands, and how they are stopped.

use std::io::IsTerminal;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// The first Ctrl-C asks the work in progress to stop and keep its result; the second ends the
/// program. Another call resets a Ctrl-C that has been handled.
pub fn catch_interrupts() {
    static ONCE: Once = Once::new();
    INTERRUPTED.store(false, Ordering::SeqCst);
    ONCE.call_once(|| {
        let caught = ctrlc::set_handler(|| {
            if INTERRUPTED.swap(true, Ordering::SeqCst) {
                std::process::exit(130);
            }
            eprintln!("stopping after this step; the result so far is kept (again: stop at once)");
        });
        if let Err(error) = caught {
            tracing::warn!("Ctrl-C will not keep the result: {error}");
        }
    });
}

pub fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::SeqCst)
}

/// Progress on stderr: a live line on a terminal, a line now and then elsewhere.
pub struct Bar {
    bar: Option<ProgressBar>,
    last: std::cell::Cell<Option<Instant>>,
}

/// Interval between lines of progress where there is no terminal.
const QUIET: Duration = Duration::from_secs(10);

impl Bar {
    pub fn new() -> Self {
        let shown = tracing::enabled!(tracing::Level::INFO) && std::io::stderr().is_terminal();
        let bar = shown.then(|| {
            let bar = ProgressBar::new_spinner();
            if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}") {
                bar.set_style(style);
            }
            bar
        });
        Self {
            bar,
            last: std::cell::Cell::new(Some(Instant::now())),
        }
    }

    pub fn show(&self, text: String) {
        match &self.bar {
            Some(bar) => {
                bar.set_message(text);
                bar.tick();
            }
            None if self.last.get().is_none_or(|last| last.elapsed() >= QUIET) => {
                self.last.set(Some(Instant::now()));
                tracing::info!("{text}");
            }
            None => {}
        }
    }

    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
