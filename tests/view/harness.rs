//! A room to show on a display, and the program that shows it, driven by a script.

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use image::RgbImage;

use crate::display::Display;

/// Pixels of the tests' windows.
pub const SIZE: &str = "320x240";

/// How the room is lit: with the elements of its squares, so that outlines are seen.
const DRAFT: [&str; 5] = ["--quality", "draft", "--directions", "16", "--no-refine"];

pub fn mesolux(folder: &Path, args: &[&str]) -> Command {
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
pub fn device() -> Vec<String> {
    let named = std::env::var("MESOLUX_TEST_DEVICE").ok();
    let named = named.into_iter().flat_map(|name| ["--device".into(), name]);
    named.collect()
}

pub fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Shows `input` on a display of its own, driven by a script, under the validation layer; returns
/// what the program told.
pub fn view(folder: &Path, input: &str, script: &str) -> String {
    view_in(SIZE, folder, input, script)
}

pub fn view_in(size: &str, folder: &Path, input: &str, script: &str) -> String {
    let display = Display::new();
    finish(start(&display, size, folder, input, script), script)
}

/// What each thread of a process waits for in the kernel, and its time on a core.
pub fn where_it_waits(process: u32) -> String {
    let threads = std::fs::read_dir(format!("/proc/{process}/task")).into_iter();
    let lines = threads.flatten().flatten().map(|thread| {
        let told =
            |what: &str| std::fs::read_to_string(thread.path().join(what)).unwrap_or_default();
        let stat = told("stat");
        let ticks: Vec<_> = stat
            .rsplit(')')
            .next()
            .unwrap_or_default()
            .split(' ')
            .collect();
        let ticks = ticks.get(12..14).unwrap_or_default().join(" + ");
        format!("{}: {}, {ticks} ticks", told("comm").trim(), told("wchan"))
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// Longest run of a test's window: two cores may have much else to do.
pub const PATIENCE: Duration = Duration::from_secs(300);

/// Waits until the window has closed, well and with nothing left behind.
pub fn finish(mut child: Child, script: &str) -> String {
    let begin = Instant::now();
    while child.try_wait().expect("a child").is_none() {
        if begin.elapsed() > PATIENCE {
            let waits = where_it_waits(child.id());
            let _ = child.kill();
            let output = child.wait_with_output().expect("a child");
            println!("{waits}");
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

pub fn start(display: &Display, size: &str, folder: &Path, input: &str, script: &str) -> Child {
    std::fs::write(folder.join("script"), script).expect("written");
    let args = ["view", input, "--script", "script", "--size", size];
    mesolux(folder, &args)
        .args(["--validate"])
        .args(DRAFT)
        .args(device())
        .env("DISPLAY", &display.name)
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs")
}

pub fn picture(folder: &Path, name: &str) -> RgbImage {
    let path = folder.join(name);
    image::open(&path)
        .unwrap_or_else(|e| panic!("{}: {e}", path.display()))
        .into_rgb8()
}

/// Mean difference of two pictures' codes.
pub fn difference(a: &RgbImage, b: &RgbImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let sum: u64 = (a.iter().zip(b.iter()))
        .map(|(a, b)| u64::from(a.abs_diff(*b)))
        .sum();
    sum as f64 / a.len() as f64
}

/// Mean LDR-FLIP of two pictures.
pub fn flip(ours: &RgbImage, reference: &RgbImage) -> f64 {
    let linear = |picture: &RgbImage| -> Vec<[f32; 3]> {
        let pixels = picture.pixels();
        let of = |code: u8| match f32::from(code) / 255.0 {
            v if v <= 0.04045 => v / 12.92,
            v => ((v + 0.055) / 1.055).powf(2.4),
        };
        pixels.map(|p| p.0.map(of)).collect()
    };
    let found = mesolux::render::ldr(&linear(ours), &linear(reference), ours.width());
    found.iter().map(|&f| f64::from(f)).sum::<f64>() / found.len() as f64
}

/// Mean of the three colours.
pub fn mean(picture: &RgbImage) -> [f64; 3] {
    let count = f64::from(picture.width() * picture.height());
    [0, 1, 2].map(|c| picture.pixels().map(|p| f64::from(p[c])).sum::<f64>() / count)
}

/// A room of 2 × 2 × 2 with a red and a green wall, a lamp in its ceiling and a point light, seen
/// through the side that it lacks; and its bake with what --relight needs. As `relief.toml` its
/// back wall has a bump on each of its squares.
pub struct Room {
    folder: tempfile::TempDir,
}

impl Room {
    pub fn new() -> Self {
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
                    obj += &format!("v {} {} {}\nvt {column} {row}\n", at(0), at(1), at(2));
                }
            }
            obj += &format!("usemtl {material}\n");
            for row in 0..side {
                for column in 0..side {
                    let a = vertices + row * (side + 1) + column + 1;
                    let b = a + side + 1;
                    let corner = |i: usize| format!("{i}/{i}");
                    let corners = [a, a + 1, b + 1, b].map(corner).join(" ");
                    obj += &format!("f {corners}\n");
                }
            }
            vertices += (side + 1) * (side + 1);
        };
        let (x, y, z) = ([2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]);
        wall("white", [-1.0, -1.0, 1.0], x, [0.0, 0.0, -2.0], SIDE);
        wall("white", [-1.0, 1.0, -1.0], x, z, SIDE);
        wall("back", [-1.0, -1.0, -1.0], x, y, SIDE);
        wall("red", [-1.0, -1.0, 1.0], [0.0, 0.0, -2.0], y, SIDE);
        wall("green", [1.0, -1.0, -1.0], z, y, SIDE);
        let lamp = ([-0.3, 0.98, -0.3], [0.6, 0.0, 0.0], [0.0, 0.0, 0.6]);
        wall("lamp", lamp.0, lamp.1, lamp.2, 2);
        let materials = "newmtl white\nKd 0.7 0.7 0.7\nnewmtl back\nKd 0.7 0.7 0.7\nnewmtl red\nKd 0.7 0.1 0.1\nnewmtl green\nKd 0.1 0.6 0.1\n\
             newmtl lamp\nKd 0 0 0\nKe 8 8 8\n";
        let toml = "[[mesh]]\nfile = \"room.obj\"\n\
             [[point_light]]\nname = \"bulb\"\nposition = [0.5, 0.0, 0.0]\nintensity = [0.2, 0.2, 0.2]\n\
             [[camera]]\nname = \"front\"\nposition = [0.0, 0.0, 3.6]\nlook_at = [0.0, 0.0, 0.0]\nfov = 42.0\n";
        let relief = format!(
            "{toml}[[camera]]\nname = \"corner\"\nposition = [0.8, 0.7, 0.9]\nlook_at = [-0.3, -0.3, -1.0]\nfov = 60.0\n\
             [material.back]\nheight_map = \"bump.png\"\nheight_scale = 0.08\n"
        );
        let hill = |i: u32| 0.5 - 0.5 * (std::f64::consts::TAU * (f64::from(i) + 0.5) / 16.0).cos();
        let bump = image::GrayImage::from_fn(16, 16, |x, y| {
            image::Luma([(255.0 * hill(x) * hill(y)).round() as u8])
        });
        bump.save(folder.path().join("bump.png")).expect("written");
        for (name, text) in [
            ("relief.toml", &relief[..]),
            ("room.obj", &obj[..]),
            ("room.mtl", materials),
            ("room.toml", toml),
        ] {
            std::fs::write(folder.path().join(name), text).expect("written");
        }
        Self { folder }
    }

    /// With the bake of `scene` beside it.
    pub fn baked(scene: &str) -> Self {
        let room = Self::new();
        let (toml, bake) = (format!("{scene}.toml"), format!("{scene}.safetensors"));
        let output = mesolux(room.path(), &["bake", &toml, "-o", &bake])
            .arg("--keep-visibility")
            .args(DRAFT)
            .args(device())
            .output()
            .expect("the program runs");
        assert!(output.status.success(), "{}", told(&output));
        room
    }

    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    pub fn picture(&self, name: &str) -> RgbImage {
        picture(self.path(), name)
    }
}

/// Waits until there is a file.
pub fn wait_for(path: &Path) {
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
