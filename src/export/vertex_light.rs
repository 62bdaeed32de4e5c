//! Light at the vertices of a scene as it was cut: linear between them, in the least squares
//! nearest to the light of the surface (Kavan, Bargteil and Sloan, "Least squares vertex baking", EGSR
//! 2011).

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::lattice::too_early;
use super::light_map::Looking;
use super::surface::{Surface, smooth_normals};
use crate::error::Result;
use crate::math::groups::{Groups, edges, shared};
use crate::mesh::sources::triangle_area;
use crate::scene::{OnInput, Scene};
use crate::solver::{LightAt, Lit, Place};

/// Light at the vertices of a scene.
pub struct VertexLight {
    /// The scene as it was cut, its triangles in the order of those that they were cut from. It has
    /// no charts.
    pub surface: Surface,
    /// Index into `light`, `[triangle][corner]`: corners of one smooth surface share theirs.
    pub corners: Vec<[u32; 3]>,
    /// Irradiance, W·m⁻², RGB.
    pub light: Vec<LightAt>,
    /// Places at which light was found.
    pub looked_at: usize,
}

/// Barycentric coordinates of the places of a triangle at which light is found: with a third of its
/// area each they integrate products of linear functions exactly.
const PLACES: [[f64; 3]; 3] = [
    [2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0],
    [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0],
    [1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0],
];

/// Weight of even light in a triangle against that which is found there: vertices beside covered
/// places only have the light of those beside them.
const EVEN: f64 = 1e-6;

/// Cosine of the normals on both sides of an edge of a smooth surface, at least.
const SMOOTH: f64 = 1.0 - 1e-6;

/// The residual over the right side, squared, at which the solver ends.
const SOLVED: f64 = 1e-12;

/// Steps of the solver, at most. The matrix is that of masses: some 20 suffice.
const MOST_STEPS: usize = 200;

/// Direct and indirect, RGB.
type Value = [f64; 6];

impl VertexLight {
    /// Of a scene, cut as it was baked. `go_on` is called with how many places have been looked at;
    /// false stops.
    ///
    /// # Errors
    /// Stopped.
    pub fn new(scene: &Scene, lit: &Lit<'_>, go_on: &dyn Fn(usize) -> bool) -> Result<Self> {
        let whole = scene.uncut();
        let normals = smooth_normals(&whole);
        let whole = Surface::without_charts(whole, normals);
        let (cut, on_input) = scene.in_order_of_input();
        let surface = as_cut(cut, &whole, &on_input);
        let places: Vec<Place> = on_input
            .par_iter()
            .flat_map_iter(|on| {
                let whole = &whole;
                PLACES.map(|weights| whole.place(on.triangle as usize, on.weights(weights)))
            })
            .collect();
        let covered = lit.covered(&places)?;
        let open: Vec<Place> = (places.iter().zip(&covered))
            .filter_map(|(place, covered)| (!covered).then_some(*place))
            .collect();
        let mut looking = Looking {
            lit,
            go_on,
            looked_at: 0,
            stopped: false,
        };
        let found = looking.at(&open)?;
        if found.len() < open.len() {
            return Err(too_early());
        }
        let mut found = found.iter().map(value);
        let light: Vec<Option<Value>> = (covered.iter())
            .map(|covered| if *covered { None } else { found.next() })
            .collect();
        let corners = joined(&surface);
        let scene = &surface.scene;
        let areas = (scene.triangles.iter()).map(|t| triangle_area(scene.corners(t)));
        let masses = Masses::new(&corners, &areas.collect::<Vec<_>>(), &light);
        Ok(Self {
            light: masses.solve().iter().map(light_of).collect(),
            corners,
            looked_at: open.len(),
            surface,
        })
    }
}

fn value(light: &LightAt) -> Value {
    let [direct, indirect] = [light.direct, light.indirect].map(|l| l.as_dvec3().to_array());
    let [a, b, c] = direct;
    let [d, e, f] = indirect;
    [a, b, c, d, e, f]
}

