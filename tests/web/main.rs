//! The page of `export --web` in Chromium on a display in memory: its picture beside `render`'s,
//! and real mouse events.
#![cfg(all(target_os = "linux", feature = "window"))]

mod browser;
#[path = "../view/display.rs"]
mod display;
#[allow(dead_code)] // used by the tests of the window as well
#[path = "../view/harness.rs"]
mod harness;
mod loaders;
mod server;

use std::path::Path;
use std::sync::{Arc, Mutex, Weak};

use image::RgbImage;
use mesolux::render::ldr;
use tempfile::TempDir;

use browser::{Browser, SIZE, wait};
use display::Display;
use harness::{device, difference, mesolux, picture, told};
use server::Server;

/// Linear values of a picture's codes.
fn linear(image: &RgbImage) -> Vec<[f32; 3]> {
    let linear = |code: u8| {
        let c = f32::from(code) / 255.0;
        match c <= 0.040_45 {
            true => c / 12.92,
            false => ((c + 0.055) / 1.055).powf(2.4),
        }
    };
    image.pixels().map(|p| p.0.map(linear)).collect()
}

/// LDR-FLIP in the mean.
fn apart(one: &RgbImage, other: &RgbImage) -> f32 {
    let errors = ldr(&linear(one), &linear(other), one.width());
    errors.iter().sum::<f32>() / errors.len() as f32
}

/// Runs the program, which must succeed.
fn run(folder: &Path, args: &[&str]) {
    let mut command = mesolux(folder, args);
    let output = command.args(device()).output().expect("the program runs");
    assert!(output.status.success(), "{}", told(&output));
}

/// A folder with a bake of the Cornell box, `box.safetensors`, and all that is exported of it; the
/// tests of one run share it.
fn exported_box() -> Arc<TempDir> {
    static FOLDER: Mutex<Weak<TempDir>> = Mutex::new(Weak::new());
    let mut shared = FOLDER.lock().unwrap_or_else(|e| e.into_inner());
    if let Some(folder) = shared.upgrade() {
        return folder;
    }
    let folder = tempfile::tempdir().expect("a folder for the test");
    let bake = ["bake", "cornell-box", "-o", "box.safetensors", "--no-cache"];
    run(folder.path(), &bake);
    run(
        folder.path(),
        &[
            "export",
            "box.safetensors",
            "--page",
            "512",
            "--exposure",
            "1",
            "--web",
            "page",
            "--glb",
            "mapped.glb",
            "--unlit-glb",
            "unlit.glb",
            "--vertex-glb",
            "vertices.glb",
        ],
    );
    let folder = Arc::new(folder);
    *shared = Arc::downgrade(&folder);
    folder
}

#[test]
fn the_page_shows_the_light_and_is_moved_by_the_mouse() {
    let folder = exported_box();
    let display = Display::new();
    let server = Server::start(&folder.path().join("page"));
    let _browser = Browser::open(&display, &folder.path().join("profile"), &server.address);
    let first = wait(&server, "the first picture", |s| {
        s.title == "cornell-box: global, 1.00"
    });
    let (width, height) = first.picture.dimensions();
    let size = format!("{width}x{height}");
    let view = ["-o", "box.png", "--exposure", "1", "--size", &size];
    run(
        folder.path(),
        &[&["render", "box.safetensors"], &view[..]].concat(),
    );
    let expected = picture(folder.path(), "box.png");
    let error = apart(&first.picture, &expected);
    println!("FLIP {error:.4} beside `render`");
    assert!(error <= FLIP);

    let (x, y) = (SIZE.0 / 2, 2 * SIZE.1 / 3);
    let to = |x: u32, y: u32| display.xdotool(&["mousemove", &x.to_string(), &y.to_string()]);
    to(x, y);
    display.xdotool(&["mousedown", "1"]);
    to(x + 60, y + 10);
    to(x + 120, y + 20);
    display.xdotool(&["mouseup", "1"]);
    let orbited = wait(&server, "an orbit", |s| {
        difference(&s.picture, &first.picture) > 4.0
    });
    display.xdotool(&["click", "--repeat", "4", "4"]);
    wait(&server, "a zoom", |s| {
        difference(&s.picture, &orbited.picture) > 2.0
    });
    display.xdotool(&["click", "--repeat", "2", "--delay", "80", "1"]);
    wait(&server, "back", |s| {
        difference(&s.picture, &first.picture) < 0.01
    });
    let [left, top] = first.indirect;
    to(left, top);
    display.xdotool(&["click", "1"]);
    let indirect = wait(&server, "indirect light", |s| s.title.contains("indirect"));
    let part = |image: &RgbImage| harness::mean(image).iter().sum::<f64>();
    assert!(part(&indirect.picture) < 0.8 * part(&first.picture));
}

/// Mean difference of the two pictures. Measured: 0.0143.
const FLIP: f32 = 0.03;
