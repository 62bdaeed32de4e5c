//! Lamps as shafts know them: where shadow rays end.

use glam::DVec3;

use super::convex::outline;
use super::lights::sun_disc;
use crate::scene::Scene;

/// Most lamps, and so most shafts of a triangle; scenes with more lamps use no shafts.
pub const MOST_LAMPS: usize = 8;
/// Shadow rays end above an emitter by this share of the greatest coordinate: ABOVE of
/// `shared/light_points.glsl`.
const ABOVE: f64 = 3.8e-6;

/// Emitters in one plane that face alike, or a point light.
pub struct Lamp {
    /// Shadow rays end in the hull of these points.
    pub ends: Vec<DVec3>,
    pub plane: Option<LampPlane>,
}

/// The plane of emitters, n·x = `offset`, from which they shine along `normal`.
pub struct LampPlane {
    pub normal: DVec3,
    pub offset: f64,
    /// Distance of the nearest end.
    pub above: f64,
}

/// The lamps of a scene, whose places `seen` gives; none where they are more than [`MOST_LAMPS`].
pub fn lamps(scene: &Scene, seen: impl Fn(DVec3) -> DVec3) -> Vec<Lamp> {
    let mut lamps: Vec<_> = emitters(scene, &seen).iter().map(|l| l.lamp()).collect();
    lamps.extend(scene.lights.points.iter().map(|light| Lamp {
        ends: vec![seen(light.position)],
        plane: None,
    }));
    lamps.extend(scene.lights.suns.iter().map(|sun| {
        Lamp {
            // The other corners are the middle, and those of the next triangle.
            ends: (sun_disc(scene, sun).iter())
                .map(|&[_, corner, _]| seen(corner))
                .collect(),
            plane: None,
        }
    }));
    if lamps.len() > MOST_LAMPS {
        lamps.clear();
    }
    lamps
}

/// Emitters by the planes that they lie in, up to one more than [`MOST_LAMPS`].
fn emitters(scene: &Scene, seen: impl Fn(DVec3) -> DVec3) -> Vec<FlatEmitter> {
    let mut all: Vec<FlatEmitter> = Vec::new();
    for t in &scene.triangles {
        if !scene.materials[t.material as usize].emits() {
            continue;
        }
        let corners = scene.corners(t).map(&seen);
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        if normal == DVec3::ZERO {
            continue;
        }
        match all.iter_mut().find(|l| l.holds(corners, normal)) {
            Some(lamp) => lamp.corners.extend(corners),
            None => all.push(FlatEmitter {
                normal,
                corners: corners.to_vec(),
            }),
        }
        // A round lamp counts as one lamp per triangle, which soon exceeds the limit.
        if all.len() > MOST_LAMPS {
            break;
        }
    }
    all
}

/// Emitters in a plane, relative to the eye.
struct FlatEmitter {
    normal: DVec3,
    corners: Vec<DVec3>,
}

/// Largest distance of f64 positions from their common plane, as a share of the distance from the
/// eye.
const FLAT: f64 = 1e-9;

impl FlatEmitter {
    fn holds(&self, corners: [DVec3; 3], normal: DVec3) -> bool {
        let far = self.corners[0].abs().max_element();
        let off = |p: DVec3| self.normal.dot(p - self.corners[0]).abs();
        normal.dot(self.normal) > 1.0 - FLAT && corners.into_iter().all(|p| off(p) < FLAT * far)
    }

    /// The smallest rectangle about it: one along an edge of its outline.
    fn lamp(&self) -> Lamp {
        let (x, y) = self.normal.any_orthonormal_pair();
        let flat = |p: &DVec3| DVec3::new(x.dot(*p), y.dot(*p), 0.0);
        let flat: Vec<DVec3> = self.corners.iter().map(flat).collect();
        let edges = outline(&flat, 0, 1);
        let extent = |axis: DVec3| {
            let places = edges.iter().map(|(p, _)| axis.dot(*p));
            places.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)))
        };
        let rectangles = edges.iter().map(|(from, to)| {
            let along = (to - from).normalize_or_zero();
            let across = DVec3::Z.cross(along);
            let (u, v) = (extent(along), extent(across));
            (along, across, u, v)
        });
        let area =
            |&(_, _, u, v): &(DVec3, DVec3, (f64, f64), (f64, f64))| (u.1 - u.0) * (v.1 - v.0);
        let smallest = rectangles.min_by(|a, b| area(a).total_cmp(&area(b)));
        let (along, across, u, v) = smallest.unwrap_or_default();
        let offset = self.normal.dot(self.corners[0]);
        let corner = |u: f64, v: f64| {
            let p = along * u + across * v;
            x * p.x + y * p.y + self.normal * offset
        };
        let corners = [
            corner(u.0, v.0),
            corner(u.1, v.0),
            corner(u.1, v.1),
            corner(u.0, v.1),
        ];
        // The greatest coordinate of any point between the corners lies between these.
        let low = corners.into_iter().reduce(DVec3::min).unwrap_or_default();
        let high = corners.into_iter().reduce(DVec3::max).unwrap_or_default();
        let nearest = low.max(-high).max(DVec3::ZERO).max_element();
        let furthest = low.abs().max(high.abs()).max_element();
        let raised = |by: f64| corners.map(|c| c + self.normal * (ABOVE * by));
        Lamp {
            ends: [raised(nearest), raised(furthest)].concat(),
            plane: Some(LampPlane {
                normal: self.normal,
                offset,
                above: ABOVE * nearest,
            }),
        }
    }
}
