//! Where the triangles of a scene lie in its light map: where the mesh says, or as it is unwrapped.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use uvunwrap::{Density, MeshInput, generate_with_progress};

use super::own_charts::{Own, own_charts};
use super::surface::{Layout, Pages, Texels};
use crate::error::{Error, Result};
use crate::scene::Scene;

/// Most texels of all pages.
const MOST_TEXELS: u64 = 1 << 28;

/// Texels between the border of a chart and that of its page; twice as many between charts.
pub const PADDING: u32 = 2;

/// Charts of a scene's triangles; the fields are those of [`super::surface::Surface`].
pub(super) struct Charts {
    pub uv: Vec<[DVec2; 3]>,
    pub page: Vec<Option<u32>>,
    pub chart: Vec<u32>,
    pub pages: Pages,
    pub said: Vec<String>,
}

/// As the meshes say where they can all be used as they are; else those are packed again beside
/// what is unwrapped.
///
/// # Errors
/// Texels that do not fit their pages; stopped.
pub(super) fn lay_out(
    scene: &Scene,
    normals: &[[DVec3; 3]],
    layout: Layout,
    go_on: impl Fn() -> bool + Sync,
) -> Result<Charts> {
    match own_charts(scene, layout.texels) {
        Own::None => unwrapped(scene, normals, layout, go_on),
        Own::Fit(charts) => Ok(charts),
        Own::Unfit(why) => {
            let mut charts = unwrapped(scene, normals, layout, go_on)?;
            charts.said.push(format!(
                "the meshes' own light map coordinates are packed again: {why}"
            ));
            Ok(charts)
        }
    }
}

fn unwrapped(
    scene: &Scene,
    normals: &[[DVec3; 3]],
    layout: Layout,
    go_on: impl Fn() -> bool + Sync,
) -> Result<Charts> {
    let (_, unit) = scene.local_frame();
    let Layout {
        texels,
        whole_blocks,
    } = layout;
    let options = uvunwrap::Options {
        padding: PADDING,
        block_align: whole_blocks,
        density: match texels {
            Texels::Page(page_size) => Density::Auto { page_size },
            Texels::PerUnit { count, page } => Density::Fixed {
                texels_per_unit: (count * unit) as f32,
                page_size: Some(page),
            },
        },
        ..uvunwrap::Options::default()
    };
    let (own, others): (Vec<usize>, Vec<usize>) =
        (0..scene.triangles.len()).partition(|&t| scene.triangles[t].light_uv.is_some());
    let mut parts = vec![
        Part::with_charts(scene, own),
        Part::without(scene, normals, others),
    ];
    parts.retain(|part| !part.triangles.is_empty());
    let inputs: Vec<MeshInput<'_>> = parts.iter().map(Part::input).collect();
    let found = generate_with_progress(&inputs, &options, |_| go_on());
    let atlas = found.map_err(|e| Error::Scene {
        scene: scene.name.clone(),
        what: format!("no light map can be laid out: {e}"),
    })?;
    let texels_in_all = u64::from(atlas.page_count) * u64::from(atlas.width).pow(2);
    if texels_in_all > MOST_TEXELS {
        return Err(Error::Scene {
            scene: scene.name.clone(),
            what: format!(
                "a light map of {} pages of {}² has more than {MOST_TEXELS} texels",
                atlas.page_count, atlas.width
            ),
        });
    }
    // One page is cropped to its charts: engines want all of it.
    let height = match texels {
        Texels::Page(size) => size.max(atlas.height),
        Texels::PerUnit { .. } => atlas.height,
    };
    let whole = DVec2::new(1.0, f64::from(atlas.height) / f64::from(height));
    let count = scene.triangles.len();
    let mut charts = Charts {
        uv: vec![[DVec2::ZERO; 3]; count],
        page: vec![None; count],
        chart: vec![u32::MAX; count],
        pages: Pages {
            count: atlas.page_count,
            width: atlas.width,
            height,
            texels_per_unit: f64::from(atlas.texels_per_unit) / unit,
            charts: atlas.chart_count,
            used: f64::from(atlas.utilization) * whole.y,
        },
        said: Vec::new(),
    };
    for (part, laid) in parts.iter().zip(&atlas.meshes) {
        for (&t, corners) in part.triangles.iter().zip(laid.indices.as_chunks::<3>().0) {
            let corners = corners.map(|i| &laid.vertices[i as usize]);
            charts.uv[t] = corners.map(|v| whole * DVec2::from(v.uv.map(f64::from)));
            let [a, b, c] = corners.map(|v| v.page.zip(v.chart));
            charts.page[t] = a.filter(|_| a == b && b == c).map(|(page, _)| page);
            charts.chart[t] = corners[0].chart.unwrap_or(u32::MAX);
        }
    }
    Ok(charts)
}

