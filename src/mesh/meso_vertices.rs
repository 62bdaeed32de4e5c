//! Light by direction at the vertices of a surface with a relief, gathered from the elements about
//! them: the paper's Figure 1, from slots to slots between the frames of neighbours.

use glam::{DVec3, Mat3A, Vec3, Vec3A};
use rayon::prelude::*;

use super::corners::Corners;
use crate::math::directions::Directions;
use crate::scene::Scene;

/// Cosine of 45°: between elements whose tangents are further apart there is a seam of the texture
/// coordinates.
const SEAM_COS: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The vertices of meso elements, shared by elements whose surface and texture continue each other.
pub struct MesoVertices {
    /// Tangent, bitangent and normal, `[vertex]`: mean of the elements' about it weighted by angle,
    /// made orthonormal; the same on both sides of a shared edge.
    pub frames: Vec<[Vec3; 3]>,
    /// The vertex of each corner, `[meso element][corner]`.
    pub corners: Vec<[u32; 3]>,
    /// Meso elements about each vertex, with weights that sum to 1.
    around: Vec<Vec<(u32, f64)>>,
}

fn elements_of(around: &[(u32, f64)]) -> impl Iterator<Item = u32> {
    around.iter().map(|&(m, _)| m)
}

/// Makes weights sum to 1.
fn normalize(around: &mut [(u32, f64)]) {
    let whole: f64 = around.iter().map(|a| a.1).sum();
    let count = around.len() as f64;
    for (_, weight) in around {
        *weight = if whole > 0.0 {
            *weight / whole
        } else {
            1.0 / count
        };
    }
}

/// The mean of elements' frames, made orthonormal; the axes of `own` stand in for what has none.
fn mean_frame(
    around: &[(u32, f64)],
    frame: impl Fn(u32) -> [DVec3; 3],
    own: [DVec3; 3],
) -> [Vec3; 3] {
    let mean = |axis: usize| -> DVec3 {
        around
            .iter()
            .map(|&(n, weight)| frame(n)[axis] * weight)
            .sum()
    };
    let normal = mean(2).try_normalize().unwrap_or(own[2]);
    let tangent = mean(0);
    let tangent = (tangent - normal * normal.dot(tangent))
        .try_normalize()
        .unwrap_or(own[0]);
    let bitangent = normal.cross(tangent);
    let bitangent = if bitangent.dot(own[1]) < 0.0 {
        -bitangent
    } else {
        bitangent
    };
    [tangent, bitangent, normal].map(|v| v.as_vec3())
}

