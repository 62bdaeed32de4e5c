//! Axis-parallel rectangles in an exact number of triangles.

use glam::DVec3;

/// A rectangle, seen from the side that `facing` points to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Panel {
    /// Equal along the axis of `facing`.
    pub low: DVec3,
    pub high: DVec3,
    /// A unit vector along an axis.
    pub facing: DVec3,
    /// Index into the materials of the scene.
    pub material: u32,
}

/// Triangles of the coarsest cut.
pub(super) fn least_triangles(panels: &[Panel]) -> usize {
    2 * panels.len()
}

/// The panels in exactly `count` triangles, at least [`least_triangles`], with the material of each.
///
/// Cells are alike in size on all of them, so that panels which share a whole side meet vertex to vertex. What the
/// cells leave over is made up by cells cut in four about their centre, spread evenly (two triangles more each), and,
/// where one is missing still, by halving the very first triangle: the first panel should start at a free side.
pub(super) fn triangles(panels: &[Panel], count: usize) -> Vec<([DVec3; 3], u32)> {
    let cells = finest(panels, count / 2);
    let quads: Vec<([DVec3; 4], u32)> = panels
        .iter()
        .zip(cells)
        .flat_map(|(panel, cells)| panel.quads(cells))
        .collect();
    let more = count - 2 * quads.len();
    let in_four = more / 2;
    let mut triangles = Vec::with_capacity(count);
    for (index, &([a, b, c, d], material)) in quads.iter().enumerate() {
        let share = |before: usize| before * in_four / quads.len();
        if share(index + 1) > share(index) {
            let centre = (a + b + c + d) / 4.0;
            let about = [[a, b], [b, c], [c, d], [d, a]];
            triangles.extend(about.map(|[p, q]| ([p, q, centre], material)));
        } else {
            triangles.extend([([a, b, c], material), ([a, c, d], material)]);
        }
    }
    if more % 2 == 1 {
        // In both cuts the first side of the first triangle is the side of its cell.
        let ([a, b, c], material) = triangles[0];
        let middle = (a + b) / 2.0;
        triangles[0] = ([a, middle, c], material);
        triangles.insert(1, ([middle, b, c], material));
    }
    triangles
}

/// Cells along the two axes of each panel: the finest near-square ones that need at most `budget` quads.
fn finest(panels: &[Panel], budget: usize) -> Vec<[usize; 2]> {
    assert!(budget >= panels.len(), "there are triangles for each panel");
    let area: f64 = panels.iter().map(|p| p.sides()[0] * p.sides()[1]).sum();
    let mut size = 0.9 * (area / budget as f64).sqrt();
    loop {
        let cells: Vec<[usize; 2]> = panels
            .iter()
            .map(|p| {
                p.sides()
                    .map(|side| (side / size).round().max(1.0) as usize)
            })
            .collect();
        let quads: usize = cells.iter().map(|[s, t]| s * t).sum();
        if quads <= budget {
            return cells;
        }
        size *= 1.001;
    }
}

impl Panel {
    /// Its two axes: their cross product is an axis too, towards or away from the front.
    fn axes(&self) -> [usize; 2] {
        let across = self.facing.abs().to_array();
        match across.iter().position(|&c| c > 0.5) {
            Some(0) => [1, 2],
            Some(1) => [2, 0],
            _ => [0, 1],
        }
    }

    fn sides(&self) -> [f64; 2] {
        self.axes().map(|axis| (self.high - self.low)[axis])
    }

    fn quads(&self, cells: [usize; 2]) -> Vec<([DVec3; 4], u32)> {
        let [s, t] = self.axes();
        // The same cut gives the same bits on every panel that has it.
        let place = |i: usize, j: usize| {
            let mut place = self.low;
            for (axis, cut, cells) in [(s, i, cells[0]), (t, j, cells[1])] {
                let along = cut as f64 / cells as f64;
                place[axis] = self.low[axis] * (1.0 - along) + self.high[axis] * along;
            }
            place
        };
        let turned = self.facing.to_array().iter().sum::<f64>() < 0.0;
        let mut quads = Vec::with_capacity(cells[0] * cells[1]);
        for i in 0..cells[0] {
            for j in 0..cells[1] {
                let mut corners = [
                    place(i, j),
                    place(i + 1, j),
                    place(i + 1, j + 1),
                    place(i, j + 1),
                ];
                if turned {
                    // The first side stays where it is.
                    corners.swap(0, 1);
                    corners.swap(2, 3);
                }
                quads.push((corners, self.material));
            }
        }
        quads
    }
}
