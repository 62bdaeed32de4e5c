//! `mesolux export`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{ArgMatches, Args, ValueEnum};
use glam::DVec3;

use super::bake::{SolveOptions, writable};
use super::bake_scene::BakeScene;
use super::baked::Wanted;
use super::develop::check_exposure;
use super::progress::{Bar, catch_interrupts, interrupted};
use super::{Builtin, DeviceOptions};
use mesolux::bake::lit_scene::LitScene;
use mesolux::error::{Error, Result};
use mesolux::export::baked_colours;
use mesolux::export::directional::files::Encoding;
use mesolux::export::directional::{Basis, Directional};
use mesolux::export::glb::{self, Shown};
use mesolux::export::light_map::LightMap;
use mesolux::export::map_files::{MapFile, Part};
use mesolux::export::probes::{self, Grid, ProbeFile, Probes};
use mesolux::export::sensors::{self, SensorFile, SensorGrid};
use mesolux::export::surface::{Layout, Surface, Texels};
use mesolux::export::vertex_light::VertexLight;
use mesolux::export::web;
use mesolux::math::directions;
use mesolux::scene::Scene;
use mesolux::solver::{LightAt, Lit, Place};

/// Write the light of a scene or a bake for other programs
///
/// Each output is an option of its own; one command may write several. A SCENE is baked first, with
/// the options of `bake`, and the bake is kept for the next time.
#[derive(Args)]
pub struct Options {
    /// A scene (see `bake`) or a bake (.safetensors)
    #[arg(value_name = "SCENE|BAKE")]
    input: String,
    #[command(flatten)]
    maps: MapOptions,
    #[command(flatten)]
    sensors: SensorOptions,
    #[command(flatten)]
    probes: ProbeOptions,
    #[command(flatten, next_help_heading = "Baking")]
    bake_scene: BakeScene,
    #[command(flatten)]
    solve: SolveOptions,
    #[command(flatten)]
    builtin: Builtin,
    #[command(flatten)]
    device: DeviceOptions,
}

#[derive(Args)]
#[command(next_help_heading = "Light maps")]
struct MapOptions {
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
    vertex_glb: Option<PathBuf>,
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
    fn is_wanted(&self) -> bool {
        let files = [&self.glb, &self.unlit_glb, &self.web];
        !self.light_map.is_empty() || files.into_iter().any(Option::is_some)
    }

    fn check(&self) -> Result<()> {
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
    fn write_vertices(&self, path: &Path, scene: &Scene, lit: &Lit<'_>) -> Result<()> {
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
}

#[derive(Args)]
#[command(next_help_heading = "Sensors")]
struct SensorOptions {
    /// Points with their normals, `x y z nx ny nz` a line, as Radiance reads them
    #[arg(long, value_name = "POINTS.pts", requires = "values")]
    sensors: Option<PathBuf>,
    /// Sensors on the mesh or material NAME, one each SPACING, HEIGHT above it, scene units; may be
    /// given several times
    #[arg(long, value_name = "NAME,SPACING[,HEIGHT]", value_parser = grid, requires = "values")]
    sensor_grid: Vec<SensorGrid>,
    /// Where to write the light at the sensors: .csv (lux and W/m², direct and indirect), .dat
    /// (W/m², red green blue), .ill (lux)
    #[arg(long, value_name = "OUT.csv|.dat|.ill")]
    values: Option<PathBuf>,
    /// Lumens of a watt, by which irradiance becomes lux: 179 as in Radiance; 683 gives the lux of
    /// lamps that are given in lumens, candelas or lux, and of IES files
    #[arg(long, value_name = "LM", default_value_t = sensors::RADIANCE_EFFICACY)]
    lumens_per_watt: f64,
}

fn grid(text: &str) -> std::result::Result<SensorGrid, String> {
    let wrong = || "must be like floor,0.5 or floor,0.5,0.85".to_owned();
    let words: Vec<&str> = text.split(',').collect();
    let (name, spacing, height) = match words.as_slice() {
        [name, spacing] => (name, spacing, "0"),
        [name, spacing, height] => (name, spacing, *height),
        _ => return Err(wrong()),
    };
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|n| n.is_finite());
    let spacing = number(spacing).filter(|&s| s > 0.0).ok_or_else(wrong)?;
    Ok(SensorGrid {
        name: (*name).to_owned(),
        spacing,
        height: number(height).ok_or_else(wrong)?,
    })
}

#[derive(Args)]
#[command(next_help_heading = "Probes")]
struct ProbeOptions {
    /// Write light at probes: irradiance in spherical harmonics of the second degree, and the walls
    /// about each, through which light between probes does not come; may be given several times
    #[arg(long, value_name = "OUT.json|.safetensors")]
    probes: Vec<PathBuf>,
    /// Probes along x, y and z in the box about the scene
    #[arg(long, value_name = "NXxNYxNZ", default_value = "8x4x8", value_parser = counts)]
    probe_grid: [u32; 3],
    /// Probes at the points of a file instead, `x y z` a line
    #[arg(
        long,
        value_name = "POINTS",
        requires = "probes",
        conflicts_with = "probe_grid"
    )]
    probe_points: Option<PathBuf>,
}

