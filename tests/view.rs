//! The window under a display in memory: what a script or real keys and mouse do shows on the screen, nothing is left behind, and
//! the validation layer stays silent.
#![cfg(all(target_os = "linux", feature = "window"))]

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use image::RgbImage;

/// Pixels of the tests' windows.
const SIZE: &str = "320x240";

/// A display in memory, gone with the test.
struct Display {
    server: Child,
    name: String,
}

impl Display {
    fn new() -> Self {
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1024x768x24"])
            .args(["-nolisten", "tcp"])
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
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

fn mesolux(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mesolux"));
    command
        .args(args)
        .current_dir(folder)
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .env("NO_COLOR", "1")
        .env(
            "XDG_CACHE_HOME",
            concat!(env!("CARGO_TARGET_TMPDIR"), "/cache"),
        );
    command
}

/// The device of all tests.
fn device() -> Vec<String> {
    let named = std::env::var("MESOLUX_TEST_DEVICE").ok();
    let named = named.into_iter().flat_map(|name| ["--device".into(), name]);
    named.collect()
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Shows `input` on a display of its own, driven by a script, under the validation layer; returns what the program told.
fn view(folder: &Path, input: &str, script: &str) -> String {
    let display = Display::new();
    finish(start(&display, folder, input, script), script)
}

/// Longest run of a test's window: two cores may have much else to do.
const PATIENCE: Duration = Duration::from_secs(300);

/// Waits until the window has closed, well and with nothing left behind.
fn finish(mut child: Child, script: &str) -> String {
    let begin = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        if begin.elapsed() > PATIENCE {
            let _ = child.kill();
            let output = child.wait_with_output().expect("a child");
            panic!("still open: {script}: {}", told(&output));
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let output = child.wait_with_output().expect("a child");
    let text = told(&output);
    assert!(output.status.success(), "{script}: {text}");
    assert!(text.contains("nothing is left"), "{text}");
    assert!(!text.contains("validation"), "{text}");
    text
}

fn start(display: &Display, folder: &Path, input: &str, script: &str) -> Child {
    std::fs::write(folder.join("script"), script).expect("written");
    let args = ["view", input, "--script", "script", "--size", SIZE];
    mesolux(folder, &args)
        .args(["--validate", "--quality", "draft"])
        .args(device())
        .env("DISPLAY", &display.name)
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs")
}

fn picture(folder: &Path, name: &str) -> RgbImage {
    let path = folder.join(name);
    image::open(&path)
        .unwrap_or_else(|e| panic!("{}: {e}", path.display()))
        .into_rgb8()
}

/// Mean difference of two pictures' codes.
fn difference(a: &RgbImage, b: &RgbImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let sum: u64 = (a.iter().zip(b.iter()))
        .map(|(a, b)| u64::from(a.abs_diff(*b)))
        .sum();
    sum as f64 / a.len() as f64
}

/// Mean of the three colours.
fn mean(picture: &RgbImage) -> [f64; 3] {
    let count = f64::from(picture.width() * picture.height());
    [0, 1, 2].map(|c| picture.pixels().map(|p| f64::from(p[c])).sum::<f64>() / count)
}

/// A room of 2 × 2 × 2 with a red and a green wall, a lamp in its ceiling and a point light, seen through the side that it
/// lacks; and its bake with what --relight needs.
struct Room {
    folder: tempfile::TempDir,
}

impl Room {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let mut obj = String::from("mtllib room.mtl\n");
        let mut vertices = 0;
        // Each wall by a corner and its two sides, cut in SIDE × SIDE squares.
        const SIDE: usize = 8;
        let mut wall = |material: &str, corner: [f64; 3], u: [f64; 3], v: [f64; 3], side: usize| {
            for row in 0..=side {
                for column in 0..=side {
                    let at = |axis: usize| {
                        corner[axis]
                            + (u[axis] * column as f64 + v[axis] * row as f64) / side as f64
                    };
                    obj += &format!("v {} {} {}\n", at(0), at(1), at(2));
                }
            }
            obj += &format!("usemtl {material}\n");
            for row in 0..side {
                for column in 0..side {
                    let a = vertices + row * (side + 1) + column + 1;
                    let b = a + side + 1;
                    obj += &format!("f {a} {} {} {b}\n", a + 1, b + 1);
                }
            }
            vertices += (side + 1) * (side + 1);
        };
        let (x, y, z) = ([2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]);
        wall("white", [-1.0, -1.0, 1.0], x, [0.0, 0.0, -2.0], SIDE);
        wall("white", [-1.0, 1.0, -1.0], x, z, SIDE);
        wall("white", [-1.0, -1.0, -1.0], x, y, SIDE);
        wall("red", [-1.0, -1.0, 1.0], [0.0, 0.0, -2.0], y, SIDE);
        wall("green", [1.0, -1.0, -1.0], z, y, SIDE);
        let lamp = ([-0.3, 0.98, -0.3], [0.6, 0.0, 0.0], [0.0, 0.0, 0.6]);
        wall("lamp", lamp.0, lamp.1, lamp.2, 2);
        let materials = "newmtl white\nKd 0.7 0.7 0.7\nnewmtl red\nKd 0.7 0.1 0.1\nnewmtl green\nKd 0.1 0.6 0.1\n\
             newmtl lamp\nKd 0 0 0\nKe 8 8 8\n";
        let toml = "[[mesh]]\nfile = \"room.obj\"\n\
             [[point_light]]\nname = \"bulb\"\nposition = [0.5, 0.0, 0.0]\nintensity = [0.2, 0.2, 0.2]\n\
             [[camera]]\nname = \"front\"\nposition = [0.0, 0.0, 3.6]\nlook_at = [0.0, 0.0, 0.0]\nfov = 42.0\n";
        for (name, text) in [
            ("room.obj", &obj[..]),
            ("room.mtl", materials),
            ("room.toml", toml),
        ] {
            std::fs::write(folder.path().join(name), text).expect("written");
        }
        Self { folder }
    }

    fn baked() -> Self {
        let room = Self::new();
        let output = mesolux(
            room.path(),
            &["bake", "room.toml", "-o", "room.safetensors"],
        )
        .args(["--keep-visibility", "--quality", "draft"])
        .args(device())
        .output()
        .expect("the program runs");
        assert!(output.status.success(), "{}", told(&output));
        room
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    fn picture(&self, name: &str) -> RgbImage {
        picture(self.path(), name)
    }
}

/// Frame times would tell two pictures of one view apart; detailed pictures come when they come.
const QUIET: &str = "set panel off\nset detail off\n";

#[test]
fn opens_orbits_and_flies() {
    let room = Room::baked();
    let script = format!(
        "{QUIET}frames 2\nscreenshot front.png
         move 200 120\npress middle\nmove 240 140\nrelease middle\nframes 1\nscreenshot orbit.png
         move 200 120\npress middle\nmove 160 100\nrelease middle\nframes 1\nscreenshot back.png
         wheel 3\nscreenshot near.png\nkey C\nscreenshot camera.png
         key W down\nwait 0.3\nkey W up\nscreenshot fly.png
         key Home\nsee right\nscreenshot right.png"
    );
    let text = view(room.path(), "room.safetensors", &script);
    assert!(text.contains("first picture with light after"), "{text}");
    assert!(text.contains("input answered in"), "{text}");
    let front = room.picture("front.png");
    assert_eq!(front.dimensions(), (320, 240));
    // The left wall is red and the right one green; the window is neither dark nor burnt.
    let at = |x: u32, y: u32| front.get_pixel(x, y).0;
    let ([left_r, left_g, _], [right_r, right_g, _]) = (at(60, 120), at(260, 120));
    assert!(
        left_r > 2 * left_g && right_g > right_r,
        "{:?}, {:?}",
        at(60, 120),
        at(260, 120)
    );
    let [r, g, b] = mean(&front);
    assert!((40.0..200.0).contains(&((r + g + b) / 3.0)), "{r} {g} {b}");
    for other in ["orbit.png", "near.png", "fly.png", "right.png"] {
        let found = difference(&front, &room.picture(other));
        assert!(found > 3.0, "{other} differs by {found}");
    }
    // There and back is where it was, up to the rounding of two turns.
    for same in ["back.png", "camera.png"] {
        let found = difference(&front, &room.picture(same));
        assert!(found < 0.5, "{same} differs by {found}");
    }
}

/// Mean difference of codes between a picture drawn in tiles of 96 pixels and in one: corners are rounded in the frame of their
/// tile, so that of the samples along edges a few fall on the other side. Edges are on some 5 % of the pixels, and one sample of
/// sixteen moves a pixel by less than 10 codes; of them one in 25 or fewer.
const EDGES: f64 = 0.02;

/// Once the view stays, the window shows what `render` draws; and without details nearly so.
#[test]
fn the_detailed_picture_is_that_of_render() {
    let room = Room::baked();
    let script = "set panel off\nframes 1\ndetail\nscreenshot detail.png\nsave saved.png
        set detail off\nset direct slots\nscreenshot plain.png
        set detail on\ndetail\nscreenshot slots.png";
    view(room.path(), "room.safetensors", script);
    let (detail, saved) = (room.picture("detail.png"), room.picture("saved.png"));
    let found = difference(&detail, &saved);
    assert!(found < EDGES, "differ by {found}");
    // One sample a pixel against sixteen: edges differ, walls by rounding.
    let (plain, slots) = (room.picture("plain.png"), room.picture("slots.png"));
    let found = difference(&plain, &slots);
    assert!(found < 2.0, "the corners' light differs by {found}");
    assert!(detail != slots, "light points are sharper than elements");
}

#[test]
fn follows_the_size_and_survives_a_lost_surface() {
    let room = Room::baked();
    let script = format!(
        "{QUIET}frames 1\nscreenshot before.png\nresize 400 200\nframes 1\nscreenshot wide.png
         minimise\nwait 0.2\nrestore 400 200\nframes 1\nscreenshot restored.png
         lose-surface\nframes 1\nscreenshot found.png
         resize 320 240\nframes 1\nscreenshot after.png"
    );
    view(room.path(), "room.safetensors", &script);
    let wide = room.picture("wide.png");
    assert_eq!(wide.dimensions(), (400, 200));
    for name in ["restored.png", "found.png"] {
        assert!(room.picture(name) == wide, "{name} shows the same");
    }
    assert!(room.picture("before.png") == room.picture("after.png"));
}

#[test]
fn switches_show_parts_of_the_light_and_overlays() {
    let room = Room::baked();
    let script = format!(
        "{QUIET}frames 1\nscreenshot all.png\nkey 2\nscreenshot direct.png\nkey 3\nscreenshot indirect.png
         key 1\nkey O\nscreenshot elements.png\nkey O\nscreenshot again.png\nkey Tab\nframes 2\nscreenshot panel.png
         set exposure 1\nset panel off\nscreenshot bright.png"
    );
    view(room.path(), "room.safetensors", &script);
    let all = room.picture("all.png");
    let sum = |name: &str| mean(&room.picture(name)).iter().sum::<f64>();
    let whole = sum("all.png");
    assert!(sum("direct.png") < whole && sum("indirect.png") < whole);
    assert!(sum("bright.png") > 1.1 * whole);
    for (name, least) in [("elements.png", 1.0), ("panel.png", 10.0)] {
        let found = difference(&all, &room.picture(name));
        assert!(found > least, "{name} differs by {found}");
    }
    assert!(room.picture("again.png") == all);
}

/// By what was kept with the bake; back to the first light, the picture is the first one.
#[test]
fn relights_what_was_baked() {
    let room = Room::baked();
    let script = format!(
        "{QUIET}set ambient off\nframes 1\nscreenshot before.png
         set lamp lamp colour 1 0.1 0.1\nrelit\nbake\nscreenshot red.png
         set lamp lamp colour 1 1 1\nrelit\nbake\nscreenshot after.png
         set lamp bulb position -0.5 -0.5 0\nrelit\nbake\nscreenshot moved.png"
    );
    let text = view(room.path(), "room.safetensors", &script);
    assert_eq!(
        text.matches("lights changed on the screen after").count(),
        3,
        "{text}"
    );
    let [r, g, _] = mean(&room.picture("red.png"));
    let [r0, g0, _] = mean(&room.picture("before.png"));
    assert!(r / g > 1.5 * r0 / g0, "{r} {g} for {r0} {g0}");
    let found = difference(&room.picture("before.png"), &room.picture("after.png"));
    // Draft bakes leave 5 % of the light, in an order that depends on what was kept.
    assert!(found < 3.0, "the same light differs by {found}");
    let found = difference(&room.picture("after.png"), &room.picture("moved.png"));
    assert!(found > 1.0, "a moved light changes {found}");
}

/// A scene refines while it is shown, and with the estimate of the light that is not shot it has its brightness from the start.
#[test]
fn a_scene_refines_while_it_bakes() {
    let room = Room::new();
    let script = format!("{QUIET}frames 1\nbake\nframes 30\nscreenshot baked.png");
    let text = view(room.path(), "room.toml", &script);
    assert!(text.contains("frame while baking:"), "{text}");
    assert!(
        text.contains("frame while baking over frame without"),
        "{text}"
    );
    let [r, g, b] = mean(&room.picture("baked.png"));
    assert!((40.0..200.0).contains(&((r + g + b) / 3.0)), "{r} {g} {b}");
}

#[test]
fn closes_during_a_bake() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let begin = Instant::now();
    // Long before the bake is done, and again while its solver is set up.
    for script in ["wait 2\nframes 2\nclose\n", "close\n"] {
        let text = view(folder.path(), "cornell", script);
        assert!(
            !text.contains("frame without"),
            "the bake is under way: {text}"
        );
    }
    assert!(begin.elapsed() < Duration::from_secs(60));
}

#[test]
fn without_a_display_one_line_names_render() {
    let room = Room::new();
    for display in [None, Some(":987")] {
        let mut command = mesolux(room.path(), &["view", "room.toml", "--frames", "1"]);
        if let Some(display) = display {
            command.env("DISPLAY", display);
        }
        let output = command.output().expect("the program runs");
        let text = told(&output);
        assert_eq!(output.status.code(), Some(2), "{text}");
        let lines: Vec<_> = text
            .lines()
            .filter(|l| l.starts_with("mesolux: "))
            .collect();
        assert_eq!(lines.len(), 1, "{text}");
        assert!(lines[0].contains("mesolux render"), "{}", lines[0]);
        assert!(!text.contains("panicked"), "{text}");
    }
}

/// Where no driver is, the loader offers no surface either.
#[test]
fn without_a_vulkan_surface_one_line_names_render() {
    let room = Room::new();
    let display = Display::new();
    let output = mesolux(room.path(), &["view", "room.toml", "--frames", "1"])
        .env("DISPLAY", &display.name)
        .env("VK_DRIVER_FILES", "/nowhere.json")
        .env("VK_ICD_FILENAMES", "/nowhere.json")
        .output()
        .expect("the program runs");
    let text = told(&output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    let last = text.lines().last().unwrap_or_default();
    assert!(
        last.contains("no surface") && last.contains("mesolux render"),
        "{text}"
    );
}

#[test]
fn without_a_device_one_line_says_so() {
    let room = Room::new();
    let display = Display::new();
    let output = mesolux(
        room.path(),
        &["view", "room.toml", "--frames", "1", "--device", "nosuch"],
    )
    .env("DISPLAY", &display.name)
    .output()
    .expect("the program runs");
    let text = told(&output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("no device \"nosuch\""), "{text}");
}

/// What real keys and a real mouse do is what the same steps of a script do.
#[test]
fn obeys_real_keys_and_mouse() {
    let room = Room::baked();
    let script = format!(
        "{QUIET}frames 1\nmove 200 120\npress middle\nmove 240 140\nrelease middle\nkey 2\nframes 2\nscreenshot script.png"
    );
    view(room.path(), "room.safetensors", &script);
    let display = Display::new();
    // Long enough for a busy machine to press a few keys.
    let script = format!("{QUIET}frames 1\nscreenshot open.png\nwait 6\nscreenshot real.png");
    let child = start(&display, room.path(), "room.safetensors", &script);
    wait_for(&room.path().join("open.png"));
    let xdotool = |args: &[&str]| {
        let done = Command::new("xdotool")
            .args(args)
            .env("DISPLAY", &display.name)
            .output()
            .expect("the tests need xdotool");
        assert!(done.status.success(), "xdotool {args:?}: {}", told(&done));
        String::from_utf8_lossy(&done.stdout).trim().to_owned()
    };
    let window = xdotool(&["search", "--name", "Mesolux"]);
    xdotool(&["windowfocus", &window]);
    xdotool(&[
        "mousemove",
        "--window",
        &window,
        "200",
        "120",
        "sleep",
        "0.2",
    ]);
    xdotool(&["mousedown", "2", "sleep", "0.1"]);
    xdotool(&[
        "mousemove",
        "--window",
        &window,
        "240",
        "140",
        "sleep",
        "0.2",
    ]);
    xdotool(&["mouseup", "2", "sleep", "0.1", "key", "2"]);
    finish(child, &script);
    let (real, scripted) = (room.picture("real.png"), room.picture("script.png"));
    let found = difference(&real, &scripted);
    assert!(real == scripted, "differ by {found}");
    assert!(real != room.picture("open.png"));
}

fn wait_for(path: &Path) {
    let begin = Instant::now();
    while !path.exists() {
        assert!(
            begin.elapsed() < Duration::from_secs(60),
            "{}",
            path.display()
        );
        std::thread::sleep(Duration::from_millis(20));
    }
}
