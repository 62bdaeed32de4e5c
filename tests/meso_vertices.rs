//! From slots of elements to slots of vertices, the paper's Figure 1.

mod common;

use common::sheet::{light_on, parallel, sheet};
use glam::{DVec3, Vec3};
use mesolux::bake::solution::DirectionalLight;
use mesolux::math::directions::Directions;
use mesolux::mesh::corners::Corners;
use mesolux::mesh::meso_vertices::MesoVertices;
use mesolux::scene::Scene;

fn world(frame: [Vec3; 3], v: Vec3) -> Vec3 {
    frame[0] * v.x + frame[1] * v.y + frame[2] * v.z
}

/// Parallel light of two colours' strengths: whatever the frames, every vertex has it as the same
/// vector, in one or two slots, and the frames are orthonormal and one for all who share them.
#[test]
fn parallel_light_is_the_same_vector_in_every_frame() {
    let scene = sheet(8, 0.6);
    let towards = DVec3::new(0.3, -0.4, 1.0).normalize();
    let strength = Vec3::new(1.0, 2.0, 0.0);
    for k in [16, 32, 64] {
        let directions = Directions::new(k).expect("a number of the paper");
        let light = light_on(&scene, &directions, |frame| {
            parallel(&directions, frame, towards, strength)
        });
        let vertices = MesoVertices::new(
            &scene,
            &Corners::new(&scene),
            &light.elements,
            &light.frames,
        );
        assert_eq!(
            vertices.frames.len(),
            81,
            "one frame a vertex of a smooth sheet"
        );
        let gathered = vertices.gather(&directions, &light.frames, &light.incident_moment);
        for (frame, slots) in vertices
            .frames
            .iter()
            .zip(gathered.chunks(directions.count()))
        {
            for (i, a) in frame.iter().enumerate() {
                for (j, b) in frame.iter().enumerate() {
                    assert!((a.dot(*b) - if i == j { 1.0 } else { 0.0 }).abs() < 1e-6);
                }
            }
            let used = slots.iter().filter(|s| s[0] != Vec3::ZERO).count();
            assert!(used <= 2, "{used} slots");
            for c in 0..3 {
                let sum: Vec3 = slots.iter().map(|s| world(*frame, s[c])).sum();
                let expected = strength[c] * towards.as_vec3();
                assert!(
                    sum.distance(expected) < 1e-5,
                    "K = {k}: {sum} for {expected}"
                );
            }
        }
    }
}

/// Where all frames are one, every slot keeps what it has: the mean over the elements by their
/// angles.
#[test]
fn slots_of_a_plane_stay_apart() {
    let scene = sheet(2, 0.0);
    let directions = Directions::new(64).expect("a number of the paper");
    let mut light = light_on(&scene, &directions, |_| {
        (0..64)
            .map(|k| [directions.centre(k).as_vec3(); 3])
            .collect()
    });
    for (i, moment) in light.incident_moment.iter_mut().enumerate() {
        moment.iter_mut().for_each(|c| *c *= (i / 64) as f32);
    }
    let vertices = MesoVertices::new(
        &scene,
        &Corners::new(&scene),
        &light.elements,
        &light.frames,
    );
    let gathered = vertices.gather(&directions, &light.frames, &light.incident_moment);
    // The middle of the sheet lies on all four cells, two triangles of 45° or one of 90° in each.
    let middle = scene
        .vertices
        .iter()
        .position(|v| v.distance(DVec3::new(0.5, 0.5, 0.0)) < 1e-12)
        .expect("it has a middle") as u32;
    let (mut sum, mut whole, mut vertex) = (0.0, 0.0, 0);
    for (e, t) in scene.triangles.iter().enumerate() {
        if let Some(k) = t.vertices.iter().position(|&v| v == middle) {
            let [a, b, c] = [k, k + 1, k + 2].map(|k| scene.corners(t)[k % 3]);
            let angle = (b - a).angle_between(c - a);
            (sum, whole, vertex) = (
                sum + e as f64 * angle,
                whole + angle,
                vertices.corners[e][k],
            );
        }
    }
    for k in 0..64 {
        let expected = (directions.centre(k) * sum / whole).as_vec3();
        let found = gathered[vertex as usize * 64 + k][1];
        assert!(
            found.distance(expected) < 1e-5,
            "slot {k}: {found} for {expected}"
        );
    }
}

/// Across a crease, a seam of the texture or a change of material nothing is gathered.
#[test]
fn seams_part_vertices() {
    let directions = Directions::new(16).expect("a number of the paper");
    let up = |_| vec![[Vec3::Z; 3]; 16];
    let whole = sheet(2, 0.0);
    let count = |scene: &Scene, light: &DirectionalLight| {
        MesoVertices::new(scene, &Corners::new(scene), &light.elements, &light.frames)
            .frames
            .len()
    };
    assert_eq!(count(&whole, &light_on(&whole, &directions, up)), 9);
    let mut other = whole.clone();
    other.materials.push(other.materials[1].clone());
    for t in &mut other.triangles[..4] {
        t.material = 2;
    }
    assert_eq!(count(&other, &light_on(&other, &directions, up)), 12);
    let mut light = light_on(&whole, &directions, up);
    for frame in &mut light.frames[..4] {
        *frame = [frame[1], -frame[0], frame[2]];
    }
    assert_eq!(count(&whole, &light), 12);
    let mut mirrored = light_on(&whole, &directions, up);
    for frame in &mut mirrored.frames[..4] {
        frame[1] = -frame[1];
    }
    assert_eq!(count(&whole, &mirrored), 12);
    let creased = sheet(2, 4.0);
    assert!(count(&creased, &light_on(&creased, &directions, up)) > 9);
}
