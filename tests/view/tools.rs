//! Tools of the window: exposure, undo, lights dragged by their marks, comparisons, saved bakes,
//! dialogs, scenes whose files change.

use super::QUIET;
use super::display::Display;
use super::harness::*;
use super::part;

fn brightness(room: &Room, name: &str) -> f64 {
    mean(&room.picture(name)).iter().sum::<f64>() / 3.0
}

/// A lamp that is made brighter is brighter on the screen; M exposes by the new light.
#[test]
fn the_exposure_stays_while_lights_are_changed() {
    let room = Room::baked("room");
    let script = format!(
        "{QUIET}frames 1\nscreenshot before.png\nset lamp lamp strength 16\nrelit\nbake\nframes 1
         screenshot bright.png\nkey M\nframes 1\nscreenshot metered.png"
    );
    view(room.path(), "room.safetensors", &script);
    let [before, bright, metered] =
        ["before.png", "bright.png", "metered.png"].map(|name| brightness(&room, name));
    println!("codes {before:.1} before, {bright:.1} twice as bright, {metered:.1} metered");
    assert!(bright > before + 15.0 && metered < bright - 10.0);
}

/// Changes of lights are undone one by one, and done again.
#[test]
fn changes_of_lights_are_undone_and_done_again() {
    let room = Room::baked("room");
    // Apart enough to be two changes.
    let script = format!(
        "{QUIET}set ambient off\nframes 1\nset lamp lamp colour 1 0.1 0.1\nrelit\nbake\nscreenshot red.png\nwait 1
         set lamp lamp colour 0.1 0.1 1\nrelit\nbake\nscreenshot blue.png
         key Ctrl+Z\nrelit\nbake\nscreenshot undone.png\nkey Ctrl+Z\nrelit\nbake\nscreenshot first.png
         key Ctrl+Shift+Z\nrelit\nbake\nscreenshot redone.png"
    );
    view(room.path(), "room.safetensors", &script);
    let apart = |a: &str, b: &str| difference(&room.picture(a), &room.picture(b));
    for (same, other) in [("undone.png", "blue.png"), ("redone.png", "first.png")] {
        let (near, far) = (apart("red.png", same), apart("red.png", other));
        println!("{same} differs by {near:.2}, {other} by {far:.2}");
        assert!(near < 1.0 && far > 10.0);
    }
}

/// The mark of a light is dragged with the left button, along an axis if that is asked for.
#[test]
fn a_light_is_dragged_by_its_mark() {
    let room = Room::baked("room");
    // The bulb at (0.5, 0, 0) is seen at x = 320 + 0.5 / half · 240, half of the picture's height
    // in its plane being 3.6 tan 21°.
    let half = 3.6 * 21.0_f64.to_radians().tan();
    let at = 320.0 + 0.5 / half * 240.0;
    let moved = 0.5 - 80.0 / 240.0 * half;
    let script = format!(
        "set detail off\nset notes off\nframes 3\nmove {at} 240\nframes 2\npress left\nmove {} 270\nkey X
         frames 2\nrelease left\nset panel off\nrelit\nbake\nframes 1\nscreenshot dragged.png
         set lamp bulb position {moved} 0 0\nrelit\nbake\nframes 1\nscreenshot set.png
         set lamp bulb position 0.5 0 0\nrelit\nbake\nframes 1\nscreenshot before.png",
        at - 80.0
    );
    view_in("640x480", room.path(), "room.safetensors", &script);
    let dragged = room.picture("dragged.png");
    let found = difference(&dragged, &room.picture("set.png"));
    assert!(found < 0.1, "dragged and set differ by {found}");
    assert!(difference(&dragged, &room.picture("before.png")) > 1.0);
}

/// The direct light of a light that is moved, which is sketched, is what is solved after it.
#[test]
fn a_moved_light_is_sketched() {
    let room = Room::baked("room");
    let script = format!(
        "{QUIET}key 2\nframes 1\nscreenshot before.png\nset lamp bulb position -0.5 0.3 0.2\ndirect
         screenshot sketched.png\nrelit\nbake\nframes 1\nscreenshot solved.png"
    );
    view(room.path(), "room.safetensors", &script);
    let [before, sketched, solved] =
        ["before.png", "sketched.png", "solved.png"].map(|name| room.picture(name));
    let [off, moved] = [&sketched, &before].map(|other| difference(other, &solved));
    println!("codes differ by {off:.3} from what is solved, by {moved:.1} before");
    assert!(moved > 5.0 && off < 0.3, "{off} and {moved}");
}

/// So is that of the lamp in the ceiling, a surface, which takes its shape with it; back in its
/// place it brings the light of before.
#[test]
fn a_moved_emitter_is_sketched() {
    let room = Room::baked("room");
    let script = format!(
        "{QUIET}key 2\nframes 1\nscreenshot before.png\nset lamp lamp position -0.5 0.98 0.4\ndirect
         frames 1\nscreenshot sketched.png\nrelit\nbake\nframes 1\nscreenshot solved.png
         set lamp lamp position 0 0.98 0\nrelit\nbake\nframes 1\nscreenshot back.png"
    );
    view(room.path(), "room.safetensors", &script);
    let [before, sketched, solved, back] =
        ["before.png", "sketched.png", "solved.png", "back.png"].map(|name| room.picture(name));
    let [off, moved] = [&sketched, &before].map(|other| difference(other, &solved));
    let same = difference(&back, &before);
    println!("codes differ by {off:.3} from what is solved, by {moved:.1} before, {same:.3} back");
    assert!(
        moved > 5.0 && off < 0.85 && same < 0.05,
        "{off}, {moved} and {same}"
    );
}