/// Most probes of a grid.
const MOST_PROBES: u32 = 100_000;

fn counts(text: &str) -> std::result::Result<[u32; 3], String> {
    let numbers: Vec<u32> = (text.split(['x', 'X', '×']))
        .map_while(|n| n.parse().ok().filter(|n| (1..=1024).contains(n)))
        .collect();
    match <[u32; 3]>::try_from(numbers) {
        Ok(counts)
            if text.split(['x', 'X', '×']).count() == 3
                && counts.iter().product::<u32>() <= MOST_PROBES =>
        {
            Ok(counts)
        }
        _ => Err(format!("must be like 8x4x8, {MOST_PROBES} probes at most")),
    }
}

impl ProbeOptions {
    fn check(&self) -> Result<()> {
        for path in &self.probes {
            ProbeFile::of(path)?;
            writable(path)?;
        }
        Ok(())
    }

    /// The grid, and the places of the probes; none where none are asked for.
    fn positions(&self, scene: &Scene) -> Result<(Option<Grid>, Vec<DVec3>)> {
        match &self.probe_points {
            _ if self.probes.is_empty() => Ok((None, Vec::new())),
            Some(path) => Ok((None, probes::read_positions(path)?)),
            None => {
                let grid = Grid::about(scene, self.probe_grid);
                Ok((Some(grid), grid.positions()))
            }
        }
    }

    fn write(
        &self,
        scene: &Scene,
        lit: &Lit<'_>,
        grid: Option<Grid>,
        positions: &[DVec3],
    ) -> Result<()> {
        catch_interrupts();
        let bar = Bar::new();
        let go_on = |found: usize| {
            bar.show(format!("light at {found} of {} probes", positions.len()));
            !interrupted()
        };
        let found = Probes::new(scene, lit, grid, positions, &go_on)?;
        bar.finish();
        let Some(found) = found else {
            let what = "probes: stopped by Ctrl-C, and not written";
            return Err(Error::Usage(what.into()));
        };
        let inside = found.list.iter().filter(|probe| !probe.valid).count();
        for path in &self.probes {
            found.write(path)?;
            tracing::info!(
                "{}: {} probes, {inside} of them within solids",
                path.display(),
                found.list.len()
            );
        }
        Ok(())
    }
}

/// Most sensors of one grid.
const MOST_SENSORS: usize = 10_000_000;