impl MesoVertices {
    /// The vertices of the meso elements that are the triangles `elements` of the scene with these
    /// `neighbours`; `frames` are their tangents, bitangents and normals. Both are
    /// `[meso element]`.
    pub fn new(
        scene: &Scene,
        neighbours: &Corners,
        elements: &[u32],
        frames: &[[Vec3; 3]],
    ) -> Self {
        let mut meso = vec![None; scene.triangles.len()];
        for (m, &e) in (0..).zip(elements) {
            meso[e as usize] = Some(m);
        }
        let smooth = neighbours.smooth();
        let frame = |m: u32| frames[m as usize].map(Vec3::as_dvec3);
        let turn = |[t, b, n]: [DVec3; 3]| t.cross(b).dot(n) > 0.0;
        let about = |(m, &e): (usize, &u32)| {
            let material = scene.triangles[e as usize].material;
            let (m, own) = (m as u32, frame(m as u32));
            let continues = |&(n, other, _): &(u32, usize, f64)| {
                let theirs = frame(n);
                n == m
                    || (scene.triangles[other].material == material
                        && theirs[0].dot(own[0]) >= SEAM_COS
                        && turn(theirs) == turn(own))
            };
            [0, 1, 2].map(|corner| {
                let all = smooth.about(e as usize, corner);
                let all = all.filter_map(|(other, angle)| Some((meso[other]?, other, angle)));
                all.filter(continues)
                    .map(|(n, _, angle)| (n, angle))
                    .collect()
            })
        };
        let found: Vec<[Vec<(u32, f64)>; 3]> = elements.par_iter().enumerate().map(about).collect();
        // Of each vertex of the scene.
        let mut known: Vec<Vec<u32>> = vec![Vec::new(); scene.vertices.len()];
        let mut around: Vec<Vec<(u32, f64)>> = Vec::new();
        // Whose axes stand in for what has no mean, `[vertex]`.
        let mut first = Vec::new();
        let mut index = |vertex: u32, m: u32, found: Vec<(u32, f64)>| {
            let known = &mut known[vertex as usize];
            let same = |&&v: &&u32| elements_of(&around[v as usize]).eq(elements_of(&found));
            if let Some(&v) = known.iter().find(same) {
                return v;
            }
            let v = around.len() as u32;
            known.push(v);
            around.push(found);
            first.push(m);
            v
        };
        let corners = (0_u32..).zip(elements).zip(found);
        let corners: Vec<[u32; 3]> = corners
            .map(|((m, &e), [a, b, c])| {
                let [at_a, at_b, at_c] = scene.triangles[e as usize].vertices;
                [index(at_a, m, a), index(at_b, m, b), index(at_c, m, c)]
            })
            .collect();
        around.par_iter_mut().for_each(|around| normalize(around));
        let frames = around.par_iter().zip(&first);
        Self {
            frames: frames
                .map(|(around, &m)| mean_frame(around, frame, frame(m)))
                .collect(),
            corners,
            around,
        }
    }

    /// Weighted means at the vertices, `[vertex][slot]`, of the elements' `values`,
    /// `[meso element][slot]`. The elements' frames are taken for the vertex's. `k` is the number
    /// of slots.
    pub fn mean(&self, values: &[Vec3], k: usize) -> Vec<Vec3> {
        self.around
            .par_iter()
            .flat_map_iter(|around| {
                (0..k).map(|slot| {
                    let value = |&(m, weight): &(u32, f64)| {
                        values[m as usize * k + slot].as_dvec3() * weight
                    };
                    around.iter().map(value).sum::<DVec3>().as_vec3()
                })
            })
            .collect()
    }

    /// Vector moments at the vertices, `[vertex][slot][colour]`, from those of the elements,
    /// `[meso element][slot][colour]`, W·m⁻². `frames` are the elements', as given to
    /// [`Self::new`].
    ///
    /// A moment is turned as a vector from the element's frame into the vertex's and is added to
    /// the slot that it then points into, so that the light as a vector is kept. A moment below the
    /// vertex's horizon is projected onto the horizon.
    pub fn gather(
        &self,
        directions: &Directions,
        frames: &[[Vec3; 3]],
        moments: &[[Vec3; 3]],
    ) -> Vec<[Vec3; 3]> {
        let k = directions.count();
        let columns = |[t, b, n]: [Vec3; 3]| Mat3A::from_cols(t.into(), b.into(), n.into());
        let mut all = vec![[Vec3::ZERO; 3]; self.frames.len() * k];
        let of_vertices = all.par_chunks_mut(k).zip(&self.frames).zip(&self.around);
        of_vertices.for_each(|((sums, &frame), around)| {
            let to_vertex = columns(frame).transpose();
            for &(m, weight) in around {
                let turn = to_vertex * columns(frames[m as usize]);
                for moment in &moments[m as usize * k..][..k] {
                    // One slot for the colours: they are fitted together.
                    let whole = turn * Vec3A::from(moment[0] + moment[1] + moment[2]);
                    let Some(towards) = whole.as_dvec3().try_normalize() else {
                        continue;
                    };
                    let sum = &mut sums[directions.slot_of(towards)];
                    for (sum, &colour) in sum.iter_mut().zip(moment) {
                        let turned = Vec3::from(turn * Vec3A::from(colour));
                        *sum += weight as f32 * turned.with_z(turned.z.max(0.0));
                    }
                }
            }
        });
        all
    }
}
