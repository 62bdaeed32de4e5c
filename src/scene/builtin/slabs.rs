//! Plane pieces on grids of lines: walls with holes, blocks of stone, arches.

use std::collections::HashMap;
use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::scene::assemble::{Mesh, MeshTriangle};

/// Metres that sides go on beneath what they stand on, so that no joint of a relief shows a gap.
pub(super) const TUCK: f64 = 0.03;

/// A mesh of plane pieces. Equal corners within a part are one vertex; at most two triangles of it
/// meet in an edge.
#[derive(Default)]
pub(super) struct Slabs {
    pub mesh: Mesh,
    known: HashMap<[u64; 3], u32>,
}

/// A plane and the lines that it is cut along: place (a, b) is at `origin + a · along + b · up`,
/// and its front looks along `along × up`.
pub(super) struct Panel<'a> {
    pub origin: DVec3,
    pub along: DVec3,
    pub up: DVec3,
    /// Ascending.
    pub columns: &'a [f64],
    pub rows: &'a [f64],
    pub material: u32,
}

/// A round arch in a plane z.
#[derive(Clone, Copy)]
pub(super) struct Arch {
    /// Middle of the half circle.
    pub centre: DVec2,
    pub radius: f64,
}

/// Chords of an arch.
const CHORDS: usize = 32;

impl Arch {
    /// From the right end of the half circle over the top to the left one.
    pub fn points(self) -> Vec<DVec2> {
        let point = |i: usize| match i {
            0 => DVec2::X,
            CHORDS => DVec2::NEG_X,
            _ => DVec2::from_angle(PI * i as f64 / CHORDS as f64),
        };
        (0..=CHORDS)
            .map(|i| self.centre + self.radius * point(i))
            .collect()
    }
}

impl Slabs {
    /// Begins a new piece, which has no vertex in common with what is there.
    pub fn part(&mut self) {
        self.known.clear();
    }

    fn vertex(&mut self, p: DVec3) -> u32 {
        let positions = &mut self.mesh.positions;
        let key = (p + DVec3::ZERO).to_array().map(f64::to_bits);
        *self.known.entry(key).or_insert_with(|| {
            positions.push(p);
            positions.len() as u32 - 1
        })
    }

    /// A quadrilateral, counter-clockwise from its front. Corners that coincide make a triangle.
    pub fn quad(&mut self, [a, b, c, d]: [DVec3; 4], material: u32) {
        let mut push = |p: DVec3, q: DVec3, r: DVec3| {
            if p == q || q == r || r == p {
                return;
            }
            let corners = [p, q, r].map(|p| self.vertex(p));
            self.mesh.triangles.push(MeshTriangle {
                corners,
                uv: None,
                emission_uv: None,
                light_uv: None,
                material,
            });
        };
        push(a, b, c);
        push(a, c, d);
    }

    /// The cells of a panel whose middle is to be there.
    pub fn panel(&mut self, panel: &Panel, is_there: impl Fn(f64, f64) -> bool) {
        let at = |a: f64, b: f64| panel.origin + a * panel.along + b * panel.up;
        for rows in panel.rows.windows(2) {
            for columns in panel.columns.windows(2) {
                let ([a0, a1], [b0, b1]) = ([columns[0], columns[1]], [rows[0], rows[1]]);
                if is_there((a0 + a1) / 2.0, (b0 + b1) / 2.0) {
                    self.quad(
                        [at(a0, b0), at(a1, b0), at(a1, b1), at(a0, b1)],
                        panel.material,
                    );
                }
            }
        }
    }

    /// The sides and the top of a block; its sides go on below it by [`TUCK`].
    pub fn block(&mut self, low: DVec3, high: DVec3, material: u32) {
        self.sides(low, high, material);
        let size = high - low;
        let top = Panel {
            origin: DVec3::new(low.x, high.y, high.z),
            along: DVec3::X,
            up: DVec3::NEG_Z,
            columns: &[0.0, size.x],
            rows: &[0.0, size.z],
            material,
        };
        self.panel(&top, |_, _| true);
    }

