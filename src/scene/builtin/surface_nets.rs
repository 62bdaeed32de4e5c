//! A closed triangle mesh of an implicit surface: naive surface nets (Gibson 1998).

use std::collections::{HashMap, HashSet};

use glam::{DVec3, IVec3};
use rayon::prelude::*;

/// Vertices and triangles, counter-clockwise seen from where `distance` is positive.
pub(super) struct Surface {
    pub positions: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
}

/// The surface where `distance`, which is negative inside, is 0, and a box with all of the inside.
#[derive(Clone, Copy)]
pub(super) struct Implicit<D> {
    /// Changes by at most [`STEEPEST`] over a unit.
    pub distance: D,
    pub low: DVec3,
    pub high: DVec3,
}

/// Round cones change by 1.2 over a unit, an apple by 1.7.
const STEEPEST: f64 = 1.75;

impl<D: Fn(DVec3) -> f64 + Sync> Implicit<D> {
    /// Its net on cubes of edge `cell`; other grids have other shifts, in cells.
    pub fn net(&self, cell: f64, shift: DVec3) -> Net {
        Net::new(Grid::sample(self, cell, shift, STEEPEST))
    }

    /// The surface of a net.
    pub fn surface(&self, net: &Net) -> Surface {
        let place =
            |&(_, inside): &(IVec3, DVec3)| towards_surface(&self.distance, inside, net.grid.cell);
        let mut surface = Surface {
            positions: net.vertices.par_iter().map(place).collect(),
            triangles: Vec::with_capacity(net.triangles()),
        };
        net.quads.iter().for_each(|&quad| surface.push(quad));
        surface
    }
}

/// Each cube that a surface crosses has one vertex, and each grid edge that it crosses gives a quad
/// between the four cubes around it. It is closed, but not always manifold.
pub(super) struct Net {
    grid: Grid,
    /// Cubes with the means of their crossings.
    vertices: Vec<(IVec3, DVec3)>,
    /// Counter-clockwise seen from outside.
    quads: Vec<[u32; 4]>,
}

impl Net {
    fn new(grid: Grid) -> Self {
        let vertices = grid.points_of(|cube| Some((cube, grid.vertex(cube)?)));
        let cubes = || vertices.iter().map(|(cube, _)| *cube);
        let vertex_of: HashMap<IVec3, u32> = cubes().zip(0..).collect();
        let mut quads = Vec::new();
        // An edge that is crossed belongs to the cube at its start.
        for point in cubes() {
            for axis in 0..3 {
                let (from, to) = (grid.value(point), grid.value(point + AXES[axis]));
                if (from < 0.0) == (to < 0.0) {
                    continue;
                }
                let (s, t) = (AXES[(axis + 1) % 3], AXES[(axis + 2) % 3]);
                // Counter-clockwise seen from the end of the axis.
                let mut quad =
                    [point - s - t, point - t, point, point - s].map(|cube| vertex_of[&cube]);
                if to < 0.0 {
                    quad.reverse();
                }
                quads.push(quad);
            }
        }
        Self {
            grid,
            vertices,
            quads,
        }
    }

    /// Number of triangles of its surface.
    pub fn triangles(&self) -> usize {
        2 * self.quads.len()
    }

    /// Whether no edge is shared by more than two quads. If so, the triangles may still share more:
    /// see [`Surface::is_manifold`].
    pub fn is_manifold(&self) -> bool {
        are_once(self.quads.iter().copied())
    }
}

/// Whether no two of the polygons go along an edge in one direction.
fn are_once<const N: usize>(mut polygons: impl Iterator<Item = [u32; N]>) -> bool {
    let mut edges = HashSet::new();
    polygons.all(|corners| (0..N).all(|k| edges.insert([corners[k], corners[(k + 1) % N]])))
}

/// One Newton step to the surface, at most half a cell: the mean of crossings lies inside a convex
/// surface.
fn towards_surface(distance: impl Fn(DVec3) -> f64, at: DVec3, cell: f64) -> DVec3 {
    let h = cell / 16.0;
    let slope = |axis: DVec3| (distance(at + axis * h) - distance(at - axis * h)) / (2.0 * h);
    let gradient = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z));
    let step = gradient * (distance(at) / gradient.length_squared().max(f64::MIN_POSITIVE));
    at - step.clamp_length_max(cell / 2.0)
}

const AXES: [IVec3; 3] = [IVec3::X, IVec3::Y, IVec3::Z];

impl Surface {
    /// Whether no edge is shared by more than two triangles.
    pub fn is_manifold(&self) -> bool {
        are_once(self.triangles.iter().copied())
    }

    /// Two triangles along the shorter diagonal.
    fn push(&mut self, [a, b, c, d]: [u32; 4]) {
        let apart = |p: u32, q: u32| {
            self.positions[p as usize].distance_squared(self.positions[q as usize])
        };
        self.triangles.extend(match apart(a, c) <= apart(b, d) {
            true => [[a, b, c], [a, c, d]],
            false => [[b, c, d], [b, d, a]],
        });
    }
}

