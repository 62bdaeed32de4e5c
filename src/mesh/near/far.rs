//! Parts of a source as places see them from afar, where four points or one stand for them.

use glam::{DVec3, Vec3};

use super::parts::{Part, PartTree};
use super::seen::ABOVE;

/// A part further off than this many of its radii, and wholly above the receiver's horizon, counts
/// as four points with its moments of area up to the second.
const AS_POINTS: f64 = 3.0;

/// A part further off than this many of its radii counts as one point where a form factor within
/// [`super::seen::ROUGH`] of the true one will do.
const AS_ROUGH_POINT: f64 = 2.5;

/// Of a part that crosses a horizon: the share of its height above the lowest it may have that
/// counts as its height, at least.
const CROSSES: f64 = 0.15;

/// Sine of the largest angle between a part's axis and a member's normal, for a part that is not in
/// one plane to count as a far.
const NARROW: f32 = 0.1;

/// As [`NARROW`], where a form factor within [`super::seen::ROUGH`] of the true one will do.
const NARROW_ROUGHLY: f32 = 0.7;

/// All parts of a source.
pub(super) struct Afar {
    /// `[part]`
    parts: Vec<Far>,
    /// Corners of boxes that hold them, `[part]`: apart, because few are asked for.
    boxes: Vec<[DVec3; 2]>,
}

/// A part as seen from afar.
#[derive(Debug, Clone, Copy, Default)]
struct Far {
    /// Centroid of the area.
    centre: DVec3,
    /// Of a ball about the centre that holds such a ball of each member.
    radius: f64,
    area: f64,
    /// Sum of area times normal.
    vector_area: DVec3,
    /// [`front`] of it as it counts as points, times its area.
    front: f64,
    /// The four points `centre` ± a ± b have the second moments of its area.
    spread: [Vec3; 2],
    /// Sine of the largest angle between the axis and a member's normal; 0 of a part in one plane,
    /// and more than 1 of one that turns further than a right angle.
    turned: f32,
}

/// A part as seen from a place, where that takes no more than its four points.
enum View {
    Nothing,
    Points {
        /// From the place to its centre.
        way: DVec3,
        /// Of its form factor, what each point counts for beside its distance.
        share: f64,
    },
}

impl Afar {
    /// Of members in the order of their tree, which lie in one `plane` or not.
    pub fn new(
        tree: &PartTree,
        triangles: &[[DVec3; 3]],
        normals: impl Iterator<Item = DVec3>,
        plane: bool,
    ) -> Self {
        let members: Vec<Far> = (triangles.iter().zip(normals))
            .map(|(triangle, normal)| Far::of_member(triangle, normal))
            .collect();
        let mut parts = vec![Far::default(); tree.part_count()];
        let mut boxes = vec![[DVec3::ZERO; 2]; tree.part_count()];
        if !members.is_empty() {
            fill(tree.whole(), &members, plane, &mut parts);
            enclose(tree.whole(), triangles, &mut boxes);
        }
        Self { parts, boxes }
    }

    /// Form factor from a place with this normal to a part; none where it does not count as points.
    pub fn factor(&self, part: Part, p: DVec3, n: DVec3) -> Option<f64> {
        let far = &self.parts[part.index];
        match far.view(&self.boxes[part.index], p, n)? {
            View::Nothing => Some(0.0),
            View::Points { way, share } => Some(share * far.sum(way, |v| v.dot(n)).max(0.0)),
        }
    }

    /// [`Self::factor`] as a vector.
    pub fn vector(&self, part: Part, p: DVec3, n: DVec3) -> Option<DVec3> {
        let far = &self.parts[part.index];
        match far.view(&self.boxes[part.index], p, n)? {
            View::Nothing => Some(DVec3::ZERO),
            View::Points { way, share } => Some(share * far.sum(way, |v| v)),
        }
    }

    /// About the form factor, rather too large than too small; none where the part does not count
    /// as a point.
    pub fn roughly(&self, part: Part, p: DVec3, n: DVec3) -> Option<f64> {
        self.parts[part.index].roughly(&self.boxes[part.index], p, n)
    }

