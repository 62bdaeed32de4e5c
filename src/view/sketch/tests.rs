//! Sketches beside closed forms.

use glam::DVec3;

use super::*;
use crate::scene::{Lights, Material, PointLight, Triangle};

/// A floor of 32 × 32 squares from −1 to 1, with y up.
const SIDE: u32 = 32;

/// The floor beneath a card of 0.4 × 0.4 whose corner is above the middle, at 0.5.
fn room(lights: Lights) -> Scene {
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let step = 2.0 / f64::from(SIDE);
    let along = |i: u32| f64::from(i) * step - 1.0;
    let mut scene = Scene {
        materials: vec![Material::default()],
        lights,
        ..Scene::default()
    };
    let row = SIDE + 1;
    for z in 0..row {
        scene
            .vertices
            .extend((0..row).map(|x| at(along(x), 0.0, along(z))));
    }
    let mut square = |corners: [u32; 4]| {
        let [a, b, c, d] = corners;
        for vertices in [[a, c, b], [b, c, d]] {
            scene.triangles.push(Triangle {
                vertices,
                uv: [[0.0; 2]; 3],
                emission_uv: None,
                light_uv: None,
                material: 0,
            });
        }
    };
    for z in 0..SIDE {
        for x in 0..SIDE {
            let first = z * row + x;
            square([first, first + 1, first + row, first + row + 1]);
        }
    }
    let first = row * row;
    square([first, first + 1, first + 2, first + 3]);
    let card = [[0.0, 0.0], [0.4, 0.0], [0.0, 0.4], [0.4, 0.4]];
    scene.vertices.extend(card.map(|[x, z]| at(x, 0.5, z)));
    scene
}

/// A lamp that is moved, from a light without it: I cos θ / d² of its new place at the corners,
/// the light there was before in the shadow of the card, and nothing of its old place.
#[test]
fn a_lamp_lights_what_it_sees_from_where_it_is() {
    let lamp = |x: f64, intensity: f32| PointLight {
        name: "lamp".into(),
        position: DVec3::new(x, 1.0, 0.2),
        intensity: [intensity, 0.0, 2.0 * intensity],
        beam: None,
    };
    let lit = |(x, i)| Arc::new(room(Lights::from(lamp(x, i))));
    let [before, now] = [(0.2, 0.0), (-0.2, 3.0)].map(lit);
    let wanted = Wanted {
        base: Arc::new(Snapshot::unlit(&before)),
        scene: Arc::clone(&now),
        epoch: 1,
        since: Instant::now(),
    };
    assert!(is_possible(&before, &now));
    let mut rays = Rays::new(&now, Vec::new());
    let light = rays.sketch(&wanted.base, &changes(&wanted));
    let place = now.lights.points[0].position;
    let (mut lit, mut dark, mut worst) = (0, 0, 0.0_f64);
    for (e, triangle) in now
        .triangles
        .iter()
        .enumerate()
        .take((2 * SIDE * SIDE) as usize)
    {
        for (k, at) in now.corners(triangle).into_iter().enumerate() {
            // Where the way to the lamp passes the height of the card.
            let crossing = at + (place - at) * 0.5;
            let [x, z] = [crossing.x, crossing.z];
            let beside = [x, z].map(|c| (c - 0.2).abs() - 0.2);
            let beside = beside[0].max(beside[1]);
            // Light at corners is of the squares about them, and of those about these: twice as
            // far away as here. On an edge of the floor it goes on as within the squares.
            let edge = at.x.abs().max(at.z.abs()) > 0.9;
            if edge || beside.abs() < 3.0 / f64::from(SIDE) {
                continue;
            }
            let before = wanted.base.at_corners.direct[e][k];
            let added = (light.direct[e][k] - before).as_dvec3();
            let all = (light.all[e][k] - wanted.base.at_corners.all[e][k]).as_dvec3();
            assert!((all - added).length() < 1e-5, "{all} and {added}");
            let way = place - at;
            let exact = match beside < 0.0 {
                true => 0.0,
                false => 3.0 * way.y / way.length().powi(3),
            };
            let expected = DVec3::new(exact, 0.0, 2.0 * exact);
            let off = (added - expected).length() / (3.0 * 5.0_f64.sqrt());
            worst = worst.max(off);
            match beside < 0.0 {
                true => dark += 1,
                false => lit += 1,
            }
        }
    }
    println!("{lit} lit and {dark} dark corners, {worst:.1e} of the most off");
    assert!(lit > 3000 && dark > 200, "{lit} and {dark}");
    assert!(worst < 0.005, "{worst}");
    // What has not changed is not sketched.
    let same = Wanted {
        scene: Arc::clone(&before),
        ..wanted
    };
    assert!(changes(&same).is_empty());
}

