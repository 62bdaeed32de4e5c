//! Clusters of near-parallel light on a face: the paper's way of drawing relief. The light by slots
//! of the face's three vertices becomes a few parallel lights, each of which one march over the
//! height map shadows.

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use super::meso_vertices::MesoVertices;
use crate::constants::{MOST_CLUSTERS, MOST_DIRECTIONS};
use crate::math::directions::Directions;

/// Cosine of 12°, the greatest angle between a cluster's strongest moment and the others that join
/// it. The angle is above 10°, the farthest a moment of K = 64 strays from its slot's middle, so
/// that a slot's light at the three vertices is one cluster; and below 18°, the angle between
/// middles of neighbouring slots, so that those stay apart.
pub const NEAR_PARALLEL_COS: f64 = 0.978_147_600_733_806;

/// A parallel light on a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cluster {
    /// Towards the light, unit, along the world's axes.
    pub towards: Vec3,
    /// Fluence Φ at the face's corners a, b and c, RGB, W·m⁻²: the light there is Φ · `towards` as
    /// a vector. Over all corners and colours, its sum is that of the moments in the cluster.
    pub fluence: [Vec3; 3],
}

/// Moments of one slot of one corner, along the world's axes.
struct Bundle {
    corner: usize,
    /// RGB.
    moment: [DVec3; 3],
    /// Sum over the colours.
    whole: DVec3,
    /// Length of `whole`.
    strength: f64,
}

/// A cluster while moments are added to it.
struct Growing {
    /// Direction of the strongest bundle, unit.
    leader: DVec3,
    sum: DVec3,
    /// `[corner][colour]`
    moments: [[DVec3; 3]; 3],
}

impl Growing {
    fn new(leader: DVec3) -> Self {
        Self {
            leader,
            sum: DVec3::ZERO,
            moments: [[DVec3::ZERO; 3]; 3],
        }
    }

    fn take(&mut self, bundle: &Bundle) {
        self.sum += bundle.whole;
        for (sum, moment) in self.moments[bundle.corner].iter_mut().zip(bundle.moment) {
            *sum += moment;
        }
    }

    fn finish(&self) -> Option<Cluster> {
        let towards = self.sum.try_normalize()?;
        Some(Cluster {
            towards: towards.as_vec3(),
            fluence: self
                .moments
                .map(|colours| DVec3::from(colours.map(|m| m.dot(towards))).as_vec3()),
        })
    }
}

/// Light at one corner of a face.
#[derive(Debug, Clone, Copy)]
pub struct CornerLight<'a> {
    /// Tangent, bitangent and normal.
    pub frame: [Vec3; 3],
    /// Vector moments in that frame, `[slot][colour]`, W·m⁻².
    pub moments: &'a [[Vec3; 3]],
}

/// The clusters of one face from the light at its corners.
///
/// From the strongest moment to the faintest, each joins the cluster whose leader (its strongest
/// moment) is nearest in direction, if that is within [`NEAR_PARALLEL_COS`]; otherwise it starts a
/// new cluster. Once there are [`MOST_CLUSTERS`], the remaining, faintest moments join the nearest
/// cluster at any angle, so that no light is left out.
pub fn clusters(corners: [CornerLight<'_>; 3]) -> Vec<Cluster> {
    let mut bundles = Vec::with_capacity(3 * MOST_DIRECTIONS as usize);
    for (corner, light) in corners.into_iter().enumerate() {
        let [t, b, n] = light.frame.map(Vec3::as_dvec3);
        let to_world = DMat3::from_cols(t, b, n);
        for slot in light.moments {
            let moment = slot.map(|m| to_world * m.as_dvec3());
            let whole = moment[0] + moment[1] + moment[2];
            let strength = whole.length();
            if strength > 0.0 {
                bundles.push(Bundle {
                    corner,
                    moment,
                    whole,
                    strength,
                });
            }
        }
    }
    // Stable, so that equal ones keep the order of corners and slots.
    bundles.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    let mut growing: Vec<Growing> = Vec::new();
    for bundle in &bundles {
        let direction = bundle.whole / bundle.strength;
        let full = growing.len() == MOST_CLUSTERS as usize;
        let nearest = growing
            .iter_mut()
            .map(|c| (c.leader.dot(direction), c))
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(cosine, _)| full || *cosine >= NEAR_PARALLEL_COS);
        match nearest {
            Some((_, cluster)) => cluster.take(bundle),
            None => {
                let mut cluster = Growing::new(direction);
                cluster.take(bundle);
                growing.push(cluster);
            }
        }
    }
    growing.iter().filter_map(Growing::finish).collect()
}

/// A meso element whose clusters are wanted.
#[derive(Debug, Clone, Copy)]
pub struct Face {
    /// Index of the meso element.
    pub meso: u32,
    /// Its corners in the order of [`Cluster::fluence`].
    pub corners: [usize; 3],
}

/// The clusters of faces, one face after the other.
pub struct FaceClusters {
    pub list: Vec<Cluster>,
    /// First cluster and number of clusters, `[face]`.
    pub ranges: Vec<(u32, u32)>,
}

impl FaceClusters {
    /// The clusters of `faces` under `moments`, `[vertex][slot][colour]` as from
    /// [`MesoVertices::gather`].
    pub fn new(
        vertices: &MesoVertices,
        directions: &Directions,
        moments: &[[Vec3; 3]],
        faces: &[Face],
    ) -> Self {
        let k = directions.count();
        let of_faces: Vec<Vec<Cluster>> = faces
            .par_iter()
            .map(|face| {
                clusters(face.corners.map(|corner| {
                    let vertex = vertices.corners[face.meso as usize][corner] as usize;
                    CornerLight {
                        frame: vertices.frames[vertex],
                        moments: &moments[vertex * k..][..k],
                    }
                }))
            })
            .collect();
        let mut first = 0;
        let ranges = of_faces
            .iter()
            .map(|clusters| {
                let range = (first, clusters.len() as u32);
                first += range.1;
                range
            })
            .collect();
        Self {
            list: of_faces.concat(),
            ranges,
        }
    }
}