    /// Centroid of a part's area.
    pub fn centre(&self, part: Part) -> DVec3 {
        self.parts[part.index].centre
    }

    /// Of a ball about its centre that holds a part.
    pub fn radius(&self, part: Part) -> f64 {
        self.parts[part.index].radius
    }
}

impl Far {
    fn of_member(triangle: &[DVec3; 3], normal: DVec3) -> Self {
        let [a, b, c] = *triangle;
        let centre = centroid(triangle);
        let area = 0.5 * (b - a).cross(c - a).length();
        let distances = triangle.map(|v| v.distance(centre));
        Self {
            centre,
            radius: distances.into_iter().fold(0.0, f64::max),
            area,
            vector_area: area * normal,
            front: 0.0,
            spread: spread(normal, triangle.map(|v| (v - centre) / 12_f64.sqrt())),
            turned: 0.0,
        }
    }

    /// Of a part, which lies in one plane or not.
    fn of_part(members: &[Self], plane: bool) -> Self {
        let area: f64 = members.iter().map(|m| m.area).sum();
        let weighted: DVec3 = members.iter().map(|m| m.area * m.centre).sum();
        let centre = weighted / area;
        let vector_area: DVec3 = members.iter().map(|m| m.vector_area).sum();
        let radii = members.iter().map(|m| m.centre.distance(centre) + m.radius);
        let axis = vector_area.normalize_or_zero();
        let moments = members.iter().flat_map(|m| {
            let [a, b] = m.spread;
            let [a, b] = [a, b].map(|v| v.as_dvec3());
            [m.centre - centre, a, b].map(|v| v * (m.area / area).sqrt())
        });
        let spread = spread(axis, moments);
        let cosines = members.iter().map(|m| m.vector_area.dot(axis) / m.area);
        let cosine = cosines.fold(1.0, f64::min);
        let sine = (1.0 - cosine * cosine).sqrt();
        let turned = match plane {
            true => 0.0,
            false if cosine <= 0.0 => 2.0,
            // Members at several heights may face one way.
            false => sine.max(1e-9),
        };
        Self {
            centre,
            radius: radii.fold(0.0, f64::max),
            area,
            vector_area,
            front: area * front(turned, 1.0 / AS_POINTS),
            spread,
            turned: turned as f32,
        }
    }

    /// From a place with this normal; none where the part does not count as points.
    fn view(&self, bounds: &[DVec3; 2], p: DVec3, n: DVec3) -> Option<View> {
        let way = self.centre - p;
        let facing = -way.dot(self.vector_area);
        let is_plane = self.turned == 0.0;
        if is_plane && facing <= ABOVE * self.area {
            return Some(View::Nothing);
        }
        // The box is read only where the plane of the horizon cuts the ball.
        let height = way.dot(n);
        let crosses = height.abs() < self.radius;
        if height <= -self.radius || crosses && is_above(bounds, p, -n) {
            return Some(View::Nothing);
        }
        let square = way.length_squared();
        let least = AS_POINTS * self.radius;
        if square <= least * least || self.turned > NARROW {
            return None;
        }
        if !is_plane && facing * facing <= self.front * self.front * square {
            return None;
        }
        if facing <= 0.0 {
            return Some(View::Nothing);
        }
        let share = facing / (4.0 * std::f64::consts::PI);
        (!crosses || is_above(bounds, p, n)).then_some(View::Points { way, share })
    }

    /// Sum over its four points of a linear function of the way to each, over the distance's fourth
    /// power. `way` is that to the centre.
    fn sum<T>(&self, way: DVec3, of: impl Fn(DVec3) -> T) -> T
    where
        T: std::ops::Mul<f64, Output = T> + std::ops::Add<Output = T>,
    {
        let [a, b] = self.spread.map(|v| v.as_dvec3());
        let middle = way.length_squared() + a.length_squared() + b.length_squared();
        let [by_a, by_b, by_both] = [way.dot(a), way.dot(b), a.dot(b)].map(|dot| 2.0 * dot);
        let [pp, pm, mp, mm] = [
            middle + by_a + by_b + by_both,
            middle + by_a - by_b - by_both,
            middle - by_a + by_b - by_both,
            middle - by_a - by_b + by_both,
        ]
        .map(|square| 1.0 / (square * square));
        of(way) * (pp + pm + mp + mm) + of(a) * (pp + pm - mp - mm) + of(b) * (pp - pm + mp - mm)
    }

