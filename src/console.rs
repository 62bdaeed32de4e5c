//! Output to stdout and stderr that does not stop the work when the reader has left or the disk is
//! full.

use std::fmt::Arguments;
use std::io::{self, ErrorKind, Write};
use std::sync::Mutex;

static LOST: Mutex<Option<io::Error>> = Mutex::new(None);

/// Writes a line to stdout. What fails is kept for [`lost`].
pub fn line(text: Arguments<'_>) {
    let mut out = io::stdout().lock();
    if let Err(error) = writeln!(out, "{text}") {
        let mut lost = LOST.lock().unwrap_or_else(|e| e.into_inner());
        lost.get_or_insert(error);
    }
}

/// The first error of a line to stdout. A reader that has left, such as `head`, is none.
pub fn lost() -> Option<io::Error> {
    let mut lost = LOST.lock().unwrap_or_else(|e| e.into_inner());
    lost.take().filter(|e| e.kind() != ErrorKind::BrokenPipe)
}

/// Stderr whose errors are ignored: they could be reported nowhere.
#[derive(Debug, Clone, Copy, Default)]
pub struct Stderr;

impl Write for Stderr {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let _ = io::stderr().write_all(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let _ = io::stderr().flush();
        Ok(())
    }
}

/// Says what has ended the program.
pub fn tell_error(error: &dyn std::fmt::Display) {
    let _ = writeln!(Stderr, "mesolux: {error}");
}

/// `println!`, without a panic where stdout is closed or full: see [`crate::console`].
#[macro_export]
macro_rules! say {
    () => { $crate::console::line(format_args!("")) };
    ($($text:tt)*) => { $crate::console::line(format_args!($($text)*)) };
}
