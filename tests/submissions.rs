//! How long the longest part of a submission takes: drivers end what takes them more than 2 s.

mod common;

use common::{assert_silent, device};
use mesolux::bake::{solution, solve};
use mesolux::render::{Lighting, View, render};
use mesolux::scene::{LoadOptions, load};
use mesolux::solver::Settings;

#[test]
#[ignore = "long: runs by scripts/test --all"]
fn no_part_is_long() {
    for (name, patches) in [("cornell", 100_000), ("cornell-relief", 40_000)] {
        let device = device();
        let options = LoadOptions {
            patches: Some(patches),
            ..LoadOptions::default()
        };
        let scene = load(name, &options).expect("it is built in");
        device.time_parts();
        let settings = Settings {
            residual: 0.05,
            ..Settings::default()
        };
        let solver = solve(&device, &scene, &settings, None, |_| true).expect("it is solved");
        let solution = solution(&scene, &solver).expect("it comes back");
        let view = View {
            camera: &scene.cameras[0],
            width: 640,
            height: 480,
        };
        render(&device, &scene, Lighting::from(&solution), &view).expect("it is drawn");
        let mut parts: Vec<_> = device.timed_parts().0.into_iter().collect();
        parts.sort_by_key(|(_, (_, longest))| std::cmp::Reverse(*longest));
        println!(
            "{name}, {patches} elements, {} sources",
            solver.report().sources
        );
        for (name, (count, longest)) in parts.iter().take(12) {
            println!("  {name}: {count}, {:.3} s at most", longest.as_secs_f64());
        }
    }
    assert_silent();
}
