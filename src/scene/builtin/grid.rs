//! A room with an open front as quads on shared lines, and its cut into an exact number of
//! triangles.

use glam::DVec3;

/// A box in metres; y is up, the opening is at z = 0.
#[derive(Debug, Clone, Copy)]
pub(super) struct Room {
    pub size: DVec3,
    /// The light in the plane of the ceiling: its range along x and along z.
    pub light_x: [f64; 2],
    pub light_z: [f64; 2],
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Part {
    Floor,
    Ceiling,
    Back,
    /// At the greatest x, on the left seen from the opening.
    Left,
    Right,
    Light,
}

/// Counter-clockwise seen from inside.
struct Quad {
    corners: [DVec3; 4],
    part: Part,
}

/// A triangle of the room, counter-clockwise seen from inside.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub corners: [DVec3; 3],
    pub part: Part,
}

/// Cells along each stretch of an axis. All surfaces share the lines, so no edge ends within
/// another.
#[derive(Debug, Clone, Copy)]
struct Cells {
    /// Beside the light, on either side.
    x_aside: usize,
    x_light: usize,
    z_aside: usize,
    z_light: usize,
    y: usize,
}

impl Cells {
    const COARSEST: Self = Self {
        x_aside: 1,
        x_light: 1,
        z_aside: 1,
        z_light: 1,
        y: 1,
    };

    fn quads(&self) -> usize {
        let x = 2 * self.x_aside + self.x_light;
        let z = 2 * self.z_aside + self.z_light;
        2 * x * z + x * self.y + 2 * z * self.y
    }

    /// The finest near-uniform cells that need at most `budget` triangles.
    fn within(room: &Room, budget: usize) -> Self {
        let size = room.size;
        let surface = 2.0 * size.x * size.z + size.x * size.y + 2.0 * size.z * size.y;
        let mut cell = (2.0 * surface / budget as f64).sqrt();
        loop {
            let rounded = |length: f64| (length / cell).round().max(1.0) as i64;
            let wanted = [
                rounded(room.light_x[0]),
                rounded(room.light_x[1] - room.light_x[0]),
                rounded(room.light_z[0]),
                rounded(room.light_z[1] - room.light_z[0]),
                rounded(size.y),
            ];
            // Each count as wanted, one less or one more: 3⁵ choices.
            let best = (0..3_i64.pow(5))
                .map(|choice| {
                    let count = |axis: usize| {
                        let change = choice / 3_i64.pow(axis as u32) % 3 - 1;
                        (wanted[axis] + change).max(1) as usize
                    };
                    Self {
                        x_aside: count(0),
                        x_light: count(1),
                        z_aside: count(2),
                        z_light: count(3),
                        y: count(4),
                    }
                })
                .filter(|cells| 2 * cells.quads() <= budget)
                .max_by_key(Self::quads);
            if let Some(cells) = best {
                return cells;
            }
            cell *= 1.01;
        }
    }
}

/// Triangles of the coarsest room.
pub(super) fn least_triangles() -> usize {
    2 * Cells::COARSEST.quads()
}

/// The room in exactly `count` triangles, at least [`least_triangles`].
///
/// Triangles that a grid lacks are made by cutting quads in four about their centre, evenly spread
/// (two more each). If one is still missing, a triangle at the opening is halved at an edge that no
/// other triangle shares.
pub(super) fn triangles(room: &Room, count: usize) -> Vec<Piece> {
    let quads = quads(room, &Cells::within(room, count));
    let more = count - 2 * quads.len();
    let in_four = more / 2;
    assert!(in_four <= quads.len(), "a finer grid would have fitted");
    let mut triangles = Vec::with_capacity(count);
    for (index, quad) in quads.iter().enumerate() {
        let [a, b, c, d] = quad.corners;
        let piece = |corners| Piece {
            corners,
            part: quad.part,
        };
        let share = |quads_before: usize| quads_before * in_four / quads.len();
        if share(index + 1) > share(index) {
            let centre = (a + b + c + d) / 4.0;
            let about = [[a, b], [b, c], [c, d], [d, a]];
            triangles.extend(about.map(|[p, q]| piece([p, q, centre])));
        } else {
            triangles.extend([piece([a, b, c]), piece([a, c, d])]);
        }
    }
    if more % 2 == 1 {
        halve_at_opening(&mut triangles);
    }
    triangles
}

