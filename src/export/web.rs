//! A folder with a page that shows a scene with its light, for any static server.

use std::path::Path;

use serde_json::json;

use super::baked_colours;
use super::glb::{self, Shown};
use super::light_map::LightMap;
use super::map_files::{MapFile, Part};
use super::surface::Surface;
use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};

const PAGE: &str = include_str!("web/index.html");
const VIEWER: &str = include_str!("web/viewer.js");

/// Writes `index.html`, `viewer.js`, `scene.glb`, `scene.json` and the pages of direct and indirect
/// light; returns what of the scene glTF cannot hold. Without `exposure`, the page begins with that
/// of [`baked_colours::pages`].
///
/// # Errors
/// A file that cannot be written.
pub fn write(
    folder: &Path,
    surface: &Surface,
    map: &LightMap,
    exposure: Option<f32>,
) -> Result<Vec<String>> {
    std::fs::create_dir_all(folder).map_err(|source| Error::write(folder, source))?;
    let exposure = match exposure {
        Some(exposure) => exposure,
        None => baked_colours::pages(surface, map, Part::Global, None)?.1,
    };
    let name = |part: &str, page: u32| format!("{part}-{}.png", page + 1);
    for (part, label) in [(Part::Direct, "direct"), (Part::Indirect, "indirect")] {
        for page in 0..map.pages.count {
            let path = folder.join(name(label, page));
            map.page(page, part)
                .write(&path, MapFile::Rgbm, map.scale(part))?;
        }
    }
    let shown = Shown::LightMap(map, Part::Global);
    let said = glb::write(&folder.join("scene.glb"), surface, shown)?;
    let pages: Vec<_> = (0..map.pages.count)
        .map(|page| json!({ "direct": name("direct", page), "indirect": name("indirect", page) }))
        .collect();
    let about = json!({
        "name": surface.scene.name,
        "exposure": exposure,
        "scales": { "direct": map.scale(Part::Direct), "indirect": map.scale(Part::Indirect) },
        "pages": pages,
    });
    for (name, text) in [
        ("scene.json", about.to_string()),
        ("viewer.js", VIEWER.to_owned()),
        // Last, so that a page is never beside another scene.
        ("index.html", PAGE.to_owned()),
    ] {
        write_atomically(&folder.join(name), |out| out.write_all(text.as_bytes()))?;
    }
    Ok(said)
}