/// Values at the points of a grid, x fastest, one layer wider than the box. Those at the ends of
/// edges that the surface crosses are exact, of the others only the sign is.
struct Grid {
    low: DVec3,
    cell: f64,
    size: IVec3,
    values: Vec<f64>,
}

impl Grid {
    fn sample(
        of: &Implicit<impl Fn(DVec3) -> f64 + Sync>,
        cell: f64,
        shift: DVec3,
        steepest: f64,
    ) -> Self {
        let low = of.low - shift * cell - cell;
        let size = ((of.high - low) / cell).ceil().as_ivec3() + 2;
        let mut values = vec![0.0; size.as_usizevec3().element_product()];
        let grid = Self {
            low,
            cell,
            size,
            values: Vec::new(),
        };
        let rows = values.par_chunks_mut(size.x as usize).enumerate();
        rows.for_each(|(i, row)| {
            let (y, z) = (i as i32 % size.y, i as i32 / size.y);
            let mut x = 0;
            while x < row.len() {
                let value = (of.distance)(grid.place(IVec3::new(x as i32, y, z)));
                // The surface crosses no edge that begins or ends at these.
                let far = (value.abs() / (steepest * cell)) as usize;
                let end = row.len().min(x + far.max(1));
                row[x..end].fill(value);
                x = end;
            }
        });
        Self { values, ..grid }
    }

    /// What `find` finds at all points, in their order; planes are looked at in parallel.
    fn points_of<T: Send>(&self, find: impl Fn(IVec3) -> Option<T> + Sync) -> Vec<T> {
        let planes = (0..self.size.z).into_par_iter();
        let found = planes.flat_map_iter(|z| {
            let points = (0..self.size.y)
                .flat_map(move |y| (0..self.size.x).map(move |x| IVec3::new(x, y, z)));
            points.filter_map(&find)
        });
        found.collect()
    }

    fn place(&self, point: IVec3) -> DVec3 {
        self.low + point.as_dvec3() * self.cell
    }

    /// Points beyond the grid are outside.
    fn value(&self, point: IVec3) -> f64 {
        if point.cmplt(IVec3::ZERO).any() || point.cmpge(self.size).any() {
            return f64::INFINITY;
        }
        let index = (point.z * self.size.y + point.y) * self.size.x + point.x;
        self.values[index as usize]
    }

    /// The mean of the crossings on the twelve edges of a cube; none where there is no crossing.
    fn vertex(&self, cube: IVec3) -> Option<DVec3> {
        let is_inside = |i| self.value(cube + IVec3::new(i & 1, i >> 1 & 1, i >> 2)) < 0.0;
        let first = is_inside(0);
        if (1..8).all(|i| is_inside(i) == first) {
            return None;
        }
        let mut sum = DVec3::ZERO;
        let mut crossings = 0;
        for axis in 0..3 {
            let (s, t) = (AXES[(axis + 1) % 3], AXES[(axis + 2) % 3]);
            for from in [cube, cube + s, cube + t, cube + s + t] {
                let (a, b) = (self.value(from), self.value(from + AXES[axis]));
                if (a < 0.0) != (b < 0.0) {
                    let along = AXES[axis].as_dvec3() * (self.cell * a / (a - b));
                    sum += self.place(from) + along;
                    crossings += 1;
                }
            }
        }
        (crossings > 0).then(|| sum / f64::from(crossings))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{bunny, fruit, statue};
    use super::*;

    /// What is skipped far from a surface changes no sign, nor a value beside one of the other.
    fn skips(of: &Implicit<impl Fn(DVec3) -> f64 + Sync>) {
        for (cells, shift) in [(20.0, 0.0), (53.0, 0.4), (97.0, 0.9)] {
            let cell = (of.high - of.low).max_element() / cells;
            let sample = |steepest| Grid::sample(of, cell, DVec3::splat(shift), steepest);
            let (found, all) = (sample(STEEPEST), sample(f64::INFINITY));
            let mut skipped = 0;
            for point in all.points_of(Some) {
                let (value, exact) = (found.value(point), all.value(point));
                assert_eq!(value < 0.0, exact < 0.0, "{point}");
                let crosses = |to: IVec3| (all.value(to) < 0.0) != (exact < 0.0);
                let mut ends = AXES
                    .into_iter()
                    .flat_map(|axis| [point + axis, point - axis]);
                assert!(value == exact || !ends.any(crosses), "{point}");
                skipped += usize::from(value != exact);
            }
            let share = skipped as f64 / all.values.len() as f64;
            assert!(share > 0.12 && share < 0.99, "{share}");
        }
    }

    #[test]
    fn skipping_changes_nothing() {
        skips(&statue::HORSE);
        skips(&bunny::BUNNY);
        skips(&fruit::APPLE);
        skips(&fruit::PEAR_BODY);
        skips(&fruit::bent());
    }
}