fn light_of(value: &Value) -> LightAt {
    let [a, b, c, d, e, f] = value.map(|v| v.max(0.0) as f32);
    LightAt {
        direct: Vec3::new(a, b, c),
        indirect: Vec3::new(d, e, f),
    }
}

/// A scene as it was cut, with the normals of what it was cut from.
fn as_cut(cut: Scene, whole: &Surface, on_input: &[OnInput]) -> Surface {
    let normals = on_input.iter().map(|on| {
        let of_whole = whole.normals[on.triangle as usize];
        on.corners.map(|[second, third]| {
            let weights = [1.0 - second - third, second, third];
            let sum: DVec3 = (0..3).map(|i| weights[i] * of_whole[i]).sum();
            sum.normalize_or(of_whole[0])
        })
    });
    Surface::without_charts(cut, normals.collect())
}

/// A number for each corner, the same for those of a vertex that edges of a smooth surface join:
/// not across edges at which more than two triangles meet, on which something stands.
fn joined(surface: &Surface) -> Vec<[u32; 3]> {
    let triangles = &surface.scene.triangles;
    let corner = |t: u32, vertex: u32| {
        let at = triangles[t as usize]
            .vertices
            .iter()
            .position(|&v| v == vertex);
        at.map(|k| (t, k))
    };
    let mut groups = Groups::new(3 * triangles.len());
    for run in shared(&edges(triangles.iter().map(|t| t.vertices))) {
        let &[one, other] = run else {
            continue;
        };
        let ends = one
            .ends
            .map(|v| corner(one.triangle, v).zip(corner(other.triangle, v)));
        let normal = |(t, k): (u32, usize)| surface.normals[t as usize][k];
        let is_smooth =
            |end: &Option<_>| end.is_some_and(|(a, b)| normal(a).dot(normal(b)) >= SMOOTH);
        if one.ascends == other.ascends || !ends.iter().all(is_smooth) {
            continue;
        }
        let number = |(t, k): (u32, usize)| 3 * t + k as u32;
        for (a, b) in ends.into_iter().flatten() {
            groups.join(number(a), number(b));
        }
    }
    let numbers = groups.numbers(0..3 * triangles.len() as u32);
    numbers.as_chunks::<3>().0.to_vec()
}

/// The equations of the least squares: of each triangle its part of the matrix, and the right side.
struct Masses<'a> {
    corners: &'a [[u32; 3]],
    /// `[triangle]`, symmetric.
    parts: Vec<[[f64; 3]; 3]>,
    right: Vec<Value>,
}

impl<'a> Masses<'a> {
    /// With the light at the [`PLACES`] of each triangle that are open.
    fn new(corners: &'a [[u32; 3]], areas: &[f64], light: &[Option<Value>]) -> Self {
        let count = corners.iter().flatten().max().map_or(0, |last| last + 1);
        let mut right = vec![Value::default(); count as usize];
        let of_each = corners.iter().zip(areas).zip(light.as_chunks::<3>().0);
        let parts = of_each.map(|((corners, area), light)| {
            let third = area / 3.0;
            let even = EVEN * third;
            let mut part = [[-even; 3]; 3];
            for (k, row) in part.iter_mut().enumerate() {
                row[k] = 2.0 * even;
            }
            for (weights, light) in PLACES.iter().zip(light) {
                let Some(light) = light else {
                    continue;
                };
                for k in 0..3 {
                    for l in 0..3 {
                        part[k][l] += third * weights[k] * weights[l];
                    }
                    let sum = &mut right[corners[k] as usize];
                    *sum = std::array::from_fn(|c| sum[c] + third * weights[k] * light[c]);
                }
            }
            part
        });
        Self {
            parts: parts.collect(),
            corners,
            right,
        }
    }

    fn times(&self, values: &[Value]) -> Vec<Value> {
        let mut product = vec![Value::default(); values.len()];
        for (corners, part) in self.corners.iter().zip(&self.parts) {
            for k in 0..3 {
                let sum = &mut product[corners[k] as usize];
                for l in 0..3 {
                    let value = &values[corners[l] as usize];
                    *sum = std::array::from_fn(|c| sum[c] + part[k][l] * value[c]);
                }
            }
        }
        product
    }

