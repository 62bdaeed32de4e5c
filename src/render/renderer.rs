//! A scene on the device, ready to be drawn from one camera after another.

use std::sync::Arc;

use super::background::{BEHIND, draw_sky};
use super::gathered::Gathered;
use super::prepared::{Fixed, ViewParts};
use super::relief::ReliefTarget;
use super::seen_scene::SeenScene;
use super::{Lighting, Overdraw, Show, View};
use crate::error::Result;
use crate::passes::pass_parts::PART_TRIANGLES;
use crate::passes::shade::{self, Target};
use crate::picture::{Picture, SAMPLES, Tile};
use crate::scene::Scene;
use crate::vk::{Commands, Device, Timestamps};

/// Samples along a side of a tile, each a submission: 16 of the squares that lavapipe shares among
/// its cores. With tiles of 160 samples pictures took up to 8 % longer.
const TILE: u32 = 256;

/// How draws of a view are cut. The picture does not depend on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cuts {
    /// Whether a tile leaves out the triangles that do not reach into it.
    pub by_tile: bool,
    /// Triangles of a part of a submission, at most; a prism has eight.
    pub part_triangles: u32,
}

impl Default for Cuts {
    fn default() -> Self {
        Self {
            by_tile: true,
            part_triangles: PART_TRIANGLES,
        }
    }
}

/// Most samples along a pixel's side; SAMPLES divides it, and it a tile's side.
pub const MOST_SAMPLES: u32 = 32;

/// Marks pixels of plain triangles when pixels of relief are counted.
const NOT_RELIEF: f32 = 2.0;

/// Draws views of a scene, each as one picture or as frames.
pub struct Renderer<'a> {
    fixed: Fixed<'a>,
    view: ViewParts,
    pub cuts: Cuts,
}

/// Where a tile is drawn.
struct Canvas {
    target: Target,
    relief: Option<ReliefTarget>,
}

