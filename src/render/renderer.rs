//! A scene on the device, ready to be drawn from one camera after the other.

use std::sync::Arc;

use super::gathered::Gathered;
use super::lights::light_buffers;
use super::mesh::Mesh;
use super::picture::{Picture, SAMPLES};
use super::projection::{NEAR, Projection, Tile};
use super::relief::Relief;
use super::relief_scene::ReliefScene;
use super::textures::{Bound, Textures};
use super::{Lighting, Overdraw, Show, View};
use crate::error::Result;
use crate::passes::shade::{Shade, Target};
use crate::passes::shadow_rays::LightBuffers;
use crate::scene::Scene;
use crate::vk::{Commands, Device, Timestamps};

/// Pixels along a side of a tile: 2048² samples take 64 MiB of colour, as much again to read them, and 16 MiB of depth.
const TILE: u32 = 2048 / SAMPLES;

/// Marks a pixel of a plain triangle where relief is counted.
const NOT_RELIEF: f32 = 2.0;

/// Draws a view of a scene, as a picture or again and again.
pub struct Renderer<'a> {
    device: Arc<Device>,
    scene: &'a Scene,
    lighting: Lighting<'a>,
    /// Pixels across and down.
    size: (u32, u32),
    projection: Projection,
    shade: Shade,
    textures: Textures,
    kept: Option<ReliefScene>,
    samples: u32,
    lights: LightBuffers,
    bound: Bound,
    mesh: Mesh,
    relief: Option<Relief>,
}

impl<'a> Renderer<'a> {
    /// For so many samples along a pixel's side: SAMPLES for [`Self::picture`], 1 for [`Self::frames`].
    ///
    /// # Errors
    /// As [`super::render`].
    pub fn new(
        device: &Arc<Device>,
        scene: &'a Scene,
        lighting: Lighting<'a>,
        view: &View<'a>,
        samples: u32,
    ) -> Result<Self> {
        Self::with_depths(device, scene, lighting, view, samples, false)
    }

    /// With `depths`, [`Self::picture_while`] tells how far away what it shows is.
    ///
    /// # Errors
    /// As [`super::render`].
    pub fn with_depths(
        device: &Arc<Device>,
        scene: &'a Scene,
        lighting: Lighting<'a>,
        view: &View<'a>,
        samples: u32,
        depths: bool,
    ) -> Result<Self> {
        assert_eq!(
            lighting.irradiance.len(),
            scene.triangles.len(),
            "one irradiance a triangle"
        );
        view.check()?;
        let projection = Projection::new(scene, view)?;
        let shade = Shade::new(device, depths)?;
        let textures = Textures::new(device, scene)?;
        let kept = ReliefScene::new(device, &shade, scene, &lighting)?;
        let (lights, shafts) = light_buffers(device, scene, &lighting, &projection)?;
        let seen = (&projection, samples);
        let shared = (&textures, &lights);
        let relief = Relief::new(device, kept.as_ref(), scene, &lighting, shared, seen)?;
        let rest = relief.as_ref().map(|r| &r.mesh.rest);
        let rest = (rest, shafts.as_ref());
        let mesh = Mesh::new(device, scene, &lighting, &projection, rest)?;
        Ok(Self {
            bound: textures.bind(&shade, &lights, &mesh.lit)?,
            lights,
            mesh,
            relief,
            device: Arc::clone(device),
            scene,
            lighting,
            size: (view.width, view.height),
            projection,
            shade,
            textures,
            kept,
            samples,
        })
    }

    /// Turns to another view, keeping pipelines, textures and what of the relief and its light does not depend on the view.
    ///
    /// # Errors
    /// As [`super::render`]; what was seen before stays then.
    pub fn look(&mut self, view: &View<'_>) -> Result<()> {
        view.check()?;
        let (device, scene) = (&self.device, self.scene);
        let (lighting, kept) = (&self.lighting, self.kept.as_ref());
        let projection = Projection::new(scene, view)?;
        let (lights, shafts) = light_buffers(device, scene, lighting, &projection)?;
        let seen = (&projection, self.samples);
        let shared = (&self.textures, &lights);
        let relief = Relief::new(device, kept, scene, lighting, shared, seen)?;
        let rest = relief.as_ref().map(|r| &r.mesh.rest);
        let rest = (rest, shafts.as_ref());
        let mesh = Mesh::new(device, scene, lighting, &projection, rest)?;
        self.bound = self.textures.bind(&self.shade, &lights, &mesh.lit)?;
        self.lights = lights;
        self.mesh = mesh;
        self.relief = relief;
        self.projection = projection;
        self.size = (view.width, view.height);
        Ok(())
    }

    /// SAMPLES × SAMPLES samples a pixel, tile by tile.
    pub fn picture(&self) -> Result<Picture> {
        match self.lighting.show {
            Show::Overdraw => Ok(self.overdraw()?.picture()),
            // Colours that are looked up in a legend are not exposed.
            Show::Slots => Ok(Picture {
                automatic_exposure: 0.0,
                ..self.gathered()?
            }),
            _ => self.gathered(),
        }
    }

    /// As [`Self::picture`], in tiles of so many pixels a side, at each of which `go_on` may give the picture up; and of each
    /// pixel how far along the view its middle is, internal units, 0 where nothing is. Nothing of a renderer without depths.
    ///
    /// # Errors
    /// A device that fails.
    pub fn picture_while(
        &self,
        tile: u32,
        go_on: impl FnMut() -> bool,
    ) -> Result<Option<(Picture, Vec<f32>)>> {
        self.tiles(tile.clamp(1, TILE), go_on)
    }

