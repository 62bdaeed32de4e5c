//! Charts that meshes bring along, as engines' light maps need them: within one page, and no two
//! triangles in one place.

use glam::DVec2;

use super::charts::Charts;
use super::surface::{Pages, Texels};
use super::texels::{NOTHING, REACH, nearest, texels_about};
use crate::math::groups::{Groups, edges, shared};
use crate::mesh::sources::triangle_area;
use crate::scene::Scene;

/// What there is of a scene's own charts.
pub(super) enum Own {
    None,
    /// They can be used as they are.
    Fit(Charts),
    /// They cannot, and why.
    Unfit(String),
}

/// Barycentric coordinates of a place within a triangle, not on its edge, are larger.
const WITHIN: f64 = 1e-4;

pub(super) fn own_charts(scene: &Scene, texels: Texels) -> Own {
    let all = &scene.triangles;
    let missing = all.iter().filter(|t| t.light_uv.is_none()).count();
    if missing == all.len() {
        return Own::None;
    }
    if missing > 0 {
        let count = all.len();
        return Own::Unfit(format!("{missing} of {count} triangles have none"));
    }
    // From the top of the page.
    let down = |[u, v]: [f32; 2]| DVec2::new(f64::from(u), 1.0 - f64::from(v));
    let uv: Vec<[DVec2; 3]> = (all.iter())
        .filter_map(|t| t.light_uv.map(|uv| uv.map(down)))
        .collect();
    let is_inside = |at: &DVec2| at.cmpge(DVec2::ZERO).all() && at.cmple(DVec2::ONE).all();
    if !uv.as_flattened().iter().all(is_inside) {
        return Own::Unfit("they reach out of 0 to 1".into());
    }
    let covered = |[a, b, c]: &[DVec2; 3]| 0.5 * (b - a).perp_dot(c - a).abs();
    let used: f64 = uv.iter().map(covered).sum();
    let area: f64 = (all.iter()).map(|t| triangle_area(scene.corners(t))).sum();
    let per_unit = (used / area).sqrt();
    let size = match texels {
        Texels::Page(size) => size,
        Texels::PerUnit { count, page } => {
            let size = (count / per_unit / 4.0).ceil() * 4.0;
            if size.is_nan() || size > f64::from(page) {
                return Own::Unfit(format!("they would need a page of {size}²"));
            }
            size as u32
        }
    };
    let chart = numbers(scene);
    let shared = match shared_texels(&uv, &chart, size) {
        Ok(shared) => shared,
        Err(why) => return Own::Unfit(why),
    };
    let mut said = Vec::new();
    if shared > 0 {
        said.push(format!(
            "the meshes' own light map coordinates: {shared} texels lie beside two charts, between \
             which light bleeds; a larger --page keeps them apart"
        ));
    }
    Own::Fit(Charts {
        pages: Pages {
            count: 1,
            width: size,
            height: size,
            texels_per_unit: per_unit * f64::from(size),
            charts: chart.iter().max().map_or(0, |last| last + 1),
            used,
        },
        page: vec![Some(0); uv.len()],
        uv,
        chart,
        said,
    })
}

/// The chart of each triangle: that of its neighbours across edges that lie in one place of the
/// map, too.
fn numbers(scene: &Scene) -> Vec<u32> {
    let triangles = &scene.triangles;
    let end = |t: u32, vertex: u32| {
        let triangle = &triangles[t as usize];
        let corner = triangle.vertices.iter().position(|&v| v == vertex);
        corner.and_then(|k| Some(triangle.light_uv?[k].map(f32::to_bits)))
    };
    let mut groups = Groups::new(triangles.len());
    for run in shared(&edges(triangles.iter().map(|t| t.vertices))) {
        for (i, one) in run.iter().enumerate() {
            for other in &run[i + 1..] {
                if one
                    .ends
                    .iter()
                    .all(|&v| end(one.triangle, v) == end(other.triangle, v))
                {
                    groups.join(one.triangle, other.triangle);
                }
            }
        }
    }
    groups.numbers(0..triangles.len() as u32)
}

/// Texels that interpolation over two charts reads.
///
/// # Errors
/// Why the charts cannot be used: a triangle without texels, or two in one place.
fn shared_texels(uv: &[[DVec2; 3]], chart: &[u32], size: u32) -> Result<usize, String> {
    let slot = |[x, y]: [u32; 2]| y as usize * size as usize + x as usize;
    let texels = size as usize * size as usize;
    let (mut inside, mut about) = (vec![NOTHING; texels], vec![NOTHING; texels]);
    let mut is_shared = vec![false; texels];
    for (t, corners) in uv.iter().enumerate() {
        let corners = corners.map(|at| at * f64::from(size));
        if (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]) == 0.0 {
            return Err("a triangle has no area in them".into());
        }
        for at in texels_about(corners, size, size) {
            let middle = DVec2::from(at.map(f64::from)) + 0.5;
            let (weights, distance) = nearest(corners, middle);
            if distance >= REACH {
                continue;
            }
            if weights.iter().all(|&w| w > WITHIN) {
                if inside[slot(at)] != NOTHING {
                    return Err("two triangles lie in one place".into());
                }
                inside[slot(at)] = t as u32;
            }
            match about[slot(at)] {
                NOTHING => about[slot(at)] = chart[t],
                known => is_shared[slot(at)] |= known != chart[t],
            }
        }
    }
    Ok(is_shared.into_iter().filter(|&is| is).count())
}
