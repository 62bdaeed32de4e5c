//! A display in memory.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

/// A display in memory, gone with the test.
pub struct Display {
    server: Child,
    pub name: String,
}

impl Display {
    pub fn new() -> Self {
        Self::sized("1024x768")
    }

    pub fn sized(size: &str) -> Self {
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", &format!("{size}x24")])
            // A server that begins again after its last client refuses those that come meanwhile.
            .args(["-nolisten", "tcp", "-noreset"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the tests need Xvfb (Debian: xvfb)");
        let mut number = String::new();
        let out = server.stdout.take().expect("piped");
        BufReader::new(out)
            .read_line(&mut number)
            .expect("the display tells its number");
        Self {
            server,
            name: format!(":{}", number.trim()),
        }
    }

    /// Sends keys and mouse events with xdotool; returns its output.
    pub fn xdotool(&self, args: &[&str]) -> String {
        let done = Command::new("xdotool")
            .args(args)
            .env("DISPLAY", &self.name)
            .output()
            .expect("the tests need xdotool");
        assert!(
            done.status.success(),
            "xdotool {args:?}: {}",
            String::from_utf8_lossy(&done.stderr)
        );
        String::from_utf8_lossy(&done.stdout).trim().to_owned()
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}
