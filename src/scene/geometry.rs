//! The nearest surface along a ray: a bounding volume hierarchy in f32 about exact tests in f64.

use std::time::Duration;

use glam::{DVec2, DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::ray::{Ray, RayHit};
use obvhs::{Boundable, BvhBuildParams};
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::scene::{Scene, Triangle};

/// Distance of a ray's start above its surface, internal units: far above the rounding of f64, also
/// 10⁶ units from the origin, and far below any shape. A back this close behind a front counts as
/// the front's other side.
pub const ABOVE: f64 = 1.0 / (1u64 << 30) as f64;

/// Scale of boxes and their rays over internal units. obvhs skips a box that a ray leaves within
/// its own 10⁻⁴: at this scale every box reaches further beyond its triangle, see `BOX_MARGIN`.
const BOX_SCALE: f64 = 1024.0;

/// Margin of boxes about their triangles: 2⁻¹⁷ internal units, more than the error in f32 of rays
/// of length 4.
const BOX_MARGIN: f32 = BOX_SCALE as f32 / (1u32 << 17) as f32;

/// Half side of the cube, about the scene's own of 1, at which a ray from outside begins.
const CUBE: f64 = 1.0 + 1.0 / 16.0;

/// The scene's triangles in internal units: about the scene's middle, coordinates in −1..1, as
/// [`crate::mesh::elements`] has them.
pub struct Geometry {
    pub origin: DVec3,
    /// Scene units of one internal unit.
    pub unit: f64,
    /// `[triangle]` in the order of the input.
    corners: Vec<[DVec3; 3]>,
    bvh: CwBvh,
}

/// Where a ray ends.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// In the order of the input.
    pub triangle: usize,
    /// Internal units.
    pub place: DVec3,
    /// Unit normal of the front.
    pub normal: DVec3,
    /// Whether the ray came from the front.
    pub front: bool,
    pub distance: f64,
    /// Barycentric weights of the corners.
    weights: [f64; 3],
}

impl Hit {
    /// Interpolates the corners' values at the hit.
    pub fn interpolate(&self, corners: [DVec2; 3]) -> DVec2 {
        (0..3).map(|k| corners[k] * self.weights[k]).sum()
    }
}

struct Bounds<'a>(&'a [DVec3; 3]);

impl Boundable for Bounds<'_> {
    fn aabb(&self) -> Aabb {
        let mut bounds = Aabb::from_points(&self.0.map(|p| (p * BOX_SCALE).as_vec3a()));
        bounds.min -= Vec3A::splat(BOX_MARGIN);
        bounds.max += Vec3A::splat(BOX_MARGIN);
        bounds
    }
}

impl Geometry {
    /// # Errors
    /// A scene without triangles, or with corners that are missing or not finite.
    pub fn new(scene: &Scene) -> Result<Self> {
        Self::built(scene, BvhBuildParams::medium_build())
    }

