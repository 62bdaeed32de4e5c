//! Light by direction at the vertices of a surface with a relief, gathered from the elements about
//! them: the paper's Figure 1, from slots to slots between the frames of neighbours.

use std::collections::HashMap;

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

impl MesoVertices {
    /// The vertices of the meso elements that are the triangles `elements` of the scene; `frames`
    /// are their tangents, bitangents and normals. Both are `[meso element]`.
    pub fn new(scene: &Scene, elements: &[u32], frames: &[[Vec3; 3]]) -> Self {
        let meso: HashMap<usize, u32> =
            (0..).zip(elements).map(|(m, &e)| (e as usize, m)).collect();
        let neighbours = Corners::new(scene);
        let frame = |m: u32| frames[m as usize].map(Vec3::as_dvec3);
        let turn = |[t, b, n]: [DVec3; 3]| t.cross(b).dot(n) > 0.0;
        let mut known: HashMap<(u32, Vec<u32>), u32> = HashMap::new();
        let mut vertices = Self {
            frames: Vec::new(),
            corners: Vec::with_capacity(elements.len()),
            around: Vec::new(),
        };
        for (m, &e) in (0_u32..).zip(elements) {
            let triangle = &scene.triangles[e as usize];
            let own = frame(m);
            let corners = [0, 1, 2].map(|corner| {
                let vertex = triangle.vertices[corner];
                let around: Vec<(u32, f64)> = neighbours
                    .smooth(e as usize, corner)
                    .filter_map(|(other, angle)| Some((*meso.get(&other)?, other, angle)))
                    .filter(|&(n, other, _)| {
                        let theirs = frame(n);
                        n == m
                            || (scene.triangles[other].material == triangle.material
                                && theirs[0].dot(own[0]) >= SEAM_COS
                                && turn(theirs) == turn(own))
                    })
                    .map(|(n, _, angle)| (n, angle))
                    .collect();
                let key = (vertex, around.iter().map(|a| a.0).collect());
                *known
                    .entry(key)
                    .or_insert_with(|| vertices.push(around, frame, own))
            });
            vertices.corners.push(corners);
        }
        vertices
    }

    fn push(
        &mut self,
        mut around: Vec<(u32, f64)>,
        frame: impl Fn(u32) -> [DVec3; 3],
        own: [DVec3; 3],
    ) -> u32 {
        let whole: f64 = around.iter().map(|a| a.1).sum();
        let count = around.len() as f64;
        for (_, weight) in &mut around {
            *weight = if whole > 0.0 {
                *weight / whole
            } else {
                1.0 / count
            };
        }
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
        self.frames
            .push([tangent, bitangent, normal].map(|v| v.as_vec3()));
        self.around.push(around);
        self.frames.len() as u32 - 1
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
