//! Chromium on a display in memory.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::display::Display;
use crate::server::{Server, State};

/// Pixels of the page: the whole display.
pub const SIZE: (u32, u32) = (1024, 768);

pub struct Browser(Child);

impl Browser {
    pub fn open(display: &Display, profile: &Path, address: &str) -> Self {
        let names = ["chromium", "chromium-browser", "google-chrome"];
        let child = names.into_iter().find_map(|name| {
            Command::new(name)
                .args([
                    "--no-sandbox",
                    "--no-first-run",
                    "--kiosk",
                    "--hide-scrollbars",
                ])
                .args([
                    "--use-gl=angle",
                    "--use-angle=swiftshader",
                    "--enable-unsafe-swiftshader",
                ])
                .args([
                    "--window-position=0,0",
                    &format!("--window-size={},{}", SIZE.0, SIZE.1),
                ])
                .arg(format!("--user-data-dir={}", profile.display()))
                .arg(address)
                .env("DISPLAY", &display.name)
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .ok()
        });
        Self(child.expect("the test needs Chromium (Debian: chromium)"))
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Waits until the page is as wanted.
#[track_caller]
pub fn wait(server: &Server, what: &str, wanted: impl Fn(&State) -> bool) -> State {
    let begin = Instant::now();
    loop {
        match server.state() {
            Some(state) if wanted(&state) => return state,
            state => {
                let title = state.map(|state| state.title);
                assert!(
                    begin.elapsed() < Duration::from_secs(120),
                    "{what}: {title:?}"
                );
            }
        }
        std::thread::sleep(Duration::from_millis(50));
    }
}
