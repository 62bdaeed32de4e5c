//! What stands about a probe, by direction: light between probes is weighed by what they see, so
//! that none comes through walls. Planes are kept, where distances would do in open space: of a wall seen
//! aslant a texel holds many distances, and what is just behind it seems to be in front.

use glam::{DVec2, DVec3};

use crate::scene::geometry::Geometry;

/// Texels a side of the map of directions.
pub const SIDE: usize = 16;

/// By this times its bilinear weight, 1 at most, a texel hides what lies behind its plane: each of
/// the four hides all of it, but where it is about to be none of them, so that what probes see
/// changes without a step.
const HIDES: f64 = 16.0;

/// The surfaces about a place over the directions, on a square as an octahedron unfolds to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Walls {
    /// `[row][column][x, y, z, distance]`: of the surface that is seen in the middle of a texel the
    /// unit normal, away from the place, and the distance of its plane, scene units. Zero, and 1,
    /// where nothing is.
    pub planes: Vec<[f32; 4]>,
}

/// Where a direction lies on the square, 0..1: the axes x and y of space are those of the square,
/// z is up in its middle and down in its corners (Cigolle et al., "A survey of efficient
/// representations for independent unit vectors", JCGT 3.2, 2014).
pub fn on_square(direction: DVec3) -> DVec2 {
    let flat = direction / direction.abs().element_sum();
    let at = match flat.z >= 0.0 {
        true => flat.truncate(),
        false => folded(flat.truncate()),
    };
    0.5 * at + 0.5
}

/// The direction of a place on the square, unit.
pub fn off_square(place: DVec2) -> DVec3 {
    let at = 2.0 * place - 1.0;
    let z = 1.0 - at.abs().element_sum();
    let at = if z >= 0.0 { at } else { folded(at) };
    at.extend(z).normalize()
}

/// From one side of the diagonal to the other.
fn folded(at: DVec2) -> DVec2 {
    (1.0 - DVec2::new(at.y, at.x).abs()) * DVec2::new(1f64.copysign(at.x), 1f64.copysign(at.y))
}

impl Walls {
    /// About a position, scene units.
    pub(super) fn new(geometry: &Geometry, position: DVec3) -> Self {
        let from = geometry.inside(position);
        let plane = |i: usize| {
            let texel = DVec2::new((i % SIDE) as f64, (i / SIDE) as f64) + 0.5;
            let direction = off_square(texel / SIDE as f64);
            let Some(hit) = geometry.hit(from, direction) else {
                return [0.0, 0.0, 0.0, 1.0];
            };
            let away = if hit.front { -hit.normal } else { hit.normal };
            let distance = (hit.place - from).dot(away) * geometry.unit;
            away.extend(distance).as_vec4().to_array()
        };
        Self {
            planes: (0..SIDE * SIDE).map(plane).collect(),
        }
    }

    /// Whether what lies at `offset` from the place is seen, 0..=1: whether it is behind the plane
    /// of none of the four texels about its direction, by more than `beyond`.
    pub fn sees(&self, offset: DVec3, beyond: f64) -> f64 {
        let Some(direction) = offset.try_normalize() else {
            return 1.0;
        };
        let at = on_square(direction) * SIDE as f64 - 0.5;
        let corner = at.floor();
        let part = at - corner;
        let mut seen = 1.0;
        for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let along = |step: i32, part: f64| if step == 0 { 1.0 - part } else { part };
            let [x, y, z, distance] = self
                .texel(corner.x as i32 + i, corner.y as i32 + j)
                .map(f64::from);
            if offset.dot(DVec3::new(x, y, z)) > distance + beyond {
                seen *= 1.0 - (HIDES * along(i, part.x) * along(j, part.y)).min(1.0);
            }
        }
        seen
    }

    /// A texel, or the one that the square is folded to there.
    fn texel(&self, column: i32, row: i32) -> [f32; 4] {
        let side = SIDE as i32;
        let (mut x, mut y) = (column, row);
        if x < 0 || x >= side {
            x = if x < 0 { -1 - x } else { 2 * side - 1 - x };
            y = side - 1 - y;
        }
        if y < 0 || y >= side {
            y = if y < 0 { -1 - y } else { 2 * side - 1 - y };
            x = side - 1 - x;
        }
        self.planes[(y * side + x) as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions all about, the axes and the folds among them.
    #[test]
    fn the_square_holds_all_directions() {
        for i in 0..4096 {
            let place = DVec2::new(f64::from(i % 64), f64::from(i / 64)) / 63.0;
            let direction = off_square(place);
            assert!(direction.is_normalized());
            assert!(off_square(on_square(direction)).distance(direction) < 1e-12);
        }
        assert!(on_square(DVec3::Z).distance(DVec2::splat(0.5)) < 1e-12);
        assert_eq!(on_square(DVec3::X), DVec2::new(1.0, 0.5));
    }

    /// Texels beside each other on the sphere are beside each other across the folds.
    #[test]
    fn the_square_goes_on_across_the_folds() {
        let side = SIDE as i32;
        let middle = |x: i32, y: i32| (DVec2::new(f64::from(x), f64::from(y)) + 0.5) / SIDE as f64;
        let planes = (0..side * side).map(|i| {
            let direction = off_square(middle(i % side, i / side));
            direction.extend(1.0).as_vec4().to_array()
        });
        let walls = Walls {
            planes: planes.collect(),
        };
        let mut farthest = 0.0_f32;
        for k in -1..=side {
            for (outside, inside) in [
                ([-1, k], [0, k]),
                ([side, k], [side - 1, k]),
                ([k, -1], [k, 0]),
                ([k, side], [k, side - 1]),
            ] {
                let [a, b] = [outside, inside].map(|[x, y]| {
                    let [x, y, z, _] = walls.texel(x, y);
                    glam::Vec3::new(x, y, z)
                });
                farthest = farthest.max(a.distance(b));
            }
        }
        println!("texels across a fold are {farthest:.3} apart at most");
        assert!(farthest < 0.25);
    }
}
