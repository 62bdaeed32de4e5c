//! Without a screen, and on one that others use.

use super::QUIET;
use super::display::Display;
use super::harness::*;

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

#[test]
fn is_taken_off_the_screen_and_put_back() {
    let room = Room::baked("room");
    let display = Display::new();
    let script =
        format!("{QUIET}frames 1\nscreenshot open.png\nwait 4\nframes 2\nscreenshot again.png");
    let child = start(&display, SIZE, room.path(), "room.safetensors", &script);
    wait_for(&room.path().join("open.png"));
    let window = display.xdotool(&["search", "--name", "Mesolux"]);
    let viewable = |of: &str| display.xdotool(&["search", "--onlyvisible", "--name", of]);
    display.xdotool(&["windowunmap", "--sync", &window, "sleep", "0.5"]);
    display.xdotool(&["windowmap", "--sync", &window]);
    assert_eq!(viewable("Mesolux"), window);
    finish(child, &script);
    assert!(room.picture("again.png") == room.picture("open.png"));
}

/// What real keys and a real mouse do is what the same steps of a script do.
#[test]
fn obeys_real_keys_and_mouse() {
    let room = Room::baked("room");
    let script = format!(
        "{QUIET}frames 1\nmove 200 120\npress middle\nmove 240 140\nrelease middle\nkey 2\n\
         frames 2\nscreenshot script.png"
    );
    view(room.path(), "room.safetensors", &script);
    let display = Display::new();
    // Long enough for a busy machine to press a few keys.
    let script = format!("{QUIET}frames 1\nscreenshot open.png\nwait 6\nscreenshot real.png");
    let child = start(&display, SIZE, room.path(), "room.safetensors", &script);
    wait_for(&room.path().join("open.png"));
    let xdotool = |args: &[&str]| display.xdotool(args);
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
