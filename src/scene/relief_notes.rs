//! Notes for the user on a scene's relief: maps without effect, and maps that contradict each
//! other.

use glam::DVec2;

use super::tile::tile_size;
use super::{HeightMap, Material, NormalMap, Scene};

/// Samples along each axis of a normal map, at most.
const MOST_SAMPLES: u32 = 256;
/// Correlation of slopes below which two maps contradict each other, and above which a changed sign
/// makes them agree.
const CONTRADICTING: f64 = 0.5;
const AGREEING: f64 = 0.8;
/// Part of the normals' slopes that the heights lack, root mean square, from which on a note says so.
const LACKING: f64 = 0.3;

/// One sentence for each note on a material that a triangle uses.
pub(super) fn collect(scene: &Scene) -> Vec<String> {
    let mut notes = Vec::new();
    let mut used = vec![false; scene.materials.len()];
    for triangle in &scene.triangles {
        used[triangle.material as usize] = true;
    }
    for (index, material) in scene.materials.iter().enumerate() {
        if !used[index] {
            continue;
        }
        let found = match (&material.map_height, &material.map_normal) {
            (None, Some(map)) => Some(format!(
                "normal map {} makes no relief without a height map, which light by directions needs",
                map.path.display()
            )),
            (Some(map), _) if map.is_constant() => Some(format!(
                "height map {} is flat: there is no relief",
                map.path.display()
            )),
            (Some(_), _) if material.height_scale == 0.0 => {
                Some("the height scale is 0: there is no relief".into())
            }
            (Some(heights), Some(normals)) => tile_size(scene, index as u32)
                .and_then(|tile| contradiction(material, heights, normals, tile)),
            _ => None,
        };
        notes.extend(found.map(|what| format!("material \"{}\": {what}", material.name)));
    }
    notes
}

/// Products of the slopes of two maps, summed over the tile.
#[derive(Default)]
struct Slopes {
    of_heights: f64,
    of_normals: f64,
    across_u: f64,
    across_v: f64,
    /// Angles between the normals, radians.
    angle: f64,
    samples: f64,
}

impl Slopes {
    fn compare(material: &Material, heights: &HeightMap, normals: &NormalMap, tile: DVec2) -> Self {
        let scale = f64::from(material.height_scale);
        // Half a texel of the coarser map to either side.
        let step_u = 0.5 / f64::from(heights.width.min(normals.width));
        let step_v = 0.5 / f64::from(heights.height.min(normals.height));
        let mut sums = Self::default();
        for row in chosen(normals.height) {
            for column in chosen(normals.width) {
                let u = (f64::from(column) + 0.5) / f64::from(normals.width);
                let v = 1.0 - (f64::from(row) + 0.5) / f64::from(normals.height);
                let along = |du: f64, dv: f64| {
                    heights.sample(u + du, v + dv) - heights.sample(u - du, v - dv)
                };
                let h = DVec2::new(
                    along(step_u, 0.0) / (2.0 * step_u * tile.x),
                    along(0.0, step_v) / (2.0 * step_v * tile.y),
                ) * scale;
                let [x, y, z] =
                    normals.normals[(row * normals.width + column) as usize].map(f64::from);
                let n = -DVec2::new(x, y) / z;
                sums.of_heights += h.length_squared();
                sums.of_normals += n.length_squared();
                sums.across_u += h.x * n.x;
                sums.across_v += h.y * n.y;
                sums.angle += h.extend(-1.0).angle_between(n.extend(-1.0));
                sums.samples += 1.0;
            }
        }
        sums
    }

    /// Correlation if the slopes of the normals were multiplied by these signs.
    fn correlation(&self, sign_u: f64, sign_v: f64) -> f64 {
        let size = (self.of_heights * self.of_normals).sqrt();
        if size == 0.0 {
            return 0.0;
        }
        (sign_u * self.across_u + sign_v * self.across_v) / size
    }
}

/// Texels along an axis, all or evenly spaced ones.
fn chosen(size: u32) -> impl Iterator<Item = u32> {
    let count = size.min(MOST_SAMPLES);
    (0..count).map(move |i| (u64::from(i) * u64::from(size) / u64::from(count)) as u32)
}

fn contradiction(
    material: &Material,
    heights: &HeightMap,
    normals: &NormalMap,
    tile: DVec2,
) -> Option<String> {
    let slopes = Slopes::compare(material, heights, normals, tile);
    let correlation = slopes.correlation(1.0, 1.0);
    if correlation >= CONTRADICTING {
        let lacking = (1.0 - correlation * correlation).max(0.0).sqrt();
        return (lacking > LACKING).then(|| {
            format!(
                "light is that of height map {}, which lacks {:.0} % of the slopes of normal map \
                 {}: without the height map, heights are integrated from the normals",
                heights.path.display(),
                100.0 * lacking,
                normals.path.display()
            )
        });
    }
    let fixing_signs = [
        ([1.0, -1.0], "; with green (y) turned over they agree"),
        (
            [-1.0, -1.0],
            "; with the sign of the heights turned they agree",
        ),
        ([-1.0, 1.0], "; with red (x) turned over they agree"),
    ];
    let fix = fixing_signs
        .iter()
        .find(|([u, v], _)| slopes.correlation(*u, *v) > AGREEING)
        .map_or("", |(_, words)| words);
    Some(format!(
        "height map {} and normal map {} contradict each other: {:.0} degrees between their normals in the mean{fix}",
        heights.path.display(),
        normals.path.display(),
        (slopes.angle / slopes.samples).to_degrees()
    ))
}
