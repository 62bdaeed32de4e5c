//! The window under a display in memory: what a script or real keys and mouse do shows on the
//! screen, nothing is left behind, and the validation layer stays silent.
#![cfg(all(target_os = "linux", feature = "window"))]

mod controls;
mod display;
mod driven;
mod drop;
mod harness;
mod keys;
mod screens;
mod threads;
mod tools;

use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use image::RgbImage;

use display::Display;
use harness::*;

/// Frame times would tell two pictures of one view apart; detailed pictures come when they come.
const QUIET: &str = "set panel off\nset notes off\nset detail off\n";

#[test]
fn opens_orbits_and_flies() {
    let room = Room::baked("room");
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
    assert!(text.contains("input answered: "), "{text}");
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

/// Two pictures of one view that were drawn in tiles of other sizes: corners are rounded in the
/// frame of their tile, so that a sample which lies on an edge falls on either side of it. From the
/// front, the four edges between the side walls, floor and ceiling run through the corners of
/// samples, along 75 pixels each; elsewhere edges pass between samples. One sample of sixteen
/// changes sides, which is at most the code of 1/16. All other pixels are the same.
const ON_EDGES: usize = 4 * 75;
const ONE_SAMPLE: u8 = 71;

#[track_caller]
fn assert_alike(a: &RgbImage, b: &RgbImage, name: &str) {
    let pixels = a.pixels().zip(b.pixels()).filter(|(a, b)| a != b);
    let differences: Vec<u8> = pixels
        .map(|(a, b)| (0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap_or(0))
        .collect();
    let most = differences.iter().copied().max().unwrap_or(0);
    println!(
        "{name}: {} pixels differ, by at most {most}",
        differences.len()
    );
    assert_eq!(a.dimensions(), b.dimensions());
    assert!(
        differences.len() <= ON_EDGES && most <= ONE_SAMPLE,
        "{name}: {} pixels differ, by up to {most}",
        differences.len()
    );
}

/// Once the view stays, the window shows what `render` draws; and without details nearly so.
#[test]
fn the_detailed_picture_is_that_of_render() {
    let room = Room::baked("room");
    let script =
        "set panel off\nset notes off\nframes 1\ndetail\nscreenshot detail.png\nsave saved.png
        set detail off\nset direct slots\nscreenshot plain.png
        set detail on\ndetail\nscreenshot slots.png";
    view(room.path(), "room.safetensors", script);
    let (detail, saved) = (room.picture("detail.png"), room.picture("saved.png"));
    assert_alike(&detail, &saved, "detail");
    // One sample a pixel against sixteen: edges differ, walls by rounding.
    let (plain, slots) = (room.picture("plain.png"), room.picture("slots.png"));
    let found = difference(&plain, &slots);
    assert!(found < 2.0, "the corners' light differs by {found}");
    assert!(detail != slots, "light points are sharper than elements");
}

/// Another scene takes the place of the first: by a script, and by the panel's menu, which offers
/// the scene that the window was opened with first.
#[test]
fn another_scene_is_opened() {
    let room = Room::new();
    let script =
        "set detail off\nset notes off\nframes 2\nbake\nset panel off\nscreenshot first.png
         open cornell-box\nbake\nscreenshot other.png
         set panel on\nframes 9\nmove 120 11\nframes 3\npress left\nrelease left\nframes 9
         move 60 36\nframes 3\npress left\nrelease left\nframes 3
         bake\nset panel off\nscreenshot again.png";
    let text = view_in("640x480", room.path(), "room.toml", script);
    let lines = text.matches("first picture with light after").count();
    assert_eq!(lines, 3, "one for each scene: {text}");
    let [first, other, again] =
        ["first.png", "other.png", "again.png"].map(|name| room.picture(name));
    let [apart, same] = [&other, &again].map(|picture| difference(&first, picture));
    println!("codes differ by {apart:.2} from another scene, by {same:.3} from the same");
    assert!(apart > APART && same < SAME);
}

/// Mean differences of codes. Measured: 41; 0 to 0.28, by the slices that the bake was solved in.
const APART: f64 = 20.0;
const SAME: f64 = 0.6;

/// A part of a picture: left, top, width, height.
fn part(picture: &RgbImage, [left, top, width, height]: [u32; 4]) -> RgbImage {
    image::imageops::crop_imm(picture, left, top, width, height).to_image()
}

/// Where the back wall is seen from the front, without its edges.
const BACK_WALL: [u32; 4] = [105, 65, 110, 110];

/// Each way of shading relief is that of `render`, and no two of them are alike.
#[test]
fn relief_is_shaded_as_render_does() {
    let room = Room::baked("relief");
    let shadings = ["factored", "clusters", "normal", "parallax", "none"];
    let mut script = String::from("set panel off\nset notes off\nframes 1\n");
    for shading in shadings {
        script += &format!("set shading {shading}\ndetail\nscreenshot {shading}.png\n");
    }
    script += "save saved.png\n";
    let text = view(room.path(), "relief.safetensors", &script);
    let exposure = text.split("exposure ").nth(1).expect("told when saved");
    let exposure = exposure.split_whitespace().next().unwrap_or_default();
    for shading in shadings {
        let to = format!("render-{shading}.png");
        let args = ["render", "relief.safetensors", "-o", &to, "--size", SIZE];
        let output = mesolux(room.path(), &args)
            .args(["--shading", shading, "--exposure", exposure])
            .args(device())
            .output()
            .expect("the program runs");
        assert!(output.status.success(), "{}", told(&output));
        let shown = room.picture(&format!("{shading}.png"));
        assert_alike(&shown, &room.picture(&to), shading);
        for other in shadings.iter().filter(|other| **other < shading) {
            let other = part(&room.picture(&format!("{other}.png")), BACK_WALL);
            let found = difference(&part(&shown, BACK_WALL), &other);
            println!("{shading}: {found:.2} from another");
            // A fifth of a code: what tells ways of shading apart is on the whole wall.
            assert!(found > 0.2, "{shading} looks like another: {found}");
        }
    }
}

/// While a view moves, the window shows the light as it is, relief by its own normals, as soon as the
/// view has changed: no ghost of another view, and nearer to what `render` draws than plain triangles
/// are, wherever one looks from. With `MESOLUX_TEST_FIGURES` 60 views of an orbit.
#[test]
fn what_moves_is_shown_as_it_is() {
    let room = Room::baked("relief");
    let views = match std::env::var_os("MESOLUX_TEST_FIGURES") {
        Some(_) => 60,
        None => 5,
    };
    let mut script =
        String::from("set panel off\nset notes off\nframes 1\nmove 120 120\npress middle\n");
    for i in 0..views {
        // Round and back, up and down.
        let turn = std::f64::consts::TAU * f64::from(i) / f64::from(views);
        let (x, y) = (120.0 + 80.0 * turn.sin(), 120.0 + 30.0 * (2.0 * turn).sin());
        script += &format!(
            "move {x:.0} {y:.0}\nframes 1\nscreenshot moving-{i}.png\ndetail\nscreenshot still-{i}.png\n\
             set detail off\nset shading none\nframes 1\nscreenshot plain-{i}.png\n\
             set shading factored\nset detail on\n"
        );
    }
    view(room.path(), "relief.safetensors", &script);
    let found: Vec<[f64; 2]> = (0..views)
        .map(|i| {
            let [moving, plain, still] =
                ["moving", "plain", "still"].map(|name| room.picture(&format!("{name}-{i}.png")));
            [flip(&moving, &still), flip(&plain, &still)]
        })
        .collect();
    let most = |which: usize| found.iter().map(|f| f[which]).fold(0.0, f64::max);
    println!(
        "{views} views: FLIP {:.4} at most, of plain triangles {:.4}",
        most(0),
        most(1)
    );
    for (i, [moving, plain]) in found.iter().enumerate() {
        assert!(
            *moving < MOVING && moving < plain,
            "view {i}: {moving}, plain {plain}"
        );
    }
}

/// Mean difference of what moves from what `render` draws, LDR-FLIP.
const MOVING: f64 = 0.08;

/// The mouse moves a light by as much as it moves itself, in the plane that faces the eye; Escape
/// puts it back.
#[test]
fn a_light_is_dragged() {
    let room = Room::baked("room");
    // The plane of the light is 3.6 away and half of the picture is 21° high.
    let half = 3.6 * 21.0_f64.to_radians().tan();
    let (x, y) = (
        0.5 + (110.0 - 200.0) / 160.0 * half * 4.0 / 3.0,
        -(160.0 - 120.0) / 120.0 * half,
    );
    let script = format!(
        "{QUIET}frames 1\nscreenshot before.png\nmove 200 120\nkey G\nmove 150 100\nmove 110 160
         relit\nbake\nscreenshot dragged.png\npress left\nrelease left\nmove 60 60\nframes 1\nscreenshot left.png
         key G\nmove 200 120\nrelit\nbake\nscreenshot again.png\nkey Escape\nrelit\nbake\nscreenshot back.png
         set lamp bulb position 0 0 0\nset lamp bulb position {x} {y} 0\nrelit\nbake\nscreenshot set.png"
    );
    view(room.path(), "room.safetensors", &script);
    let dragged = room.picture("dragged.png");
    for same in ["left.png", "back.png", "set.png"] {
        let found = difference(&dragged, &room.picture(same));
        assert!(found < 0.1, "{same} differs by {found}");
    }
    for other in ["before.png", "again.png"] {
        let found = difference(&dragged, &room.picture(other));
        assert!(found > 1.0, "{other} differs by {found}");
    }
}

/// Another number of directions and other heights are baked while the window is open.
#[test]
fn directions_and_heights_are_baked_anew() {
    let room = Room::new();
    let script = "set panel off\nset notes off\nset ambient off\nframes 1\nscreenshot first.png\nbake\ndetail\nscreenshot 16.png\nkey K\nbake\ndetail\nscreenshot 32.png
        set height 0.5\nbake\ndetail\nscreenshot low.png\nset height 0\nbake\ndetail\nscreenshot flat.png
        set shading none\ndetail\nscreenshot none.png";
    view(room.path(), "relief.toml", script);
    let [r, g, b] = mean(&room.picture("first.png"));
    assert!(r + g + b > 60.0, "dark before there is light: {r} {g} {b}");
    let wall = |name: &str| part(&room.picture(name), BACK_WALL);
    // How uneven the wall is: bumps are lit from above.
    let unevenness = |name: &str| {
        let wall = wall(name);
        let shifted = part(&wall, [0, 7, 110, 103]);
        difference(&part(&wall, [0, 0, 110, 103]), &shifted)
    };
    let [k16, k32, low, flat] = ["16.png", "32.png", "low.png", "flat.png"].map(unevenness);
    println!(
        "uneven by {k16:.2} (K = 16), {k32:.2} (K = 32), {low:.2} at half the height, {flat:.2} flat"
    );
    let found = difference(&wall("16.png"), &wall("32.png"));
    assert!(
        found > 0.05 && (k16 - k32).abs() < 0.2 * k16,
        "K: {found}, {k16}, {k32}"
    );
    assert!(k32 > 1.3 * low && low > 1.3 * flat, "{k32}, {low}, {flat}");
    let found = difference(&wall("flat.png"), &wall("none.png"));
    assert!(found < 0.01, "without height there is no relief: {found}");
}

/// What lies over the view, of a scene that was baked here and of a bake from a file.
#[test]
fn overlays_show_sources_slots_and_items() {
    let room = Room::baked("relief");
    let script = format!(
        "{QUIET}frames 1\nbake\nframes 1\nscreenshot none.png\nkey P\noverlays\nframes 1\nscreenshot sources.png\nkey P
         move 150 110\nkey H\nmove 151 111\nframes 1\nscreenshot slots.png\nkey H
         press left\nrelease left\nframes 1\nscreenshot marked.png\nkey I\noverlays\nframes 1\nscreenshot items.png
         key I\nkey Escape\nframes 1\nscreenshot again.png"
    );
    for input in ["relief.safetensors", "relief.toml"] {
        view(room.path(), input, &script);
        let none = room.picture("none.png");
        assert!(room.picture("again.png") == none, "{input}");
        let changed = |name: &str, place: [u32; 4]| {
            difference(&part(&none, place), &part(&room.picture(name), place))
        };
        // Every wall is tinted; the hemisphere hangs at the pointer, the item buffer in the corner,
        // and elsewhere is nothing new.
        assert!(changed("sources.png", [0, 0, 320, 240]) > 5.0, "{input}");
        let disc = [167, 127, 96, 96];
        assert!(changed("slots.png", disc) > 10.0, "{input}");
        assert!(changed("slots.png", [0, 0, 320, 100]) == 0.0, "{input}");
        let (near, far) = (
            changed("marked.png", [130, 90, 40, 40]),
            changed("marked.png", [0, 0, 100, 240]),
        );
        assert!(near > 3.0 && far == 0.0, "{input}: {near}, {far}");
        let corner = [228, 148, 84, 84];
        assert!(changed("items.png", corner) > 20.0, "{input}");
        assert!(changed("items.png", [0, 0, 100, 240]) == 0.0, "{input}");
        // A source on the back wall sees four walls, the lamp and the open side; walls are of one
        // piece in an item buffer.
        let items = part(&room.picture("items.png"), corner);
        let colours: std::collections::HashSet<_> = items.pixels().map(|p| p.0).collect();
        assert!(colours.len() > 5, "{input}: {} colours", colours.len());
    }
}

/// With the light that is not shot, what is cut short has nearly its brightness; the key takes it
/// away.
#[test]
fn the_estimate_of_unshot_light_is_switched() {
    let room = Room::new();
    let script = format!(
        "{QUIET}frames 1\nbake\nframes 1\nscreenshot with.png\nkey T\nframes 1\nscreenshot without.png\nkey T\nframes 1
         screenshot again.png\nkey 2\nframes 1\nscreenshot direct.png\nkey T\nframes 1\nscreenshot straight.png"
    );
    let display = Display::new();
    std::fs::write(room.path().join("script"), &script).expect("written");
    let args = ["view", "room.toml", "--script", "script", "--size", SIZE];
    let child = mesolux(room.path(), &args)
        .args(["--validate", "--quality", "draft", "--shots", "12"])
        .args(device())
        .env("DISPLAY", &display.name)
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program runs");
    finish(child, &script);
    let sum = |name: &str| mean(&room.picture(name)).iter().sum::<f64>();
    assert!(sum("with.png") > sum("without.png") + 10.0);
    assert!(room.picture("with.png") == room.picture("again.png"));
    // What comes straight from lights has none.
    assert!(room.picture("direct.png") == room.picture("straight.png"));
}

/// Cameras in turn, and pictures in files as `save` and F12 write them.
#[test]
fn cameras_are_picked_and_pictures_saved() {
    let room = Room::baked("relief");
    let script = format!(
        "{QUIET}frames 1\nscreenshot front.png\nkey C\nframes 1\nscreenshot corner.png\nkey C\nframes 1\nscreenshot again.png
         key F12\nkey F12\nsave third.png"
    );
    let text = view(room.path(), "relief.safetensors", &script);
    assert_eq!(text.matches("saved ").count(), 3, "{text}");
    let front = room.picture("front.png");
    assert!(difference(&front, &room.picture("corner.png")) > 10.0);
    assert!(front == room.picture("again.png"));
    let third = room.picture("third.png");
    for name in ["mesolux-0001.png", "mesolux-0002.png"] {
        assert!(room.picture(name) == third, "{name}");
    }
    // What is saved has its relief, which the window does not draw while details are off.
    assert!(difference(&part(&front, BACK_WALL), &part(&third, BACK_WALL)) > 1.0);
}

/// A bake's bound falls in the panel, whose other lines tell what it waits for.
#[test]
fn the_panel_shows_the_error_bound() {
    let room = Room::new();
    let script = "set detail off\nframes 1\nbake\nframes 1\nscreenshot without.png\nkey B\nframes 2\nscreenshot bound.png";
    view_in("480x640", room.path(), "room.toml", script);
    // The curve is drawn in a light green that nothing else of the panel has.
    let green = |name: &str| {
        let picture = room.picture(name);
        let near = |a: u8, b: u8| a.abs_diff(b) < 16;
        let is_green = |p: &&image::Rgb<u8>| near(p[0], 144) && near(p[1], 238) && near(p[2], 144);
        picture.pixels().filter(is_green).count()
    };
    assert!(
        green("without.png") < 5 && green("bound.png") > 20,
        "{}",
        green("bound.png")
    );
}

#[test]
fn follows_the_size_and_survives_a_lost_surface() {
    let room = Room::baked("room");
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
    let room = Room::baked("room");
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
    let room = Room::baked("room");
    let script = format!(
        "{QUIET}set ambient off\nframes 1\nscreenshot before.png
         set lamp lamp colour 1 0.1 0.1\nrelit\nbake\nscreenshot red.png
         set lamp lamp colour 1 1 1\nrelit\nbake\nscreenshot after.png
         set lamp bulb position -0.5 -0.5 0\nrelit\nbake\nscreenshot moved.png"
    );
    let text = view(room.path(), "room.safetensors", &script);
    assert_eq!(
        text.matches("all light of changed lights on the screen after")
            .count(),
        3,
        "{text}"
    );
    let [r, g, _] = mean(&room.picture("red.png"));
    let [r0, g0, _] = mean(&room.picture("before.png"));
    assert!(r / g > 1.5 * r0 / g0, "{r} {g} for {r0} {g0}");
    let found = difference(&room.picture("before.png"), &room.picture("after.png"));
    // Draft bakes leave 2.5 % of the light to neighbours of what was drawn, in an order that
    // depends on what was kept.
    assert!(found < 3.0, "the same light differs by {found}");
    let found = difference(&room.picture("after.png"), &room.picture("moved.png"));
    assert!(found > 1.0, "a moved light changes {found}");
}

/// A scene refines while it is shown, and with the estimate of the light that is not shot it has
/// its brightness from the start.
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

/// The scripts beside the scenes in `assets/` run to their end.
#[test]
fn shows_the_assets() {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    for (name, script) in [
        ("woven-cloth", "show.txt"),
        ("embossed-plate", "embossed-plate/lamp.txt"),
    ] {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let script = std::fs::read_to_string(assets.join(script)).expect("the script is there");
        let scene = assets.join(name).join("scene.toml");
        let script = script.replace("close\n", "screenshot last.png\nclose\n");
        view(folder.path(), scene.to_str().expect("a text"), &script);
        let last = image::open(folder.path().join("last.png")).expect("it was written");
        let [r, g, b] = mean(&last.to_rgb8());
        assert!((r + g + b) / 3.0 > 20.0, "{name}: {r} {g} {b}");
    }
}
