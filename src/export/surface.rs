//! The surfaces of a scene as it was read, laid out for light maps.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use uvunwrap::{Density, MeshInput, generate_with_progress};

use crate::error::{Error, Result};
use crate::mesh::corners::Corners;
use crate::scene::Scene;
use crate::solver::Place;

/// How finely light maps are laid out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Texels {
    /// One page of about this many texels a side.
    Page(u32),
    /// So many texels a scene unit, on pages of this many texels a side.
    PerUnit { count: f64, page: u32 },
}

/// How a surface is laid out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layout {
    pub texels: Texels,
    /// Whether charts share no block of 4 x 4 texels, as compressed files want it. The size of a
    /// page must be a multiple of 4 then.
    pub whole_blocks: bool,
}

impl From<Texels> for Layout {
    fn from(texels: Texels) -> Self {
        Self {
            texels,
            whole_blocks: false,
        }
    }
}

/// Most texels of all pages.
const MOST_TEXELS: u64 = 1 << 28;

/// Texels between the border of a chart and that of its page; twice as many between charts.
pub const PADDING: u32 = 2;

/// The triangles of a scene, `[triangle][corner]`, each in a chart of a light map.
pub struct Surface {
    pub scene: Scene,
    /// Of smooth surfaces the mean of the triangles about the vertex, up to 35°; unit.
    pub normals: Vec<[DVec3; 3]>,
    /// Place in the light map, 0..1, v down from the top row.
    pub uv: Vec<[DVec2; 3]>,
    /// Page of each triangle; None of one without an area there.
    pub page: Vec<Option<u32>>,
    /// `[triangle]`, of all pages.
    pub chart: Vec<u32>,
    pub pages: Pages,
}

/// The pages of a light map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pages {
    pub count: u32,
    pub width: u32,
    pub height: u32,
    pub texels_per_unit: f64,
    pub charts: u32,
    /// Share of the texels that charts cover.
    pub used: f64,
}

impl Surface {
    /// Lays out the scene that `scene` was cut from. `go_on` returning false stops.
    ///
    /// # Errors
    /// Texels that do not fit their pages; stopped.
    pub fn new(
        scene: &Scene,
        layout: impl Into<Layout>,
        go_on: impl Fn() -> bool + Sync,
    ) -> Result<Self> {
        let Layout {
            texels,
            whole_blocks,
        } = layout.into();
        let scene = scene.uncut();
        let corners = Corners::new(&scene);
        let normals = smooth_normals(&scene, &corners);
        let seams = creases(&scene, &normals);
        let (origin, unit) = scene.local_frame();
        let positions: Vec<[f32; 3]> = (scene.vertices.iter())
            .map(|&v| ((v - origin) / unit).as_vec3().to_array())
            .collect();
        let indices: Vec<u32> = scene.triangles.iter().flat_map(|t| t.vertices).collect();
        let mesh = MeshInput {
            seams: Some(&seams),
            ..MeshInput::new(&positions, &indices)
        };
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
        let unwrapped = generate_with_progress(&[mesh], &options, |_| go_on());
        let atlas = unwrapped.map_err(|e| Error::Scene {
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
        let pages = Pages {
            count: atlas.page_count,
            width: atlas.width,
            height,
            texels_per_unit: f64::from(atlas.texels_per_unit) / unit,
            charts: atlas.chart_count,
            used: f64::from(atlas.utilization) * whole.y,
        };
        let laid = &atlas.meshes[0];
        let of = |t: usize| [0, 1, 2].map(|k| &laid.vertices[laid.indices[3 * t + k] as usize]);
        let uv = (0..scene.triangles.len())
            .map(|t| of(t).map(|v| whole * DVec2::new(f64::from(v.uv[0]), f64::from(v.uv[1]))));
        let page = (0..scene.triangles.len()).map(|t| {
            let [a, b, c] = of(t).map(|v| v.page.zip(v.chart));
            a.filter(|_| a == b && b == c).map(|(page, _)| page)
        });
        let chart = (0..scene.triangles.len()).map(|t| of(t)[0].chart.unwrap_or(u32::MAX));
        Ok(Self {
            chart: chart.collect(),
            uv: uv.collect(),
            page: page.collect(),
            normals,
            pages,
            scene,
        })
    }

    /// A place by its barycentric coordinates in a triangle: of a surface that its normals curve
    /// outwards, on the curve, so that its facets do not shade it (Hanika, "Hacking the shadow
    /// terminator", Ray Tracing Gems II, 2021).
    pub fn place(&self, triangle: usize, weights: [f64; 3]) -> Place {
        let mix = |of: [DVec3; 3]| -> DVec3 {
            weights
                .iter()
                .zip(of)
                .map(|(&weight, value)| weight * value)
                .sum()
        };
        let corners = self.scene.corners(&self.scene.triangles[triangle]);
        let [a, b, c] = corners;
        let flat = (b - a).cross(c - a).normalize_or(DVec3::Y);
        let position = mix(corners);
        let normals = self.normals[triangle];
        let lifts = [0, 1, 2].map(|k| {
            let below = (position - corners[k]).dot(normals[k]).min(0.0);
            -below * normals[k]
        });
        Place {
            position: position + mix(lifts),
            normal: mix(self.normals[triangle]).try_normalize().unwrap_or(flat),
        }
    }

    /// Place of a corner in its page, texels.
    pub fn texel(&self, triangle: usize, corner: usize) -> DVec2 {
        let Pages { width, height, .. } = self.pages;
        self.uv[triangle][corner] * DVec2::new(f64::from(width), f64::from(height))
    }
}

/// Normals at the corners, `[triangle][corner]`.
fn smooth_normals(scene: &Scene, corners: &Corners) -> Vec<[DVec3; 3]> {
    let triangles = scene.triangles.iter().enumerate();
    triangles
        .map(|(e, triangle)| {
            triangle.vertices.map(|vertex| {
                let about = corners.smooth(e, vertex);
                let sum: DVec3 = about.map(|(t, angle)| angle * corners.normals[t]).sum();
                sum.try_normalize().unwrap_or(corners.normals[e])
            })
        })
        .collect()
}

/// Edges across which the normals differ: `[triangle][edge]`, from each corner to the next.
fn creases(scene: &Scene, normals: &[[DVec3; 3]]) -> Vec<[bool; 3]> {
    const ALIKE: f64 = 1.0 - 1e-9;
    let mut first: HashMap<[u32; 2], [DVec3; 2]> = HashMap::new();
    let mut creases = vec![[false; 3]; scene.triangles.len()];
    for (t, triangle) in scene.triangles.iter().enumerate() {
        for k in 0..3 {
            let next = (k + 1) % 3;
            let [a, b] = [triangle.vertices[k], triangle.vertices[next]];
            let ends = match a < b {
                true => [normals[t][k], normals[t][next]],
                false => [normals[t][next], normals[t][k]],
            };
            let known = first.entry([a.min(b), a.max(b)]).or_insert(ends);
            creases[t][k] = (0..2).any(|i| known[i].dot(ends[i]) < ALIKE);
        }
    }
    creases
}