    /// What [`Show::Overdraw`] counts.
    ///
    /// # Errors
    /// A device that fails.
    pub fn overdraw(&self) -> Result<Overdraw> {
        assert_eq!(
            self.lighting.show,
            Show::Overdraw,
            "what is drawn must be counts"
        );
        Ok(Overdraw::new(&self.gathered()?))
    }

    fn gathered(&self) -> Result<Picture> {
        let whole = self.tiles(TILE, || true)?.map(|whole| whole.0);
        Ok(whole.expect("a picture that nothing gives up is whole"))
    }

    fn tiles(
        &self,
        side: u32,
        mut go_on: impl FnMut() -> bool,
    ) -> Result<Option<(Picture, Vec<f32>)>> {
        let (width, height) = self.size;
        let target = Target::new(
            &self.device,
            &self.shade,
            (width.min(side) * SAMPLES, height.min(side) * SAMPLES),
        )?;
        let mut gathered = Gathered::new(self.size);
        let mut distances = Vec::new();
        for row in (0..height).step_by(side as usize) {
            for column in (0..width).step_by(side as usize) {
                if !go_on() {
                    return Ok(None);
                }
                let tile = Tile {
                    column,
                    row,
                    width: side.min(width - column),
                    height: side.min(height - row),
                };
                Commands::run(&self.device, "shade", |cmd| {
                    self.record(cmd, &target, (tile, SAMPLES), None, || ());
                    Ok(())
                })?;
                gathered.add(
                    tile,
                    &target.rows(tile.height * SAMPLES),
                    target.width as usize,
                );
                if let Some(depths) = target.depths(tile.height * SAMPLES) {
                    distances.resize(width as usize * height as usize, 0.0);
                    for place in 0..tile.width * tile.height {
                        let (x, y) = (place % tile.width, place / tile.width);
                        let sample = (y * SAMPLES + SAMPLES / 2) * target.width;
                        let depth = depths[(sample + x * SAMPLES + SAMPLES / 2) as usize];
                        let pixel = (tile.row + y) * width + tile.column + x;
                        distances[pixel as usize] = if depth > 0.0 { NEAR / depth } else { 0.0 };
                    }
                }
            }
        }
        Ok(Some((gathered.into_picture(), distances)))
    }

    /// Draws the whole view `count` times with one sample a pixel, as a window would; seconds of each by GPU timestamps.
    pub fn frames(&self, count: usize) -> Result<Vec<f64>> {
        let (target, tile) = self.whole()?;
        let stamps = Timestamps::new(&self.device, "frame", 2)?;
        (0..count)
            .map(|_| {
                Commands::run(&self.device, "frame", |cmd| {
                    cmd.reset_timestamps(&stamps);
                    cmd.timestamp(&stamps, 0);
                    self.record(cmd, &target, (tile, 1), None, || cmd.timestamp(&stamps, 1));
                    Ok(())
                })?;
                Ok(stamps.intervals()?[0])
            })
            .collect()
    }

    /// Of the plain triangles that light points light, those that nothing stands between and the lights, see
    /// [`Lighting::skip_open`], and all.
    pub fn open_triangles(&self) -> [usize; 2] {
        self.mesh.open
    }

    /// The share of the pixels of such a frame that show relief by rays.
    pub fn relief_coverage(&self) -> Result<f64> {
        let (target, tile) = self.whole()?;
        Commands::run(&self.device, "coverage", |cmd| {
            self.record(cmd, &target, (tile, 1), Some(NOT_RELIEF), || ());
            Ok(())
        })?;
        let rows = target.rows(tile.height);
        let empty = |p: &&[f32; 4]| p[3] == NOT_RELIEF || **p == [0.0; 4];
        let elsewhere = rows.iter().filter(empty).count();
        Ok(1.0 - elsewhere as f64 / rows.len() as f64)
    }

    /// A target for one sample of each pixel, and the tile that is the whole view.
    fn whole(&self) -> Result<(Target, Tile)> {
        let (width, height) = self.size;
        let tile = Tile {
            column: 0,
            row: 0,
            width,
            height,
        };
        Ok((
            Target::new(&self.device, &self.shade, (width, height))?,
            tile,
        ))
    }

    /// `mark` stands in place of the meter's flag on plain triangles; `drawn` is recorded after all draws, before anything
    /// is copied.
    fn record(
        &self,
        cmd: &Commands,
        target: &Target,
        (tile, samples): (Tile, u32),
        mark: Option<f32>,
        drawn: impl FnOnce(),
    ) {
        let part = self.lighting.part;
        let seen = (&self.projection, tile);
        let counts = self.lights.counts;
        let plain = self.mesh.draws(self.scene, &self.bound, seen, part, counts);
        self.shade.record(
            cmd,
            target,
            (tile.width * samples, tile.height * samples),
            (&self.mesh.vertices, &self.mesh.indices),
            plain
                .filter(|_| self.lighting.show != Show::Overdraw)
                .map(|mut draw| {
                    draw.parameters.metered = mark.unwrap_or(draw.parameters.metered);
                    draw
                }),
            || {
                if let Some(relief) = &self.relief {
                    let place = (tile, samples);
                    let seen = (&self.projection, &self.lights);
                    relief.record(cmd, self.scene, &self.lighting, seen, place);
                }
                drawn();
            },
        );
    }
}
