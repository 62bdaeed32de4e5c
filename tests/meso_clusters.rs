//! Clusters of near-parallel light on faces.

mod common;

use common::sheet::{light_on, parallel, sheet};
use glam::{DVec3, Vec3};
use mesolux::constants::MOST_CLUSTERS;
use mesolux::math::directions::Directions;
use mesolux::mesh::clusters::{
    Cluster, CornerLight, Face, FaceClusters, NEAR_PARALLEL_COS, clusters,
};
use mesolux::mesh::corners::Corners;
use mesolux::mesh::meso_vertices::MesoVertices;
use mesolux::scene::Scene;

/// What sums of some hundred f32 lose, thrice over.
const ROUNDING: f64 = 1e-5;
const UPRIGHT: [Vec3; 3] = [Vec3::X, Vec3::Y, Vec3::Z];

/// Light at a corner whose frame is the world's.
fn upright(moments: &[[Vec3; 3]]) -> CornerLight<'_> {
    CornerLight {
        frame: UPRIGHT,
        moments,
    }
}

type Moments = Vec<[Vec3; 3]>;

/// A hash of an index to 0..1.
fn random(i: u64) -> f64 {
    let mut z = (i + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (z >> 11) as f64 / (1_u64 << 53) as f64
}

/// Light of all directions, of other strengths and colours in each slot: `[slot][colour]`.
fn uneven(directions: &Directions, seed: u64) -> Moments {
    (0..directions.count())
        .map(|slot| {
            std::array::from_fn(|c| {
                let at = |i: usize| random(seed + (7 * slot + i) as u64) - 0.5;
                // Within the slot, about its middle.
                let aside = 0.1 * DVec3::new(at(3), at(4), at(5));
                let towards = (directions.centre(slot) + aside).normalize();
                let towards = towards.with_z(towards.z.max(0.0));
                (towards * (0.6 + at(c))).as_vec3()
            })
        })
        .collect()
}

/// The sum over the colours of the moments of a corner.
fn vector(moments: &Moments) -> DVec3 {
    moments.iter().flatten().map(|m| m.as_dvec3()).sum()
}

/// As a vector, by corner.
fn light_of(clusters: &[Cluster]) -> [DVec3; 3] {
    [0, 1, 2].map(|corner| {
        let one = |c: &Cluster| c.towards.as_dvec3() * f64::from(c.fluence[corner].element_sum());
        clusters.iter().map(one).sum()
    })
}

/// The lengths of moments that clusters of a corner may have joined differ from what they carry by
/// the cosine of twice the threshold at most: a mean direction lies within the cone about the
/// strongest, and so do all members.
#[test]
fn clusters_carry_the_energy_of_the_vertices() {
    let least = 2.0 * NEAR_PARALLEL_COS.powi(2) - 1.0;
    for k in [16, 32, 64] {
        let directions = Directions::new(k).expect("a number of the paper");
        for seed in [0, 1000, 2000] {
            let moments = [0, 1, 2].map(|corner| uneven(&directions, seed + 100_000 * corner));
            let found = clusters([0, 1, 2].map(|c| upright(&moments[c])));
            assert!(found.len() < MOST_CLUSTERS as usize, "{}", found.len());
            let given: DVec3 = moments.iter().map(vector).sum();
            let carried: DVec3 = light_of(&found).iter().sum();
            assert!(
                given.distance(carried) < ROUNDING * given.length(),
                "K = {k}: {carried} for {given}"
            );
            for (corner, moments) in moments.iter().enumerate() {
                for colour in 0..3 {
                    let lengths: f64 = moments.iter().map(|m| f64::from(m[colour].length())).sum();
                    let fluence = |c: &Cluster| f64::from(c.fluence[corner][colour]);
                    let carried: f64 = found.iter().map(fluence).sum();
                    let share = carried / lengths;
                    assert!(
                        (least..=1.0 + ROUNDING).contains(&share),
                        "K = {k}, corner {corner}, colour {colour}: {share}"
                    );
                }
            }
        }
    }
}

/// Where there are more directions than clusters, the faintest join others and none is lost.
#[test]
fn many_directions_are_laid_together() {
    let directions = Directions::new(64).expect("a number of the paper");
    let moments = [0, 1, 2].map(|corner| uneven(&directions, 100_000 * corner));
    // Corners turned apart, as on a strongly bent face: three times 64 directions.
    let turn = |angle: f32| {
        let (s, c) = angle.sin_cos();
        [Vec3::new(c, 0.0, -s), Vec3::Y, Vec3::new(s, 0.0, c)]
    };
    let frames = [-1.3_f32, 0.0, 1.3].map(turn);
    let found = clusters([0, 1, 2].map(|c| CornerLight {
        frame: frames[c],
        moments: &moments[c],
    }));
    assert_eq!(found.len(), MOST_CLUSTERS as usize);
    let given: DVec3 = frames
        .iter()
        .zip(&moments)
        .map(|(f, m)| {
            let v = vector(m).as_vec3();
            (f[0] * v.x + f[1] * v.y + f[2] * v.z).as_dvec3()
        })
        .sum();
    let carried: DVec3 = light_of(&found).iter().sum();
    assert!(given.distance(carried) < ROUNDING * given.length());
}

/// The faces' clusters under parallel light.
fn lit(scene: &Scene, directions: &Directions, towards: DVec3, strength: Vec3) -> FaceClusters {
    let light = light_on(scene, directions, |frame| {
        parallel(directions, frame, towards, strength)
    });
    let vertices = MesoVertices::new(scene, &Corners::new(scene), &light.elements, &light.frames);
    let gathered = vertices.gather(directions, &light.frames, &light.incident_moment);
    let faces: Vec<_> = (0..light.elements.len() as u32)
        .map(|meso| Face {
            meso,
            corners: [0, 1, 2],
        })
        .collect();
    FaceClusters::new(&vertices, directions, &gathered, &faces)
}

#[test]
fn one_light_is_one_cluster() {
    let towards = DVec3::new(0.3, -0.4, 1.0).normalize();
    let strength = Vec3::new(1.0, 2.0, 0.25);
    let scene = sheet(8, 0.6);
    for k in [16, 32, 64] {
        let directions = Directions::new(k).expect("a number of the paper");
        let found = lit(&scene, &directions, towards, strength);
        assert_eq!(found.ranges.len(), scene.triangles.len());
        for (face, &range) in found.ranges.iter().enumerate() {
            assert_eq!(range, (face as u32, 1), "K = {k}");
            let cluster = found.list[face];
            assert!(f64::from(cluster.towards.distance(towards.as_vec3())) < ROUNDING);
            for fluence in cluster.fluence {
                assert!(
                    f64::from(fluence.distance(strength)) < ROUNDING,
                    "{fluence}"
                );
            }
        }
    }
}

/// Two lights are two clusters just where they are further apart than the threshold.
#[test]
fn the_threshold_parts_lights() {
    let threshold = NEAR_PARALLEL_COS.acos();
    for (angle, count) in [(0.98 * threshold, 1), (1.02 * threshold, 2)] {
        let (s, c) = angle.sin_cos();
        let moments = [vec![
            [Vec3::Z; 3],
            [Vec3::new(s as f32, 0.0, c as f32) * 0.5; 3],
        ]];
        let found = clusters([upright(&moments[0]), upright(&[]), upright(&[])]);
        assert_eq!(found.len(), count, "{angle} radians apart");
    }
    assert!(clusters([upright(&[]); 3]).is_empty());
}

#[test]
fn more_directions_give_more_clusters() {
    let counts = [16, 32, 64].map(|k| {
        let directions = Directions::new(k).expect("a number of the paper");
        let moments = uneven(&directions, 5);
        clusters([upright(&moments); 3]).len()
    });
    println!("clusters of K = 16, 32, 64: {counts:?}");
    // Slots are further apart than the threshold, but for those along the border.
    assert!(counts[0] < counts[1] && counts[1] < counts[2], "{counts:?}");
}
