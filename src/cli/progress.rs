//! Progress of long commands, and how they are stopped.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// What asks the program to stop: Ctrl-C, `kill`, a terminal that is closed.
#[cfg(unix)]
const SIGNALS: [i32; 3] = [SIGINT, SIGTERM, signal_hook::consts::SIGHUP];
#[cfg(not(unix))]
const SIGNALS: [i32; 2] = [SIGINT, SIGTERM];

/// The signal that has arrived, if any.
#[derive(Default)]
struct Caught {
    signal: Arc<AtomicUsize>,
    any: Arc<AtomicBool>,
    told: AtomicBool,
}

static CAUGHT: LazyLock<Caught> = LazyLock::new(|| {
    let caught = Caught::default();
    for signal in SIGNALS {
        let (number, any) = (Arc::clone(&caught.signal), Arc::clone(&caught.any));
        // In this order: a signal ends the program only if another one came before it.
        let registered =
            flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&any))
                .and_then(|_| flag::register_usize(signal, number, signal as usize))
                .and_then(|_| flag::register(signal, any));
        if let Err(error) = registered {
            tracing::warn!("signal {signal} will not keep the result: {error}");
        }
    }
    caught
});

/// Makes a write beyond the limit on a file's size fail, as one to a full disk does, where by
/// default it kills the program.
pub fn survive_limits() {
    #[cfg(unix)]
    {
        let too_large = rustix::process::Signal::XFSZ.as_raw();
        if let Err(error) = flag::register(too_large, Arc::default()) {
            tracing::warn!("a file beyond the limit on its size will end the program: {error}");
        }
    }
}

/// The first Ctrl-C, or another signal to stop, asks the work in progress to stop and keep its
/// result; the second ends the program. Another call resets one that has been handled.
pub fn catch_interrupts() {
    CAUGHT.any.store(false, Ordering::SeqCst);
    CAUGHT.signal.store(0, Ordering::SeqCst);
    CAUGHT.told.store(false, Ordering::SeqCst);
}

pub fn interrupted() -> bool {
    let is = CAUGHT.any.load(Ordering::SeqCst);
    if is && !CAUGHT.told.swap(true, Ordering::SeqCst) {
        tracing::warn!("stopping after this step; the result so far is kept (again: stop at once)");
    }
    is
}

/// Exit code of a program that a signal has stopped, 128 + its number; None if there was none.
pub fn stopped_by() -> Option<u8> {
    let signal = CAUGHT.signal.load(Ordering::SeqCst);
    (signal != 0).then(|| 128 + signal as u8)
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