/// On the left of the line what was held stays, on its right what is changed shows.
#[test]
fn the_view_is_compared_to_itself() {
    let room = Room::baked("relief");
    let script = format!(
        "{QUIET}set detail on\nframes 1\ndetail\nscreenshot all.png\nkey V\nline 160\nkey 2\ndetail\ncompared
         frames 1\nscreenshot both.png\nkey V\ndetail\nframes 1\nscreenshot direct.png"
    );
    view(room.path(), "relief.safetensors", &script);
    let [all, both, direct] = ["all.png", "both.png", "direct.png"].map(|name| room.picture(name));
    // Beside the line and below the names.
    let [left, right] = [[0, 40, 150, 200], [170, 40, 150, 200]];
    for (place, whole, other) in [(left, &all, &direct), (right, &direct, &all)] {
        let both = part(&both, place);
        assert!(
            both == part(whole, place),
            "{place:?} is that of its own side"
        );
        assert!(difference(&both, &part(other, place)) > 3.0);
    }
}

/// The path tracer draws nearly the same picture.
#[test]
fn the_view_is_compared_to_the_path_tracer() {
    let room = Room::baked("relief");
    let script = format!(
        "{QUIET}set detail on\nframes 1\ndetail\nscreenshot ours.png\ncompare traced\nline 310\ncompared\nwait 6
         frames 1\nscreenshot traced.png\ncompare off\nframes 1\nscreenshot after.png"
    );
    view(room.path(), "relief.safetensors", &script);
    let place = [0, 40, 300, 200];
    let [ours, traced, after] =
        ["ours.png", "traced.png", "after.png"].map(|name| part(&room.picture(name), place));
    let found = difference(&ours, &traced);
    println!("codes differ by {found:.2} from the path tracer");
    assert!(ours != traced && found < 8.0, "{found}");
    assert!(ours == after);
}

/// A bake that is saved in the window is one that other commands take, with the same light.
#[test]
fn a_bake_is_saved() {
    let room = Room::new();
    let script = format!(
        "{QUIET}set ambient off\nframes 1\nbake\nframes 1\nscreenshot here.png\nsave-bake saved.safetensors"
    );
    view(room.path(), "room.toml", &script);
    let script = format!("{QUIET}frames 2\nscreenshot there.png");
    view(room.path(), "saved.safetensors", &script);
    let found = difference(&room.picture("here.png"), &room.picture("there.png"));
    println!("codes of the saved bake differ by {found:.3}");
    // While it bakes, the estimate of what is not shot counts for the exposure: measured 0.27.
    assert!(found < 0.6, "the same light differs by {found}");
    // With its lights changed it would not be that of its scene.
    let script = format!(
        "{QUIET}frames 1\nbake\nset lamp bulb strength 1\nrelit\nbake\nsave-bake other.safetensors"
    );
    view(room.path(), "room.toml", &script);
    assert!(!room.path().join("other.safetensors").exists());
}

/// A scene whose file is written again is read again, and seen from where it was.
#[test]
fn a_scene_that_changes_is_read_again() {
    let room = Room::new();
    let display = Display::new();
    let script = format!(
        "{QUIET}frames 1\nbake\nkey Home\nframes 1\nscreenshot before.png\nwait 8\nbake\nframes 1\nscreenshot after.png"
    );
    let child = start(&display, SIZE, room.path(), "room.toml", &script);
    wait_for(&room.path().join("before.png"));
    let materials = room.path().join("room.mtl");
    let text = std::fs::read_to_string(&materials).expect("it was written");
    let blue = text.replace("Kd 0.7 0.1 0.1", "Kd 0.1 0.1 0.7");
    assert_ne!(text, blue);
    std::fs::write(&materials, blue).expect("written");
    finish(child, &script);
    // The left wall.
    let wall = [100, 80, 10, 80];
    let [before, after] =
        ["before.png", "after.png"].map(|name| mean(&part(&room.picture(name), wall)));
    println!("the wall was {before:.0?}, and is {after:.0?}");
    assert!(before[0] > before[2] + 20.0 && after[2] > after[0] + 20.0);
}

/// Real keys open the dialog, a real mouse picks a file and opens it.
#[test]
fn a_scene_is_opened_by_the_dialog() {
    let room = Room::baked("room");
    let display = Display::new();
    let script = format!(
        "{QUIET}frames 1\nscreenshot open.png\nwait 10\nbake\nframes 1\nscreenshot last.png"
    );
    let child = start(
        &display,
        "640x480",
        room.path(),
        "room.safetensors",
        &script,
    );
    wait_for(&room.path().join("open.png"));
    let xdotool = |args: &[&str]| display.xdotool(args);
    let window = xdotool(&["search", "--name", "Mesolux"]);
    xdotool(&["windowfocus", &window]);
    xdotool(&["key", "ctrl+o", "sleep", "1.5"]);
    let at = |x: &str, y: &str| {
        xdotool(&["mousemove", "--window", &window, x, y, "sleep", "0.4"]);
        xdotool(&[
            "click", "--repeat", "2", "--delay", "120", "1", "sleep", "0.3",
        ]);
    };
    let [x, y] = PICKED;
    at(x, y);
    finish(child, &script);
    // The same room, whose back wall has bumps there.
    let wall = [210, 130, 220, 220];
    let [open, last] = ["open.png", "last.png"].map(|name| part(&room.picture(name), wall));
    let found = difference(&open, &last);
    println!("the wall differs by {found:.2}");
    assert!(found > 3.0);
}

/// Where the dialog lists relief.toml.
const PICKED: [&str; 2] = ["240", "131"];