    /// The same for few rays: made sooner, and slower to ask.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn for_few_rays(scene: &Scene) -> Result<Self> {
        Self::built(scene, BvhBuildParams::fastest_build())
    }

    fn built(scene: &Scene, params: BvhBuildParams) -> Result<Self> {
        let refuse = |what: &str| {
            Err(Error::Scene {
                scene: scene.name.clone(),
                what: what.into(),
            })
        };
        if scene.triangles.is_empty() {
            return refuse("there is no triangle in it");
        }
        let held = |t: &Triangle| {
            (t.material as usize) < scene.materials.len()
                && t.vertices
                    .iter()
                    .all(|&v| (v as usize) < scene.vertices.len())
        };
        if !scene.triangles.iter().all(held) {
            return refuse("a triangle has a corner or a material that is not there");
        }
        let frame @ (origin, unit) = scene.local_frame();
        let corners: Vec<_> = scene
            .triangles
            .par_iter()
            .map(|t| scene.corners(t).map(|p| (p - origin) / unit))
            .collect();
        // A NaN corner would be lost in the bounds of a box.
        if !corners.iter().flatten().all(|p| p.is_finite()) {
            return refuse("a corner is not finite");
        }
        Ok(Self::of(frame, corners, params))
    }

    /// Of other triangles in place of those of a scene that is sound: their corners, scene units.
    #[cfg(feature = "window")]
    pub fn standing_for(scene: &Scene, corners: impl Iterator<Item = [DVec3; 3]>) -> Self {
        let frame @ (origin, unit) = scene.local_frame();
        let mut corners: Vec<_> = corners.map(|c| c.map(|p| (p - origin) / unit)).collect();
        if corners.is_empty() {
            // No ray meets a triangle without area.
            corners.push([DVec3::ZERO; 3]);
        }
        Self::of(frame, corners, BvhBuildParams::medium_build())
    }

    /// Of corners in this frame.
    fn of((origin, unit): (DVec3, f64), corners: Vec<[DVec3; 3]>, params: BvhBuildParams) -> Self {
        let bounds: Vec<_> = corners.iter().map(Bounds).collect();
        let bvh = build_cwbvh(&bounds, params, &mut Duration::default());
        Self {
            origin,
            unit,
            corners,
            bvh,
        }
    }

    /// Scene units to internal ones.
    pub fn inside(&self, place: DVec3) -> DVec3 {
        (place - self.origin) / self.unit
    }

    /// Of all triangles, internal units squared.
    pub fn area(&self) -> f64 {
        let area = |[a, b, c]: &[DVec3; 3]| 0.5 * (*b - *a).cross(*c - *a).length();
        self.corners.iter().map(area).sum()
    }

    /// Corners of a triangle, internal units.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.corners[triangle]
    }

    /// The nearest surface from `from` along the unit vector `direction`. Where a front and a back
    /// coincide, it is the side that faces the ray.
    pub fn hit(&self, from: DVec3, direction: DVec3) -> Option<Hit> {
        let skipped = distance_to_cube(from, direction)?;
        let start = from + skipped * direction;
        let mut nearest = f64::INFINITY;
        let mut best = None;
        let ray = box_ray(start, direction);
        self.bvh.ray_traverse(ray, &mut RayHit::none(), |_, place| {
            let triangle = self.bvh.primitive_indices[place] as usize;
            let Some(crossing) = Crossing::of(&self.corners[triangle], start, direction) else {
                return f32::INFINITY;
            };
            let rank = crossing.distance + if crossing.front { 0.0 } else { 2.0 * ABOVE };
            if rank >= nearest {
                return f32::INFINITY;
            }
            nearest = rank;
            best = Some((triangle, crossing));
            (rank * BOX_SCALE) as f32
        });
        let (triangle, crossing) = best?;
        let [a, b, c] = self.corners[triangle];
        let [wa, wb, wc] = crossing.weights;
        Some(Hit {
            triangle,
            place: a * wa + b * wb + c * wc,
            normal: (b - a).cross(c - a).normalize_or_zero(),
            front: crossing.front,
            distance: skipped + crossing.distance,
            weights: crossing.weights,
        })
    }

    /// Whether nothing stands between two places, neither of which is on a surface.
    pub fn sees(&self, from: DVec3, to: DVec3) -> bool {
        let length = from.distance(to);
        let direction = (to - from) / length;
        let Some(skipped) = distance_to_cube(from, direction) else {
            return true;
        };
        let start = from + skipped * direction;
        let ray = box_ray(start, direction);
        self.bvh.ray_traverse_miss(ray, |_, place| {
            let triangle = self.bvh.primitive_indices[place] as usize;
            match Crossing::of(&self.corners[triangle], start, direction) {
                Some(crossing) if skipped + crossing.distance < length => 0.0,
                _ => f32::INFINITY,
            }
        })
    }
}

/// A ray in the scale of the boxes.
fn box_ray(start: DVec3, direction: DVec3) -> Ray {
    let start = (start * BOX_SCALE).as_vec3a();
    Ray::new(start, direction.as_vec3a(), 0.0, f32::INFINITY)
}

struct Crossing {
    distance: f64,
    front: bool,
    weights: [f64; 3],
}