fn halve_at_opening(triangles: &mut Vec<Piece>) {
    let edge = |corners: &[DVec3; 3]| {
        (0..3).find(|&k| corners[k].z == 0.0 && corners[(k + 1) % 3].z == 0.0)
    };
    let found = triangles
        .iter()
        .enumerate()
        .find_map(|(index, piece)| Some((index, edge(&piece.corners)?)));
    let Some((index, first)) = found else {
        unreachable!("the opening has edges");
    };
    let Piece { corners, part } = triangles[index];
    let [a, b, c] = [0, 1, 2].map(|k| corners[(first + k) % 3]);
    let middle = (a + b) / 2.0;
    let piece = |corners| Piece { corners, part };
    triangles[index] = piece([a, middle, c]);
    triangles.insert(index + 1, piece([middle, b, c]));
}

fn quads(room: &Room, cells: &Cells) -> Vec<Quad> {
    let Room {
        size,
        light_x,
        light_z,
    } = *room;
    let x = lines(
        &[0.0, light_x[0], light_x[1], size.x],
        &[cells.x_aside, cells.x_light, cells.x_aside],
    );
    let y = lines(&[0.0, size.y], &[cells.y]);
    let z = lines(
        &[0.0, light_z[0], light_z[1], size.z],
        &[cells.z_aside, cells.z_light, cells.z_aside],
    );
    let within = |stretch: [f64; 2], at: f64| at >= stretch[0] && at < stretch[1];
    let ceiling = |x: f64, z: f64| match within(light_x, x) && within(light_z, z) {
        true => Part::Light,
        false => Part::Ceiling,
    };

    let mut quads = Vec::with_capacity(cells.quads());
    // Each surface is spanned by two axes whose cross product is its normal, into the room.
    surface(
        &z,
        &x,
        |_, _| Part::Floor,
        |z, x| DVec3::new(x, 0.0, z),
        &mut quads,
    );
    surface(&x, &z, ceiling, |x, z| DVec3::new(x, size.y, z), &mut quads);
    surface(
        &y,
        &x,
        |_, _| Part::Back,
        |y, x| DVec3::new(x, y, size.z),
        &mut quads,
    );
    surface(
        &z,
        &y,
        |_, _| Part::Left,
        |z, y| DVec3::new(size.x, y, z),
        &mut quads,
    );
    surface(
        &y,
        &z,
        |_, _| Part::Right,
        |y, z| DVec3::new(0.0, y, z),
        &mut quads,
    );
    quads
}

fn surface(
    s: &[f64],
    t: &[f64],
    part: impl Fn(f64, f64) -> Part,
    place: impl Fn(f64, f64) -> DVec3,
    quads: &mut Vec<Quad>,
) {
    for s in s.windows(2) {
        for t in t.windows(2) {
            quads.push(Quad {
                corners: [
                    place(s[0], t[0]),
                    place(s[1], t[0]),
                    place(s[1], t[1]),
                    place(s[0], t[1]),
                ],
                part: part(s[0], t[0]),
            });
        }
    }
}

/// Each stretch between two ends cut into equal cells; the ends themselves are exact.
fn lines(ends: &[f64], cells: &[usize]) -> Vec<f64> {
    let mut lines = Vec::new();
    for (stretch, &count) in ends.windows(2).zip(cells) {
        lines.extend(
            (0..count).map(|i| stretch[0] + (stretch[1] - stretch[0]) * i as f64 / count as f64),
        );
    }
    lines.extend(ends.last());
    lines
}