/// The room with a square emitter of 0.2 × 0.2 at height 1, whose corner is at `x`.
fn with_emitter(x: f64, emission: f32) -> Arc<Scene> {
    let mut scene = room(Lights::default());
    scene.materials.push(Material {
        ke: [emission, 0.0, 2.0 * emission],
        ..Material::default()
    });
    let first = scene.vertices.len() as u32;
    let corners = [[0.0, 0.0], [0.2, 0.0], [0.0, 0.2], [0.2, 0.2]];
    let at = |[u, v]: [f64; 2]| DVec3::new(x + u, 1.0, v - 0.2);
    scene.vertices.extend(corners.map(at));
    for vertices in [[0, 1, 2], [2, 1, 3]] {
        scene.triangles.push(Triangle {
            vertices: vertices.map(|v| first + v),
            uv: [[0.0; 2]; 3],
            emission_uv: None,
            light_uv: None,
            material: 1,
        });
    }
    Arc::new(scene)
}

/// An emitter that was dark elsewhere brings what Lambert's formula says where all of it is
/// seen, and nothing where the card hides all of it.
#[test]
fn an_emitter_lights_what_it_sees_from_where_it_is() {
    let [before, now] = [(0.2, 0.0), (-0.4, 3.0)].map(|(x, ke)| with_emitter(x, ke));
    assert_eq!(moved(&before, &now), [1]);
    // By corners of its own, where it shared some before.
    let mut apart = Scene::clone(&now);
    let corner = apart.triangles[apart.triangles.len() - 1].vertices[0];
    apart.vertices.push(now.vertices[corner as usize]);
    let last = apart.triangles.last_mut().expect("the emitter's");
    last.vertices[0] = now.vertices.len() as u32;
    assert_eq!(moved(&before, &apart), [1]);
    let wanted = Wanted {
        base: Arc::new(Snapshot::unlit(&before)),
        scene: Arc::clone(&now),
        epoch: 1,
        since: Instant::now(),
    };
    assert!(is_possible(&before, &now));
    let mut rays = Rays::new(&now, vec![1]);
    let light = rays.sketch(&wanted.base, &changes(&wanted));
    let emitter: Vec<[DVec3; 3]> = (now.triangles.iter())
        .filter(|t| t.material == 1)
        .map(|t| now.corners(t))
        .collect();
    let (mut lit, mut dark, mut worst) = (0, 0, 0.0_f64);
    let brightest = 3.0 * 0.04;
    for (e, triangle) in now
        .triangles
        .iter()
        .enumerate()
        .take((2 * SIDE * SIDE) as usize)
    {
        for (k, at) in now.corners(triangle).into_iter().enumerate() {
            if at.x.abs().max(at.z.abs()) > 0.9 {
                continue;
            }
            // Where ways to places of the emitter pass the height of the card.
            let shares =
                (0..=8).flat_map(|i| (0..=8).map(move |j| [i, j].map(|k| 0.025 * f64::from(k))));
            let off: Vec<f64> = shares
                .map(|[u, v]| DVec3::new(u - 0.4, 1.0, v - 0.2))
                .map(|place| at + (place - at) * 0.5)
                .map(|p| (p.x - 0.2).abs().max((p.z - 0.2).abs()) - 0.2)
                .collect();
            let near = 3.0 / f64::from(SIDE);
            let hidden = off.iter().all(|off| *off < -near);
            let seen = off.iter().all(|off| *off > near);
            let factor: f64 = emitter
                .iter()
                .map(|t| crate::math::form_factor::to_triangle(at, DVec3::Y, t))
                .sum();
            let exact = match (hidden, seen) {
                (true, _) => 0.0,
                (_, true) => 3.0 * std::f64::consts::PI * factor,
                _ => continue,
            };
            let added = (light.direct[e][k] - wanted.base.at_corners.direct[e][k]).as_dvec3();
            let expected = DVec3::new(exact, 0.0, 2.0 * exact);
            worst = worst.max((added - expected).length() / (brightest * 5.0_f64.sqrt()));
            match hidden {
                true => dark += 1,
                false => lit += 1,
            }
        }
    }
    println!("{lit} lit and {dark} dark corners, {worst:.1e} of the most off");
    assert!(lit > 1500 && dark > 20, "{lit} and {dark}");
    assert!(worst < 0.015, "{worst}");
}