    /// The four sides of a block, from [`TUCK`] below it.
    pub fn sides(&mut self, low: DVec3, high: DVec3, material: u32) {
        let rows = [low.y - TUCK, low.y, high.y];
        let corners = [
            DVec3::new(low.x, 0.0, high.z),
            DVec3::new(high.x, 0.0, high.z),
            DVec3::new(high.x, 0.0, low.z),
            DVec3::new(low.x, 0.0, low.z),
        ];
        for k in 0..4 {
            let (from, to) = (corners[k], corners[(k + 1) % 4]);
            for pair in rows.windows(2) {
                let [low, high] = [DVec3::Y * pair[0], DVec3::Y * pair[1]];
                self.quad([from + low, to + low, to + high, from + high], material);
            }
        }
    }

    /// All six sides of a block.
    pub fn solid(&mut self, low: DVec3, high: DVec3, material: u32) {
        let at = |x: bool, y: bool, z: bool| {
            let of = |high_side: bool, low: f64, high: f64| if high_side { high } else { low };
            DVec3::new(
                of(x, low.x, high.x),
                of(y, low.y, high.y),
                of(z, low.z, high.z),
            )
        };
        let (o, i) = (false, true);
        for corners in [
            [at(o, o, i), at(i, o, i), at(i, i, i), at(o, i, i)],
            [at(i, o, o), at(o, o, o), at(o, i, o), at(i, i, o)],
            [at(i, o, i), at(i, o, o), at(i, i, o), at(i, i, i)],
            [at(o, o, o), at(o, o, i), at(o, i, i), at(o, i, o)],
            [at(o, i, i), at(i, i, i), at(i, i, o), at(o, i, o)],
            [at(o, o, o), at(i, o, o), at(i, o, i), at(o, o, i)],
        ] {
            self.quad(corners, material);
        }
    }

    /// What fills the space between an arch and the lines above it, in the plane z, front to +z.
    pub fn above_arch(&mut self, arch: Arch, lines: &[f64], z: f64, material: u32) {
        let points = arch.points();
        for pair in points.windows(2) {
            let [right, left] = [pair[0], pair[1]];
            let mut below = [left, right];
            for &line in lines {
                let above = [DVec2::new(left.x, line), DVec2::new(right.x, line)];
                let corners = [below[0], below[1], above[1], above[0]];
                self.quad(corners.map(|p| p.extend(z)), material);
                below = above;
            }
        }
    }

    /// What fills an arch down to its middle, in the plane z, front to +z.
    pub fn below_arch(&mut self, arch: Arch, z: f64, material: u32) {
        for pair in arch.points().windows(2) {
            let corners = [arch.centre, pair[0], pair[1], arch.centre];
            self.quad(corners.map(|p| p.extend(z)), material);
        }
    }

    /// The band between two arches of one middle, in the plane z, front to +z.
    pub fn ring(&mut self, inner: Arch, outer: Arch, z: f64, material: u32) {
        let (inner, outer) = (inner.points(), outer.points());
        for i in 0..CHORDS {
            let corners = [inner[i], outer[i], outer[i + 1], inner[i + 1]];
            self.quad(corners.map(|p| p.extend(z)), material);
        }
    }

    /// The surface of an arch from one z to the next, its front outward or to the inside.
    pub fn vault(&mut self, arch: Arch, depths: &[f64], outward: bool, material: u32) {
        for pair in arch.points().windows(2) {
            for z in depths.windows(2) {
                let [p, q] = [pair[0], pair[1]];
                let corners = [
                    p.extend(z[0]),
                    p.extend(z[1]),
                    q.extend(z[1]),
                    q.extend(z[0]),
                ];
                let [a, b, c, d] = corners;
                self.quad(if outward { [a, d, c, b] } else { [a, b, c, d] }, material);
            }
        }
    }
}

/// Lines at both ends and at every place of `at` between them, ascending.
pub(super) fn lines(from: f64, to: f64, at: &[f64]) -> Vec<f64> {
    let mut lines: Vec<f64> = at.iter().copied().filter(|&x| x > from && x < to).collect();
    lines.extend([from, to]);
    lines.sort_by(f64::total_cmp);
    // Sums that are equal but for rounding are one line.
    lines.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    lines
}