    /// Conjugate gradients with the diagonal before it; vertices without light get none.
    fn solve(&self) -> Vec<Value> {
        let mut diagonal = vec![0.0; self.right.len()];
        for (corners, part) in self.corners.iter().zip(&self.parts) {
            for k in 0..3 {
                diagonal[corners[k] as usize] += part[k][k];
            }
        }
        let scaled = |of: &[Value]| -> Vec<Value> {
            let each = of.iter().zip(&diagonal);
            each.map(|(value, &by)| value.map(|v| if by > 0.0 { v / by } else { 0.0 }))
                .collect()
        };
        let dot = |a: &[Value], b: &[Value]| -> Value {
            let pairs = a.iter().zip(b);
            pairs.fold(Value::default(), |sum, (a, b)| {
                std::array::from_fn(|c| sum[c] + a[c] * b[c])
            })
        };
        let add = |to: &mut [Value], by: Value, of: &[Value]| {
            for (to, of) in to.iter_mut().zip(of) {
                *to = std::array::from_fn(|c| to[c] + by[c] * of[c]);
            }
        };
        let over = |a: Value, b: Value| -> Value {
            std::array::from_fn(|c| if b[c] > 0.0 { a[c] / b[c] } else { 0.0 })
        };
        let mut found = vec![Value::default(); self.right.len()];
        let mut residual = self.right.clone();
        let mut direction = scaled(&residual);
        let mut square = dot(&residual, &direction);
        let first = square;
        for _ in 0..MOST_STEPS {
            if (0..6).all(|c| square[c] <= SOLVED * first[c]) {
                break;
            }
            let product = self.times(&direction);
            let step = over(square, dot(&direction, &product));
            add(&mut found, step, &direction);
            add(&mut residual, step.map(|s| -s), &product);
            let ahead = scaled(&residual);
            let next = dot(&residual, &ahead);
            let keep = over(next, square);
            for (direction, ahead) in direction.iter_mut().zip(&ahead) {
                *direction = std::array::from_fn(|c| ahead[c] + keep[c] * direction[c]);
            }
            square = next;
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fan of triangles: light that is linear comes back as it was, also where it is known at
    /// some places only; even light to rounding, also at vertices beside covered places alone.
    #[test]
    fn linear_light_comes_back() {
        let at = |k: u32| [0.3, 1.2, 2.0, 0.7, 5.0, 1.1].map(|v| v * f64::from(k));
        let corners: Vec<[u32; 3]> = (1..6).map(|k| [0, k, k + 1]).collect();
        let areas = [1.0, 0.1, 3.0, 0.5, 2.0];
        let mut light: Vec<Option<Value>> = (corners.iter())
            .flat_map(|corners| {
                let of = corners.map(at);
                PLACES.map(|w| {
                    Some(std::array::from_fn(|c| {
                        (0..3).map(|k| w[k] * of[k][c]).sum()
                    }))
                })
            })
            .collect();
        let off = |light: &[Option<Value>], wanted: &dyn Fn(u32) -> Value| -> f64 {
            let found = Masses::new(&corners, &areas, light).solve();
            let pairs = (0..).zip(&found).flat_map(|(k, found)| {
                let wanted = wanted(k);
                (0..6).map(move |c| (found[c] - wanted[c]).abs())
            });
            pairs.fold(0.0, f64::max)
        };
        let all = off(&light, &at);
        // One place of a triangle is covered.
        light[1] = None;
        let some = off(&light, &at);
        println!("off by {all:.1e}, {some:.1e}");
        assert!(all <= LINEAR && some <= LINEAR);
        // A triangle of which nothing is seen, with a vertex of its own.
        let mut even = vec![Some([2.0; 6]); light.len()];
        even[..3].fill(None);
        let even = off(&even, &|_| [2.0; 6]);
        assert!(even < 1e-4, "{even}");
    }

    /// Of values up to 30: what [`EVEN`] takes. Measured: 4.6e-4.
    const LINEAR: f64 = 8e-4;
}
