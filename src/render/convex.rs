//! Convex bodies as hulls of points, and half-spaces that bound or cut them.

use glam::DVec3;

/// A half-space: `normal` · x ≤ `limit` inside.
pub struct Side {
    pub normal: DVec3,
    pub limit: f64,
}

impl Side {
    /// The half-space that holds these points and what is up to `margin` further, along a normal.
    pub fn of(points: &[DVec3], normal: DVec3, margin: f64) -> Self {
        let furthest = points.iter().map(|p| normal.dot(*p));
        Self {
            normal,
            limit: margin + furthest.fold(f64::MIN, f64::max),
        }
    }

    /// How far a point lies outside, in lengths of the normal.
    fn over(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.limit
    }

    /// Whether none of these points lies inside.
    pub fn misses(&self, points: &[DVec3]) -> bool {
        points.iter().all(|&p| self.over(p) > 0.0)
    }

    /// Where a way from a point inside to one outside leaves.
    fn between(&self, inside: DVec3, outside: DVec3) -> DVec3 {
        let (first, last) = (self.over(inside), self.over(outside));
        inside + (outside - inside) * (first / (first - last))
    }

    /// What is left of a convex polygon.
    pub fn cut(&self, polygon: &[DVec3]) -> Vec<DVec3> {
        let holds = |p: DVec3| self.over(p) <= 0.0;
        let mut left = Vec::with_capacity(polygon.len() + 1);
        for (i, &from) in polygon.iter().enumerate() {
            let to = polygon[(i + 1) % polygon.len()];
            match (holds(from), holds(to)) {
                (true, true) => left.push(from),
                (true, false) => left.extend([from, self.between(from, to)]),
                (false, true) => left.push(self.between(to, from)),
                (false, false) => (),
            }
        }
        left
    }

    /// Points whose hull is what is left of the hull of some others.
    pub fn cut_hull(&self, points: &[DVec3]) -> Vec<DVec3> {
        let holds = |p: &DVec3| self.over(*p) <= 0.0;
        let (inside, outside): (Vec<_>, Vec<_>) = points.iter().partition(|p| holds(p));
        let mut left = inside.clone();
        for from in inside {
            left.extend(outside.iter().map(|&to| self.between(from, to)));
        }
        left
    }
}

/// Edges of the convex outline of the points along two axes, counter-clockwise: Andrew's monotone
/// chain.
pub fn outline(points: &[DVec3], u: usize, v: usize) -> Vec<(DVec3, DVec3)> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a[u].total_cmp(&b[u]).then(a[v].total_cmp(&b[v])));
    let turns_left = |a: DVec3, b: DVec3, c: DVec3| {
        (b[u] - a[u]) * (c[v] - a[v]) - (b[v] - a[v]) * (c[u] - a[u]) > 0.0
    };
    let half = |points: &mut dyn Iterator<Item = &DVec3>| {
        let mut chain: Vec<DVec3> = Vec::new();
        for &p in points {
            while let [.., a, b] = chain[..]
                && !turns_left(a, b, p)
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain
    };
    let lower = half(&mut sorted.iter());
    let upper = half(&mut sorted.iter().rev());
    let edges = |chain: &[DVec3]| -> Vec<_> { chain.windows(2).map(|w| (w[0], w[1])).collect() };
    [edges(&lower), edges(&upper)].concat()
}

/// The normal of a plane that rays stay above, where some end lower than they start above a plane
/// with this normal: of one that falls from the starts to these ends. It need not touch either.
pub fn lowest_plane(normal: DVec3, starts: &[DVec3], ends: &[DVec3]) -> Option<DVec3> {
    let least = |points: &[DVec3], along: DVec3| {
        let places = points.iter().map(|p| along.dot(*p));
        places.fold(f64::MAX, f64::min)
    };
    let from = least(starts, normal);
    let is_low = |e: &DVec3| normal.dot(*e) < from;
    let low: Vec<DVec3> = ends.iter().copied().filter(is_low).collect();
    if low.is_empty() {
        return None;
    }
    let middle = |points: &[DVec3]| points.iter().sum::<DVec3>() / points.len() as f64;
    let way = middle(&low) - middle(starts);
    let along = way.reject_from_normalized(normal).try_normalize()?;
    let length = least(&low, along) + least(starts, -along);
    let fall = from - least(&low, normal);
    (length > 0.0).then(|| (normal + along * (fall / length)).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampling::Random;

    /// A point that is a mixture of corners, none of which has a share below 0.
    fn within(corners: &[DVec3], random: &mut Random) -> DVec3 {
        let shares: Vec<f64> = corners.iter().map(|_| random.unit().powi(3)).collect();
        let sum: f64 = shares.iter().sum();
        corners.iter().zip(shares).map(|(c, s)| *c * s / sum).sum()
    }

    fn outside(hull: &[DVec3], point: DVec3) -> bool {
        // Directions enough to find a plane between a point and a hull of few corners.
        let mut random = Random::new(7, 8, 9);
        (0..2000).any(|_| {
            let normal = DVec3::from([0; 3].map(|_| 2.0 * random.unit() - 1.0));
            Side::of(hull, normal, 1e-9).misses(&[point])
        })
    }

    /// What is left lies within the side and the hull, and holds what of the hull lies inside.
    #[test]
    fn hulls_and_polygons_are_cut() {
        let mut random = Random::new(1, 2, 3);
        let mut cuts = 0;
        for _ in 0..40 {
            let mut point = || DVec3::from([0; 3].map(|_| 2.0 * random.unit() - 1.0));
            let hull: Vec<DVec3> = (0..6).map(|_| point()).collect();
            let triangle = &hull[..3];
            let side = Side {
                normal: point(),
                limit: 0.2,
            };
            let (left, polygon) = (side.cut_hull(&hull), side.cut(triangle));
            cuts += usize::from(!left.is_empty() && hull.iter().any(|p| side.misses(&[*p])));
            for &p in left.iter().chain(&polygon) {
                assert!(side.over(p) < 1e-12, "{p} is cut off");
                assert!(!outside(&hull, p), "{p} is not of the hull");
            }
            for _ in 0..20 {
                for (of, left) in [(&hull[..], &left), (triangle, &polygon)] {
                    let p = within(of, &mut random);
                    assert!(side.misses(&[p]) || !outside(left, p), "{p} is lost");
                }
            }
        }
        assert!(cuts > 10, "{cuts} of 40 hulls are cut");
    }
}
