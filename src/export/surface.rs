//! The surfaces of a scene as it was read, laid out for light maps.

use glam::{DVec2, DVec3};

pub use super::charts::PADDING;
use super::charts::{self, Charts};
use crate::error::Result;
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
    /// Why charts that the meshes brought are not as they were, one sentence each.
    pub said: Vec<String>,
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
    /// Lays out the scene that `scene` was cut from: where [`Triangle::light_uv`] says, if that
    /// gives each triangle a place of its own. `go_on` returning false stops.
    ///
    /// [`Triangle::light_uv`]: crate::scene::Triangle::light_uv
    ///
    /// # Errors
    /// Texels that do not fit their pages; stopped.
    pub fn new(
        scene: &Scene,
        layout: impl Into<Layout>,
        go_on: impl Fn() -> bool + Sync,
    ) -> Result<Self> {
        let scene = scene.uncut();
        let normals = smooth_normals(&scene);
        let Charts {
            uv,
            page,
            chart,
            pages,
            said,
        } = charts::lay_out(&scene, &normals, layout.into(), go_on)?;
        Ok(Self {
            scene,
            normals,
            uv,
            page,
            chart,
            pages,
            said,
        })
    }

    /// A scene as it is: no triangle of it lies on a page.
    pub(super) fn without_charts(scene: Scene, normals: Vec<[DVec3; 3]>) -> Self {
        let count = scene.triangles.len();
        Self {
            normals,
            uv: vec![[DVec2::ZERO; 3]; count],
            page: vec![None; count],
            chart: vec![u32::MAX; count],
            pages: Pages {
                count: 0,
                width: 0,
                height: 0,
                texels_per_unit: 0.0,
                charts: 0,
                used: 0.0,
            },
            said: Vec::new(),
            scene,
        }
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
pub(super) fn smooth_normals(scene: &Scene) -> Vec<[DVec3; 3]> {
    let corners = Corners::new(scene);
    let smooth = corners.smooth();
    let all = 0..scene.triangles.len();
    all.map(|e| smooth.normals(e)).collect()
}
