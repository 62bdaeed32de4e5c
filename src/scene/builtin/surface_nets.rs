//! A closed triangle mesh of an implicit surface: naive surface nets (Gibson 1998).

use std::collections::{HashMap, HashSet};

use glam::{DVec3, IVec3};
use rayon::prelude::*;

/// Vertices and triangles, counter-clockwise seen from where `distance` is positive.
pub(super) struct Surface {
    pub positions: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
}

/// Polygonises `distance` = 0 on cubes of edge `cell`; the box from `low` to `high` must contain
/// all of the inside.
///
/// Each cube that the surface crosses has one vertex, and each grid edge that it crosses gives a
/// quad between the four cubes around it. The mesh is closed, but not always manifold: see
/// [`Surface::is_manifold`].
pub(super) fn polygonise(
    distance: impl Fn(DVec3) -> f64 + Sync,
    low: DVec3,
    high: DVec3,
    cell: f64,
) -> Surface {
    let grid = Grid::sample(&distance, low, high, cell);
    let vertex = |cube| {
        let inside = grid.vertex(cube)?;
        Some((cube, towards_surface(&distance, inside, cell)))
    };
    let vertices: Vec<(IVec3, DVec3)> = grid.points_of(vertex);
    let cubes = vertices.iter().map(|(cube, _)| *cube);
    let vertex_of: HashMap<IVec3, u32> = cubes.zip(0..).collect();
    let mut surface = Surface {
        positions: vertices.into_iter().map(|(_, position)| position).collect(),
        triangles: Vec::new(),
    };
    for point in grid.points() {
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
            surface.push(quad);
        }
    }
    surface
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
        let mut edges = HashSet::new();
        self.triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .all(|edge| edges.insert(edge))
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

/// Points of a grid with this z, x fastest.
fn plane(size: IVec3, z: i32) -> impl Iterator<Item = IVec3> {
    (0..size.y).flat_map(move |y| (0..size.x).map(move |x| IVec3::new(x, y, z)))
}

/// Values at the points of a grid, one layer wider than the box.
struct Grid {
    low: DVec3,
    cell: f64,
    size: IVec3,
    values: Vec<f64>,
}

impl Grid {
    fn sample(distance: impl Fn(DVec3) -> f64 + Sync, low: DVec3, high: DVec3, cell: f64) -> Self {
        let low = low - cell;
        let size = ((high - low) / cell).ceil().as_ivec3() + 2;
        let mut grid = Self {
            low,
            cell,
            size,
            values: Vec::new(),
        };
        grid.values = grid.points_of(|point| Some(distance(grid.place(point))));
        grid
    }

    /// All points, x fastest.
    fn points(&self) -> impl Iterator<Item = IVec3> + use<> {
        let size = self.size;
        (0..size.z).flat_map(move |z| plane(size, z))
    }

    /// What `find` finds at all points, in their order; planes are looked at in parallel.
    fn points_of<T: Send>(&self, find: impl Fn(IVec3) -> Option<T> + Sync) -> Vec<T> {
        let planes = (0..self.size.z).into_par_iter();
        let found = planes.flat_map_iter(|z| plane(self.size, z).filter_map(&find));
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