impl Crossing {
    /// The two triangles of an edge compute the same volume with opposite signs, to the bit: no ray
    /// passes between them.
    fn of(corners: &[DVec3; 3], from: DVec3, direction: DVec3) -> Option<Self> {
        let [a, b, c] = corners.map(|p| p - from);
        let volumes = [
            direction.dot(b.cross(c)),
            direction.dot(c.cross(a)),
            direction.dot(a.cross(b)),
        ];
        let ahead = volumes.iter().all(|&v| v >= 0.0);
        if !ahead && !volumes.iter().all(|&v| v <= 0.0) {
            return None;
        }
        let whole: f64 = volumes.iter().sum();
        if whole == 0.0 {
            return None;
        }
        let weights = volumes.map(|v| v / whole);
        let distance = (a * weights[0] + b * weights[1] + c * weights[2]).dot(direction);
        // A negative volume: the corners run counter-clockwise as the ray sees them.
        (distance > 0.0).then_some(Self {
            distance,
            front: !ahead,
            weights,
        })
    }
}

/// Distance to the cube about the scene, 0 from within it; None for a ray that misses it or is not
/// finite.
fn distance_to_cube(from: DVec3, direction: DVec3) -> Option<f64> {
    if !from.is_finite() || !direction.is_normalized() {
        return None;
    }
    let (mut first, mut last) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        let (p, d) = (from[axis], direction[axis]);
        if d == 0.0 {
            if p.abs() > CUBE {
                return None;
            }
            continue;
        }
        let ends = [(-CUBE - p) / d, (CUBE - p) / d];
        first = first.max(ends[0].min(ends[1]));
        last = last.min(ends[0].max(ends[1]));
    }
    (first <= last).then_some(first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampling::{Random, cosine_direction};
    use crate::scene::Material;

    /// Groups of triangles of every size about one place, half of them perpendicular to an axis,
    /// and rays from their surfaces: the same as by trying every triangle.
    #[test]
    fn boxes_lose_nothing() {
        let mut random = Random::new(0, 0, 0);
        let mut scene = Scene {
            materials: vec![Material::default()],
            ..Scene::default()
        };
        let mut middle = DVec3::ZERO;
        for i in 0..300 {
            let mut place = || DVec3::new(random.unit(), random.unit(), random.unit());
            let size = 10_f64.powf(-6.0 * place().x);
            if i % 10 == 0 {
                middle = place();
            }
            for _ in 0..3 {
                let mut corner = middle + size * place();
                if i % 2 == 0 {
                    corner[i / 2 % 3] = middle[i / 2 % 3] + 0.5 * size;
                }
                scene.vertices.push(corner);
            }
            let first = 3 * i as u32;
            scene.triangles.push(Triangle {
                vertices: [first, first + 1, first + 2],
                uv: [[0.0; 2]; 3],
                emission_uv: None,
                light_uv: None,
                material: 0,
            });
        }
        let geometry = Geometry::new(&scene).expect("the scene is good");
        let mut hits = 0;
        for i in 0..20_000 {
            let [a, b, c] = geometry.corners(i % 300);
            let normal = (b - a).cross(c - a).normalize();
            let from = (a + b + c) / 3.0 + ABOVE * normal;
            let direction = cosine_direction(normal, random.square());
            let all = geometry
                .corners
                .iter()
                .enumerate()
                .filter_map(|(t, corners)| {
                    Some((t, Crossing::of(corners, from, direction)?.distance))
                });
            let nearest = all.min_by(|a, b| a.1.total_cmp(&b.1));
            let found = geometry.hit(from, direction);
            assert_eq!(found.map(|hit| hit.triangle), nearest.map(|n| n.0));
            if let Some((_, distance)) = nearest {
                hits += 1;
                assert!(geometry.sees(from, from + direction * (distance * (1.0 - 1e-7))));
                assert!(!geometry.sees(from, from + direction * (distance * (1.0 + 1e-7))));
            }
        }
        assert!(hits > 2000, "{hits}");
    }
}