impl<'a> Renderer<'a> {
    /// `samples` is the number of samples along a pixel's side: SAMPLES or a multiple of it, up to
    /// [`MOST_SAMPLES`], for [`Self::picture`], 1 for [`Self::frames`].
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
        assert_eq!(
            lighting.irradiance.len(),
            scene.triangles.len(),
            "one irradiance a triangle"
        );
        view.check()?;
        let fixed = Fixed::new(device, scene, lighting, samples)?;
        let view = ViewParts::new(&fixed, view)?;
        Ok(Self {
            fixed,
            view,
            cuts: Cuts::default(),
        })
    }

    /// Turns to another view. Pipelines, textures, and the part of the relief and its light that
    /// does not depend on the view are kept.
    ///
    /// # Errors
    /// As [`super::render`]; the view before stays then.
    pub fn look(&mut self, view: &View<'_>) -> Result<()> {
        view.check()?;
        self.view = ViewParts::new(&self.fixed, view)?;
        Ok(())
    }

    /// All samples of the view, tile by tile.
    pub fn picture(&self) -> Result<Picture> {
        match self.fixed.lighting.show {
            Show::Overdraw => Ok(self.overdraw()?.picture()),
            // What is no light is not exposed.
            Show::Slots | Show::Albedo | Show::Normal | Show::Height => Ok(Picture {
                automatic_exposure: 0.0,
                ..self.gathered()?
            }),
            _ => self.gathered(),
        }
    }

    /// As [`Self::picture`]; `go_on` is asked after each tile, with what is there so far. When it
    /// returns false, drawing stops and the result is None.
    ///
    /// # Errors
    /// A device that fails.
    #[cfg(feature = "window")]
    pub(crate) fn picture_while(
        &self,
        go_on: impl FnMut(Tile, &Gathered) -> bool,
    ) -> Result<Option<Picture>> {
        self.tiles(go_on)
    }

    /// What [`Show::Overdraw`] counts.
    ///
    /// # Errors
    /// A device that fails.
    pub fn overdraw(&self) -> Result<Overdraw> {
        assert_eq!(
            self.fixed.lighting.show,
            Show::Overdraw,
            "what is drawn must be counts"
        );
        Ok(Overdraw::new(&self.gathered()?))
    }

    fn gathered(&self) -> Result<Picture> {
        let whole = self.tiles(|_, _| true)?;
        Ok(whole.expect("nothing stops this picture"))
    }

    /// While a tile is drawn, the samples of the one before are resolved.
    fn tiles(&self, mut go_on: impl FnMut(Tile, &Gathered) -> bool) -> Result<Option<Picture>> {
        let (width, height) = self.view.size;
        let samples = self.fixed.samples;
        assert!(
            samples.is_multiple_of(SAMPLES) && samples <= MOST_SAMPLES,
            "a multiple of {SAMPLES}"
        );
        let side = TILE / samples;
        let canvas = || self.canvas((width.min(side) * samples, height.min(side) * samples));
        let canvases = [canvas()?, canvas()?];
        let mut gathered = Gathered::new(self.view.size, samples);
        let mut before = None;
        for (i, tile) in Tile::of((width, height), side).enumerate() {
            let canvas = &canvases[i % 2];
            let mut commands = Commands::record(&self.fixed.device, "shade", |cmd| {
                self.record(cmd, canvas, tile, samples, None, || ());
                Ok(())
            })?;
            commands.submit()?;
            if let Some((tile, commands, canvas)) = before.replace((tile, commands, canvas)) {
                self.take_in(tile, commands, canvas, &mut gathered)?;
                if !go_on(tile, &gathered) {
                    return Ok(None);
                }
            }
        }
        if let Some((tile, commands, canvas)) = before {
            self.take_in(tile, commands, canvas, &mut gathered)?;
            go_on(tile, &gathered);
        }
        Ok(Some(gathered.into_picture()))
    }

    /// Waits for a tile and resolves it.
    fn take_in(
        &self,
        tile: Tile,
        mut commands: Commands,
        canvas: &Canvas,
        gathered: &mut Gathered,
    ) -> Result<()> {
        commands.wait()?;
        let target = &canvas.target;
        let per_side = self.fixed.samples;
        let (rows, stride) = (tile.height * per_side, target.width);
        let mut add = |samples: &[[f32; 4]]| gathered.add(tile, samples, stride as usize);
        match self.fixed.sky() {
            None => target.look_at_rows(rows, add),
            Some(sky) => {
                let mut samples = target.rows(rows);
                let projection = &self.view.projection;
                draw_sky(sky, projection, (tile, per_side), &mut samples, stride);
                add(&samples);
            }
        }
        Ok(())
    }

    /// Draws the whole view `count` times with one sample a pixel, as a window would. Returns the
    /// seconds of each frame by GPU timestamps.
    pub fn frames(&self, count: usize) -> Result<Vec<f64>> {
        let (canvas, tile) = self.whole()?;
        let stamps = Timestamps::new(&self.fixed.device, "frame", 2)?;
        (0..count)
            .map(|_| {
                Commands::run(&self.fixed.device, "frame", |cmd| {
                    cmd.reset_timestamps(&stamps);
                    cmd.timestamp(&stamps, 0);
                    self.record(cmd, &canvas, tile, 1, None, || cmd.timestamp(&stamps, 1));
                    cmd.read_back_timestamps(&stamps);
                    Ok(())
                })?;
                Ok(stamps.intervals()[0])
            })
            .collect()
    }

    /// Plain triangles that light points light: those with nothing between them and the lights (see
    /// [`Lighting::skip_open`]), and all.
    pub fn open_triangles(&self) -> [usize; 2] {
        self.view.mesh.open
    }

    /// Triangles and prisms that the tiles of a picture draw, and what they drew if each drew all.
    pub fn drawn(&self) -> [usize; 2] {
        let ViewParts { mesh, relief, .. } = &self.view;
        let mut counts = [0; 2];
        for tile in Tile::of(self.view.size, TILE / self.fixed.samples) {
            let plain = mesh.drawn(tile, self.cuts);
            let prisms = relief
                .as_ref()
                .map(|relief| relief.mesh.drawn(tile, self.cuts));
            for of in [plain, prisms.unwrap_or_default()] {
                (0..2).for_each(|k| counts[k] += of[k]);
            }
        }
        counts
    }

    /// Number of parts of plain triangles that follow shadow rays, that see all of each light, and
    /// that see none.
    pub fn parts(&self) -> [usize; 3] {
        self.view.mesh.parts
    }

    /// Number of prisms over relief in the picture whose ways to lights are followed past other
    /// surfaces, of those that see all of each light, and of those that see none.
    pub fn prisms(&self) -> [usize; 3] {
        let relief = self.view.relief.as_ref();
        relief.map_or([0; 3], |relief| relief.mesh.states)
    }

    /// Share of a frame's pixels that show relief drawn by rays.
    pub fn relief_coverage(&self) -> Result<f64> {
        let (canvas, tile) = self.whole()?;
        Commands::run(&self.fixed.device, "coverage", |cmd| {
            self.record(cmd, &canvas, tile, 1, Some(NOT_RELIEF), || ());
            Ok(())
        })?;
        let rows = canvas.target.rows(tile.height);
        let empty = |p: &&[f32; 4]| p[3] == NOT_RELIEF || **p == [0.0; 4];
        let elsewhere = rows.iter().filter(empty).count();
        Ok(1.0 - elsewhere as f64 / rows.len() as f64)
    }

    /// Where so many samples across and down are drawn.
    fn canvas(&self, size: (u32, u32)) -> Result<Canvas> {
        let Fixed {
            device,
            shade,
            textures,
            ..
        } = &self.fixed;
        let target = Target::new(device, shade, size)?;
        let of_relief = self.view.relief.as_ref();
        let of_relief = of_relief.map(|r| r.target(device, &target, textures, &self.view.lights));
        Ok(Canvas {
            relief: of_relief.transpose()?,
            target,
        })
    }

    /// A canvas for one sample of each pixel, and the tile that is the whole view.
    fn whole(&self) -> Result<(Canvas, Tile)> {
        let (width, height) = self.view.size;
        let tile = Tile {
            column: 0,
            row: 0,
            width,
            height,
        };
        Ok((self.canvas((width, height))?, tile))
    }

    /// `mark` replaces the meter's flag on plain triangles; `drawn` is recorded after all draws and
    /// before any copy.
    fn record(
        &self,
        cmd: &Commands,
        canvas: &Canvas,
        tile: Tile,
        samples: u32,
        mark: Option<f32>,
        drawn: impl FnOnce(),
    ) {
        let Fixed {
            scene, lighting, ..
        } = &self.fixed;
        let ViewParts {
            mesh,
            relief,
            lights,
            bound,
            projection,
            ..
        } = &self.view;
        let seen = SeenScene {
            scene,
            lighting,
            projection,
            samples,
            cuts: self.cuts,
        };
        let plain = mesh
            .draws(&seen, tile, bound, lights.counts)
            .filter(|_| lighting.show != Show::Overdraw)
            .map(|mut draw| {
                if !draw.adds {
                    draw.parameters.metered = mark.unwrap_or(draw.parameters.metered);
                }
                draw
            });
        let of_relief = relief.as_ref().zip(canvas.relief.as_ref());
        let over_depths =
            of_relief.is_some_and(|(relief, target)| relief.find(cmd, &seen, tile, target));
        self.fixed.shade.record(
            cmd,
            &canvas.target,
            &shade::Mesh {
                size: (tile.width * samples, tile.height * samples),
                vertices: &mesh.vertices,
                indices: &mesh.indices,
                background: match (self.fixed.sky(), mark) {
                    (Some(_), None) => BEHIND,
                    _ => 0.0,
                },
                over_depths,
                part_triangles: self.cuts.part_triangles,
            },
            |pass| {
                if let Some((relief, target)) = of_relief {
                    relief.record(cmd, pass, &seen, tile, target, lights);
                }
            },
            plain,
            drawn,
        );
    }
}
