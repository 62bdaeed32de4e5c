//! What follows no ways, since it sees all of each light or nothing of it.

use glam::DVec3;
use mesolux::bench::relief_room::{REPEAT, TEXELS, bumps};
use mesolux::render::{Light, Lighting, ReliefShading, Renderer, SAMPLES};
use mesolux::scene::{PointLight, Scene};

use crate::common::{Build, assert_silent, device};
use crate::{baked, ball, camera, room, view};

/// The least share of open triangles: of a wall's 4 × 4 cells the inner four touch no other wall,
/// which would count as hiding the lamp; the block's and the ball's shadows take a few of them.
const OPEN: f64 = 0.15;

/// Ways that nothing stands on are not followed, and the picture is the same to the bit; what the
/// block or a card's shadow falls on is not open, however many lamps there are.
#[test]
fn open_triangles_follow_no_ways() {
    let camera = camera(DVec3::new(1.9, 1.2, 1.9), DVec3::new(1.0, 0.2, 0.8), 75.0);
    let mut plain_ball = ball(6);
    for material in &mut plain_ball.materials {
        material.map_height = None;
    }
    let mut two_lamps = room(false, 0.3);
    two_lamps.lights.points.push(PointLight {
        name: "test".into(),
        position: DVec3::new(1.7, 1.2, 1.6),
        intensity: [0.3; 3],
        beam: None,
    });
    for (name, scene) in [
        ("a lamp", &room(false, 0.3)),
        ("a point besides", &two_lamps),
        ("a ball", &plain_ball),
    ] {
        let solution = baked(scene);
        let lighting = Lighting {
            part: Light::Direct,
            shading: ReliefShading::None,
            ..Lighting::from(&solution)
        };
        let [with, without] = [true, false].map(|skip_open| {
            let lighting = Lighting {
                skip_open,
                ..lighting
            };
            let device = device();
            let renderer = Renderer::new(&device, scene, lighting, &view(&camera), SAMPLES);
            let renderer = renderer.expect("a picture");
            (
                renderer.picture().expect("a picture"),
                renderer.open_triangles(),
            )
        });
        let [open, all] = with.1;
        println!("{name}: {open} of {all} triangles are open");
        assert!(
            with.0.radiance == without.0.radiance,
            "{name}: another picture"
        );
        assert!(open as f64 > OPEN * all as f64 && open < all);
        assert_eq!(without.1, [0, all]);
    }
    assert_silent();
}

/// A floor of 16 × 16 cells with bumps, a lamp above, and a card that hides it from some of them.
fn bumps_under_a_card() -> Scene {
    let mut build = Build::new();
    let floor = build.material(0.6, 0.0);
    let lamp = build.material(0.0, 20.0);
    let dark = build.material(0.1, 0.0);
    build.relief(floor, TEXELS, |x, y| 0.12 * REPEAT * bumps(x, y));
    let (x, z) = (DVec3::X, DVec3::Z);
    let cells = build.quad(DVec3::ZERO, 2.0 * z, 2.0 * x, (16, 16), floor);
    build.cover(cells, floor, (z, x));
    build.quad(DVec3::new(0.5, 1.5, 0.5), 0.2 * x, 0.2 * z, (1, 1), lamp);
    build.quad(DVec3::new(0.9, 0.7, 0.4), 0.6 * z, 0.5 * x, (1, 1), dark);
    build.weld();
    build.0.scene
}

/// The same of relief, on a floor, where other triangles of it do not count, and on a ball; nor are
/// ways marched that rise above the relief's horizon. The least share of prisms that see all of the
/// lamp, and that see none of it, where there is a card.
#[test]
fn prisms_that_see_all_or_nothing_follow_no_ways() {
    const ALL: f64 = 0.3;
    const NOTHING: f64 = 0.007;
    let above = camera(DVec3::new(1.3, 1.3, 1.9), DVec3::new(0.9, 0.0, 0.9), 80.0);
    let beside = camera(DVec3::new(1.9, 1.2, 1.9), DVec3::new(1.0, 0.2, 0.8), 75.0);
    for (name, scene, camera) in [
        ("a card", &bumps_under_a_card(), &above),
        ("a block", &room(true, 0.3), &beside),
        ("a ball", &ball(6), &beside),
    ] {
        let solution = baked(scene);
        let drawn = |shading, skip_open| {
            let lighting = Lighting {
                part: Light::Direct,
                shading,
                skip_open,
                ..Lighting::from(&solution)
            };
            let device = device();
            let renderer = Renderer::new(&device, scene, lighting, &view(camera), SAMPLES);
            let renderer = renderer.expect("a picture");
            let picture = renderer.picture().expect("a picture");
            (picture.radiance, renderer.prisms())
        };
        let [with, without] = [true, false].map(|skip| drawn(ReliefShading::Factored, skip));
        let [unsure, open, hidden] = with.1;
        println!("{name}: {open} prisms are open, {hidden} hidden, {unsure} neither");
        assert!(with.0 == without.0, "{name}: another picture");
        let all = unsure + open + hidden;
        assert_eq!(without.1, [all, 0, 0]);
        let clusters = [true, false].map(|skip| drawn(ReliefShading::Clusters, skip).0);
        assert!(
            clusters[0] == clusters[1],
            "{name}: another picture by clusters"
        );
        if name == "a card" {
            assert!(open as f64 > ALL * all as f64 && hidden as f64 > NOTHING * all as f64);
        }
    }
    assert_silent();
}