impl SensorOptions {
    fn check(&self) -> Result<()> {
        let Some(values) = &self.values else {
            return Ok(());
        };
        if self.sensors.is_none() && self.sensor_grid.is_empty() {
            return Err(Error::Usage(format!(
                "--values {}: of which sensors? --sensors or --sensor-grid says",
                values.display()
            )));
        }
        if !(self.lumens_per_watt.is_finite() && self.lumens_per_watt > 0.0) {
            let given = self.lumens_per_watt;
            let what = format!("--lumens-per-watt {given}: must be a positive number");
            return Err(Error::Usage(what));
        }
        SensorFile::of(values)?;
        writable(values)
    }

    fn places(&self, scene: &Scene) -> Result<Vec<Place>> {
        let mut places = match &self.sensors {
            Some(path) => sensors::read_points(path)?,
            None => Vec::new(),
        };
        for grid in &self.sensor_grid {
            places.extend(sensors::on_grid(scene, grid, MOST_SENSORS)?);
        }
        Ok(places)
    }
}

pub fn run(options: &Options, given: &ArgMatches) -> Result<()> {
    options.sensors.check()?;
    options.maps.check()?;
    options.probes.check()?;
    let maps = &options.maps;
    let is_wanted = maps.is_wanted() || maps.vertex_glb.is_some();
    if options.sensors.values.is_none() && !is_wanted && options.probes.probes.is_empty() {
        let what = "nothing to write: give --light-map, --glb, --vertex-glb, --web, --probes, or \
                    --values with --sensors";
        return Err(Error::Usage(what.into()));
    }
    let wanted = Wanted {
        input: &options.input,
        bake_scene: &options.bake_scene,
        solve: &options.solve,
        builtin: &options.builtin,
    };
    wanted.check(given)?;
    let opened = wanted.open()?;
    let places = options.sensors.places(&opened.scene)?;
    let (grid, positions) = options.probes.positions(&opened.scene)?;
    let device = options.device.open()?;
    let (scene, bake) = opened.baked(&device)?;
    if bake.by_paper {
        let what = "a bake of --preset paper or --estimator pixel has no light at other places";
        return Err(Error::Usage(what.into()));
    }
    let lit_scene = LitScene::new(&scene, &bake)?;
    let lit = lit_scene.look();
    if let Some(path) = &options.maps.vertex_glb {
        options.maps.write_vertices(path, &scene, &lit)?;
    }
    if options.maps.is_wanted() {
        let surface = laid_out(&scene, options.maps.layout())?;
        if let Some(encoding) = options.maps.encoding.of()? {
            encoding.basis().check(&surface.pages)?;
        }
        let map = light_map(&surface, &lit)?;
        // First what is quick, lest Ctrl-C take it along.
        options.maps.write_glb(&surface, &map)?;
        options.maps.write(&surface, &map, &lit)?;
    }
    if !positions.is_empty() {
        options.probes.write(&scene, &lit, grid, &positions)?;
    }
    if let Some(path) = &options.sensors.values {
        let light = at_places(&lit, &places)?;
        let efficacy = options.sensors.lumens_per_watt;
        sensors::write_light(path, &places[..light.len()], &light, efficacy)?;
        tracing::info!("{}: {} sensors", path.display(), light.len());
        if light.len() < places.len() {
            let missing = places.len() - light.len();
            tracing::warn!("{missing} sensors are missing: stopped by Ctrl-C");
        }
    }
    options.device.check()
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

/// Places that are looked at between two looks at the keyboard.
const AT_ONCE: usize = 512;

/// Light at places, of as many as there is time for before Ctrl-C.
fn at_places(lit: &Lit<'_>, places: &[Place]) -> Result<Vec<LightAt>> {
    catch_interrupts();
    let bar = Bar::new();
    let mut light = Vec::with_capacity(places.len());
    for some in places.chunks(AT_ONCE) {
        light.extend(lit.at(some)?);
        bar.show(format!(
            "light at {} of {} places",
            light.len(),
            places.len()
        ));
        if interrupted() {
            break;
        }
    }
    bar.finish();
    Ok(light)
}