/// Triangles of a scene, as they are unwrapped.
struct Part {
    /// Indices of the scene's.
    triangles: Vec<usize>,
    positions: Vec<[f32; 3]>,
    indices: Vec<u32>,
    seams: Option<Vec<[bool; 3]>>,
    uv: Option<Vec<[f32; 2]>>,
}

impl Part {
    /// Of triangles whose charts are kept: each has vertices of its own.
    fn with_charts(scene: &Scene, triangles: Vec<usize>) -> Self {
        let inside = local(scene);
        let all = || triangles.iter().map(|&t| &scene.triangles[t]);
        let positions = all().flat_map(|t| scene.corners(t).map(&inside)).collect();
        let uv = all().flat_map(|t| t.light_uv.unwrap_or_default());
        Self {
            positions,
            indices: (0..3 * triangles.len() as u32).collect(),
            seams: None,
            uv: Some(uv.collect()),
            triangles,
        }
    }

    /// Of triangles without charts, which end where surfaces have creases.
    fn without(scene: &Scene, normals: &[[DVec3; 3]], triangles: Vec<usize>) -> Self {
        let all = triangles.iter().map(|&t| &scene.triangles[t]);
        Self {
            positions: scene.vertices.iter().copied().map(local(scene)).collect(),
            indices: all.flat_map(|t| t.vertices).collect(),
            seams: Some(creases(scene, normals, &triangles)),
            uv: None,
            triangles,
        }
    }

    fn input(&self) -> MeshInput<'_> {
        MeshInput {
            seams: self.seams.as_deref(),
            existing_uvs: self.uv.as_deref(),
            ..MeshInput::new(&self.positions, &self.indices)
        }
    }
}

/// Scene units to those in which f32 suffices.
fn local(scene: &Scene) -> impl Fn(DVec3) -> [f32; 3] {
    let (origin, unit) = scene.local_frame();
    move |p| ((p - origin) / unit).as_vec3().to_array()
}

/// Edges across which the normals differ: `[triangle][edge]`, from each corner to the next.
fn creases(scene: &Scene, normals: &[[DVec3; 3]], triangles: &[usize]) -> Vec<[bool; 3]> {
    const ALIKE: f64 = 1.0 - 1e-9;
    let mut first: HashMap<[u32; 2], [DVec3; 2]> = HashMap::new();
    let mut creases = vec![[false; 3]; triangles.len()];
    for (&t, creases) in triangles.iter().zip(&mut creases) {
        let vertices = scene.triangles[t].vertices;
        for (k, is_crease) in creases.iter_mut().enumerate() {
            let next = (k + 1) % 3;
            let [a, b] = [vertices[k], vertices[next]];
            let ends = match a < b {
                true => [normals[t][k], normals[t][next]],
                false => [normals[t][next], normals[t][k]],
            };
            let known = first.entry([a.min(b), a.max(b)]).or_insert(ends);
            *is_crease = (0..2).any(|i| known[i].dot(ends[i]) < ALIKE);
        }
    }
    creases
}
