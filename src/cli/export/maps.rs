//! Options of light maps, and of what carries one.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};

use crate::cli::develop::check_exposure;
use crate::cli::output::writable;
use crate::cli::progress::{Bar, catch_interrupts, interrupted};
use mesolux::error::{Error, Result};
use mesolux::export::baked_colours;
use mesolux::export::directional::files::Encoding;
use mesolux::export::directional::{Basis, Directional};
use mesolux::export::glb::{self, Shown};
use mesolux::export::light_map::LightMap;
use mesolux::export::map_files::{MapFile, Part};
use mesolux::export::surface::{Layout, Surface, Texels};
use mesolux::export::vertex_light::VertexLight;
use mesolux::export::web;
use mesolux::math::directions;
use mesolux::scene::Scene;
use mesolux::solver::Lit;

#[derive(Args)]
#[command(next_help_heading = "Light maps")]
pub struct MapOptions {
    /// Write a light map, irradiance in W/m²: .exr (half floats), .hdr, .ktx2 (BC6H), .rgbm.png or
    /// .png (sRGB); may be given several times. Several pages are OUT-1, OUT-2 and so on
    #[arg(long, value_name = "OUT.exr|.hdr|.ktx2|.rgbm.png|.png")]
    light_map: Vec<PathBuf>,
    /// Write the scene as binary glTF with its light map (MOZ_lightmap, TEXCOORD_1)
    #[arg(long, value_name = "OUT.glb")]
    glb: Option<PathBuf>,
    /// Write the scene as binary glTF with light and colour baked together (KHR_materials_unlit),
    /// which every viewer shows alike
    #[arg(long, value_name = "OUT.glb")]
    unlit_glb: Option<PathBuf>,
    /// Write the elements of the bake as binary glTF with their light as colours of the vertices
    /// (COLOR_0, KHR_materials_unlit) and as irradiance in W/m² (_IRRADIANCE), without any map
    #[arg(long, value_name = "OUT.glb")]
    pub vertex_glb: Option<PathBuf>,
    /// Write a folder with a page that shows the scene with its light in a browser, for any static
    /// server; it needs nothing from elsewhere
    #[arg(long, value_name = "DIR")]
    web: Option<PathBuf>,
    /// Exposure of baked colours and of the page: multiplies the light by 2^EV; found from the
    /// texels if not given
    #[arg(long, value_name = "EV", allow_hyphen_values = true)]
    exposure: Option<f32>,
    /// What light maps say of the directions from which light comes, for surfaces with normal maps;
    /// .exr only
    #[arg(long, value_enum, default_value_t = Encoded::Irradiance)]
    encoding: Encoded,
    /// The light that light maps hold
    #[arg(long, value_enum, default_value_t = Light::Global)]
    light: Light,
    /// Texels a side of a page
    #[arg(long, value_name = "N", default_value_t = 1024)]
    page: u32,
    /// Texels a scene unit, on as many pages as that needs [default: as fit on one page]
    #[arg(long, value_name = "X")]
    texels_per_unit: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Light {
    Global,
    Direct,
    Indirect,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Encoded {
    /// Irradiance alone
    Irradiance,
    /// Layers L0, L1x, L1y, L1z: E(n) = L0 + n · L1
    L1,
    /// Irradiance, and a layer with the dominant direction and how much of the light has it
    Dominant,
    /// A layer for each of 16 directions about the surface
    Slots16,
    /// For each of 32
    Slots32,
    /// For each of 64
    Slots64,
    /// For each of 128
    Slots128,
    /// Unity's: OUT.exr and OUT_dir.png
    Unity,
    /// Bakery's SH for Unity: OUT_L0.exr, OUT_L1x.png, OUT_L1y.png, OUT_L1z.png
    Bakery,
    /// Godot's: one image of four below each other
    Godot,
    /// Frostbite's: OUT_L0.exr, OUT_R.png, OUT_G.png, OUT_B.png
    Frostbite,
}

impl Encoded {
    fn of(self) -> Result<Option<Encoding>> {
        let slots = |count| Ok(Some(Encoding::Slots(directions::Directions::new(count)?)));
        match self {
            Self::Irradiance => Ok(None),
            Self::L1 => Ok(Some(Encoding::L1)),
            Self::Dominant => Ok(Some(Encoding::Dominant)),
            Self::Slots16 => slots(16),
            Self::Slots32 => slots(32),
            Self::Slots64 => slots(64),
            Self::Slots128 => slots(128),
            Self::Unity => Ok(Some(Encoding::Unity)),
            Self::Bakery => Ok(Some(Encoding::Bakery)),
            Self::Godot => Ok(Some(Encoding::Godot)),
            Self::Frostbite => Ok(Some(Encoding::Frostbite)),
        }
    }
}

/// Smallest and largest page.
const PAGES: std::ops::RangeInclusive<u32> = 16..=8192;

impl MapOptions {
    pub fn is_wanted(&self) -> bool {
        let files = [&self.glb, &self.unlit_glb, &self.web];
        !self.light_map.is_empty() || files.into_iter().any(Option::is_some)
    }

    pub fn check(&self) -> Result<()> {
        for path in &self.light_map {
            let kind = MapFile::of(path)?;
            if self.encoding != Encoded::Irradiance && kind != MapFile::Exr {
                return Err(Error::Usage(format!(
                    "light map {}: with --encoding the name must end in .exr",
                    path.display()
                )));
            }
            writable(path)?;
        }
        if self.encoding != Encoded::Irradiance && self.light_map.is_empty() {
            let what = "--encoding is of a --light-map, and none is asked for";
            return Err(Error::Usage(what.into()));
        }
        for path in [&self.glb, &self.unlit_glb, &self.vertex_glb]
            .into_iter()
            .flatten()
        {
            if !path
                .extension()
                .is_some_and(|e| e.eq_ignore_ascii_case("glb"))
            {
                let what = format!("{}: the name must end in .glb", path.display());
                return Err(Error::Usage(what));
            }
            writable(path)?;
        }
        check_exposure(self.exposure)?;
        if !PAGES.contains(&self.page) {
            return Err(Error::Usage(format!(
                "--page {}: must be in {} to {}",
                self.page,
                PAGES.start(),
                PAGES.end()
            )));
        }
        if self.has_blocks() && !self.page.is_multiple_of(4) {
            let page = self.page;
            let what = format!("--page {page}: must be a multiple of 4 for .ktx2");
            return Err(Error::Usage(what));
        }
        match self.texels_per_unit {
            Some(count) if !(count.is_finite() && count > 0.0) => Err(Error::Usage(format!(
                "--texels-per-unit {count}: must be a positive number"
            ))),
            _ => Ok(()),
        }
    }

    fn layout(&self) -> Layout {
        let texels = match self.texels_per_unit {
            None => Texels::Page(self.page),
            Some(count) => Texels::PerUnit {
                count,
                page: self.page,
            },
        };
        Layout {
            texels,
            whole_blocks: self.has_blocks(),
        }
    }

    /// Whether a light map is written in blocks.
    fn has_blocks(&self) -> bool {
        let is_ktx2 = |path: &PathBuf| MapFile::of(path).is_ok_and(|kind| kind == MapFile::Ktx2);
        self.light_map.iter().any(is_ktx2)
    }

    fn part(&self) -> Part {
        match self.light {
            Light::Global => Part::Global,
            Light::Direct => Part::Direct,
            Light::Indirect => Part::Indirect,
        }
    }

    /// The elements with their light at vertices.
    pub fn write_vertices(&self, path: &Path, scene: &Scene, lit: &Lit<'_>) -> Result<()> {
        catch_interrupts();
        let bar = Bar::new();
        let start = Instant::now();
        let go_on = |looked_at: usize| {
            bar.show(format!("light at vertices: {looked_at} places"));
            !interrupted()
        };
        let light = VertexLight::new(scene, lit, &go_on);
        bar.finish();
        let light = light?;
        tracing::info!(
            "{} vertices, light found at {} places in {:.1} s",
            light.light.len(),
            light.looked_at,
            start.elapsed().as_secs_f64()
        );
        let colours = baked_colours::corners(&light, self.part(), self.exposure);
        for what in glb::write(path, &light.surface, Shown::Vertices(&colours))? {
            tracing::warn!("{what}");
        }
        let (path, ev) = (path.display(), colours.exposure);
        tracing::info!("{path}: colours of vertices, exposure {ev}");
        Ok(())
    }

    /// The scene with its light as glTF.
    fn write_glb(&self, surface: &Surface, map: &LightMap) -> Result<()> {
        let part = self.part();
        let mut said = Vec::new();
        if let Some(path) = &self.glb {
            said = glb::write(path, surface, Shown::LightMap(map, part))?;
            tracing::info!("{}: light map of scale {}", path.display(), map.scale(part));
        }
        if let Some(path) = &self.unlit_glb {
            let (pages, ev) = baked_colours::pages(surface, map, part, self.exposure)?;
            said = glb::write(path, surface, Shown::Baked(&pages))?;
            tracing::info!("{}: baked colours, exposure {ev}", path.display());
        }
        if let Some(folder) = &self.web {
            said = web::write(folder, surface, map, self.exposure)?;
            let folder = folder.display();
            tracing::info!("{folder}: a page; python3 -m http.server -d {folder} shows it");
        }
        for what in said {
            tracing::warn!("{what}");
        }
        Ok(())
    }

    fn write(&self, surface: &Surface, map: &LightMap, lit: &Lit<'_>) -> Result<()> {
        if let Some(encoding) = self.encoding.of()? {
            let light = by_direction(surface, map, lit, encoding.basis(), self.part())?;
            for path in &self.light_map {
                for path in encoding.write(path, surface, map, &light)? {
                    tracing::info!("{}: light map by direction", path.display());
                }
            }
            return Ok(());
        }
        for path in &self.light_map {
            let written = map.write(path, self.part())?;
            let kind = MapFile::of(path)?;
            let scale = match kind {
                MapFile::Rgbm | MapFile::Srgb => format!(", scale {}", map.scale(self.part())),
                MapFile::Exr | MapFile::Hdr | MapFile::Ktx2 => String::new(),
            };
            for path in written {
                tracing::info!("{}: light map{scale}", path.display());
            }
        }
        Ok(())
    }

    /// Writes all that has a light map.
    pub fn write_maps(&self, scene: &Scene, lit: &Lit<'_>) -> Result<()> {
        let surface = laid_out(scene, self.layout())?;
        if let Some(encoding) = self.encoding.of()? {
            encoding.basis().check(&surface.pages)?;
        }
        let map = light_map(&surface, lit)?;
        // First what is quick, lest Ctrl-C take it along.
        self.write_glb(&surface, &map)?;
        self.write(&surface, &map, lit)
    }
}

/// The scene's surface, laid out.
fn laid_out(scene: &Scene, layout: Layout) -> Result<Surface> {
    catch_interrupts();
    let start = Instant::now();
    let surface = Surface::new(scene, layout, || !interrupted())?;
    for what in &surface.said {
        tracing::warn!("{what}");
    }
    let pages = surface.pages;
    tracing::info!(
        "{} charts on {} pages of {} x {}, {:.0} % used, {:.4} texels a unit, in {:.1} s",
        pages.charts,
        pages.count,
        pages.width,
        pages.height,
        100.0 * pages.used,
        pages.texels_per_unit,
        start.elapsed().as_secs_f64()
    );
    Ok(surface)
}

/// The light at the texels of a surface.
fn light_map(surface: &Surface, lit: &Lit<'_>) -> Result<LightMap> {
    catch_interrupts();
    let bar = Bar::new();
    let start = Instant::now();
    let go_on = |looked_at: usize| {
        bar.show(format!("light map: {looked_at} places"));
        !interrupted()
    };
    let map = LightMap::new(surface, lit, &go_on)?;
    bar.finish();
    tracing::info!(
        "{} texels, light found at {} places in {:.1} s",
        map.light.len(),
        map.looked_at,
        start.elapsed().as_secs_f64()
    );
    if map.stopped {
        tracing::warn!("the light map is interpolated in parts: stopped by Ctrl-C");
    }
    Ok(map)
}

/// Light by direction at the texels.
fn by_direction(
    surface: &Surface,
    map: &LightMap,
    lit: &Lit<'_>,
    basis: Basis,
    part: Part,
) -> Result<Directional> {
    let bar = Bar::new();
    let start = Instant::now();
    let go_on = |looked_at: usize| {
        bar.show(format!("light by direction: {looked_at} places"));
        !interrupted()
    };
    let found = Directional::new(surface, map, lit, basis, part, &go_on);
    bar.finish();
    let seconds = start.elapsed().as_secs_f64();
    tracing::info!("light by direction in {seconds:.1} s");
    found
}