    /// See [`Afar::roughly`].
    fn roughly(&self, bounds: &[DVec3; 2], p: DVec3, n: DVec3) -> Option<f64> {
        let way = self.centre - p;
        let facing = -way.dot(self.vector_area);
        let is_plane = self.turned == 0.0;
        if is_above(bounds, p, -n) || is_plane && facing <= ABOVE * self.area {
            return Some(0.0);
        }
        let square = way.length_squared();
        let least = AS_ROUGH_POINT * self.radius;
        if square <= least * least || self.turned > NARROW_ROUGHLY {
            return None;
        }
        // Of a part that crosses a horizon, its own or the place's, something is seen.
        let above = |height: f64, most: f64| height.max(CROSSES * (height + most)).max(0.0);
        let facing = match is_plane {
            true => facing,
            false => {
                let front = front(f64::from(self.turned), 1.0 / AS_ROUGH_POINT);
                above(facing, front * self.area * square.sqrt())
            }
        };
        let height = above(way.dot(n), self.radius);
        Some(facing * height / (std::f64::consts::PI * square * square))
    }
}

/// Whether all of a box lies above the horizon of a place with this normal.
fn is_above([low, high]: &[DVec3; 2], p: DVec3, n: DVec3) -> bool {
    let lowest = DVec3::select(n.cmpgt(DVec3::ZERO), *low, *high);
    (lowest - p).dot(n) >= -ABOVE
}

/// Sine of the angle above the plane across a part's axis from which on a place sees the front of
/// every member: the sum of two angles, of which these are the sines: of the part's normals, and
/// under which its radius is seen.
fn front(turned: f64, radius: f64) -> f64 {
    let cosine = |sine: f64| (1.0 - sine * sine).sqrt();
    turned * cosine(radius) + cosine(turned) * radius
}

pub(super) fn centroid(triangle: &[DVec3; 3]) -> DVec3 {
    (triangle[0] + triangle[1] + triangle[2]) / 3.0
}

/// Two vectors across an axis with the second moments of these: a aᵀ + b bᵀ = Σ v vᵀ.
fn spread(axis: DVec3, of: impl IntoIterator<Item = DVec3>) -> [Vec3; 2] {
    let (s, t) = axis
        .try_normalize()
        .unwrap_or(DVec3::Z)
        .any_orthonormal_pair();
    let (mut ss, mut st, mut tt) = (0.0, 0.0, 0.0);
    for v in of {
        let (x, y) = (v.dot(s), v.dot(t));
        (ss, st, tt) = (ss + x * x, st + x * y, tt + y * y);
    }
    // Cholesky's factors.
    let along = ss.sqrt();
    let across = if along > 0.0 { st / along } else { 0.0 };
    let rest = (tt - across * across).max(0.0).sqrt();
    [along * s + across * t, rest * t].map(|v| v.as_vec3())
}

/// Finds how a part and those below it are seen from afar.
fn fill(part: Part, members: &[Far], plane: bool, far: &mut [Far]) {
    far[part.index] = match part.count {
        1 => members[part.first],
        count => {
            for half in part.halves() {
                fill(half, members, plane, far);
            }
            Far::of_part(&members[part.first..part.first + count], plane)
        }
    };
}

/// Finds the boxes of a part and of those below it.
fn enclose(part: Part, triangles: &[[DVec3; 3]], boxes: &mut [[DVec3; 2]]) -> [DVec3; 2] {
    let bounds = match part.count {
        1 => {
            let [a, b, c] = triangles[part.first];
            [a.min(b).min(c), a.max(b).max(c)]
        }
        _ => {
            let [one, other] = part.halves().map(|half| enclose(half, triangles, boxes));
            [one[0].min(other[0]), one[1].max(other[1])]
        }
    };
    boxes[part.index] = bounds;
    bounds
}
