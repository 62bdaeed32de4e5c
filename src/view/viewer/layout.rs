//! Overlays of the view: the panel, marks of lights, light by direction, an item buffer.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use egui::TextureHandle;

use super::Viewer;
use super::input::Input;
use crate::error::Result;
use crate::render::Show;
use crate::view::compare::Left;
use crate::view::listing;
use crate::view::overlay;
use crate::view::panel::{self, Asked, Changed, Status};
use crate::view::switches::Switches;

/// What a picture over the view shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Subject {
    /// The element or the source.
    index: u32,
    /// Number of the light, counted as [`Viewer::lights`].
    light: u64,
    /// Bits of the factor of exposure.
    exposure: u32,
}

/// A picture over the view; it is redrawn when its subject changes.
#[derive(Default)]
pub(super) struct KeptTexture {
    shows: Option<Subject>,
    /// None where there is nothing to show.
    texture: Option<TextureHandle>,
}

impl KeptTexture {
    fn of(
        &mut self,
        context: &egui::Context,
        name: &str,
        shows: Subject,
        draw: impl FnOnce() -> Option<egui::ColorImage>,
    ) -> Option<&TextureHandle> {
        if self.shows != Some(shows) {
            self.shows = Some(shows);
            let load = |image| context.load_texture(name, image, egui::TextureOptions::LINEAR);
            self.texture = draw().map(load);
        }
        self.texture.as_ref()
    }
}

fn lay(painter: &egui::Painter, texture: Option<&TextureHandle>, corner: egui::Pos2, side: f32) {
    if let Some(texture) = texture {
        let place = egui::Rect::from_min_size(corner, egui::Vec2::splat(side));
        let uv = egui::Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
        painter.image(texture.id(), place, uv, egui::Color32::WHITE);
    }
}

/// The element that was clicked, or the one under the cursor.
fn marked(input: &Input) -> Option<u32> {
    input.chosen.or(input.hovered)
}

impl Viewer {
    /// Lays out the panel and the overlays, and applies the changes made in the panel.
    pub(super) fn panel(
        &mut self,
        (width, height): (u32, u32),
    ) -> Result<Vec<egui::ClippedPrimitive>> {
        let points = egui::vec2(width as f32, height as f32) / self.scale;
        let mut raw = self.input.take_raw();
        raw.screen_rect = Some(egui::Rect::from_min_size(egui::Pos2::ZERO, points));
        raw.time = Some(self.start.elapsed().as_secs_f64());
        raw.viewports
            .entry(egui::ViewportId::ROOT)
            .or_default()
            .native_pixels_per_point = Some(self.scale);
        let context = self.egui.clone();
        let mut asked = Vec::new();
        let output = context.run(raw, |context| {
            let legend = self.marks(context, (width, height));
            if self.switches.panel {
                asked = self.controls(context);
            }
            panel::show_keys(context, &mut self.switches.keys);
            self.draw_dialog(context);
            if self.switches.notes {
                self.notes.show(context, legend);
            }
        });
        for asked in asked {
            match asked {
                Asked::Camera(i) => self.see_camera(i),
                Asked::SeeAll => self.eye.see_all(),
                Asked::Save => self.save(None),
                Asked::Bake => self.bake(),
                Asked::Relight => self.relight(),
                Asked::Open(i) => self.open(self.offered[i].clone()),
                Asked::Recent(i) => self.open(self.files.recent[i].clone()),
                Asked::Browse => self.browse(),
                Asked::SaveBake => self.ask_where_to_save(),
                Asked::Undo => self.undo(),
                Asked::Redo => self.redo(),
                Asked::Meter => self.meter(),
                Asked::Hold => self.hold(),
                Asked::Trace => self.trace(),
                Asked::Part => self.part(),
            }
        }
        if let Some(shown) = &output.platform_output.accesskit_update
            && let Some(path) = self.listing.take()
        {
            context.disable_accesskit();
            listing::write(&path, shown, &self.eye.camera, self.scale)?;
        }
        self.panel_pass.update(&output.textures_delta)?;
        let delay = output
            .viewport_output
            .get(&egui::ViewportId::ROOT)
            .map_or(Duration::MAX, |viewport| viewport.repaint_delay);
        // A delay above an hour means never.
        let soon = delay < Duration::from_secs(3600);
        self.repaint = soon.then(|| Instant::now() + delay);
        Ok(context.tessellate(output.shapes, output.pixels_per_point))
    }

    /// Writes what the next frame shows to a file.
    pub(in crate::view) fn list(&mut self, path: PathBuf) {
        self.egui.enable_accesskit();
        self.listing = Some(path);
        self.dirty = true;
    }

    fn controls(&mut self, context: &egui::Context) -> Vec<Asked> {
        let cameras: Vec<_> = self.scene.cameras.iter().map(|c| c.name.clone()).collect();
        let baking = self.is_baking();
        let marked = marked(&self.input);
        let device = self.screen.device().name().to_owned();
        let left = self.left.as_ref();
        let status = Status {
            scene: &self.name,
            triangles: self.scene.triangles.len(),
            device: &device,
            cameras: &cameras,
            progress: self.progress,
            stage: self.stage.filter(|_| baking),
            baking,
            frame: self.timing.last(baking),
            detail: self.shown_detail().map(|drawn| drawn.seconds),
            has_relief: self.base.materials.iter().any(|m| m.has_relief()),
            offered: &self.offered,
            opening: self.opening.as_deref(),
            bounds: &self.bounds,
            element: marked.map(|e| self.describe(e)),
            can_undo: self.history.can_undo(),
            can_redo: self.history.can_redo(),
            recent: &self.files.recent,
            can_save_bake: self.why_no_bake().is_none(),
            against: left.map(|left| (left.against(), left.name().to_owned())),
            apart: &self.apart,
            differences: match left {
                Some(Left::Traced(traced)) => &traced.differences,
                _ => &[],
            },
        };
        let mut changed = Changed {
            switches: &mut self.switches,
            lamps: &mut self.lamps,
            lamp: &mut self.lamp,
            directions: &mut self.directions,
            paper: &mut self.paper,
            relief_scale: &mut self.relief_scale,
        };
        panel::show(context, &status, &mut changed)
    }

    /// What is shown over the view means, or what is being done. Returns how high it is.
    fn draw_legend(&self, painter: &egui::Painter, (_, height): (u32, u32)) -> f32 {
        let Switches {
            elements,
            sources,
            slots,
            items,
            show,
            ..
        } = self.switches;
        let moving = self.moving_line();
        let lines = [
            moving.as_deref(),
            elements.then_some("lines: elements, each of one light between its corners"),
            sources.then_some("colours: sources, groups of elements that shoot as one"),
            slots.then_some(
                "disc: light on the relief under the cursor; middle, its normal; rim, the horizon; \
                 right, u; up, v",
            ),
            items.then_some(match self.input.chosen {
                None => "item buffer: click on a surface",
                Some(_) => {
                    "cross: what the source sees; middle, along its normal; rim, the horizon"
                }
            }),
            (show == Show::Slots).then_some(
                "relief: hue, the direction of most light; bright, near the normal; grey, from \
                 everywhere",
            ),
        ];
        let lines: Vec<&str> = lines.into_iter().flatten().collect();
        let left = match self.switches.panel {
            true => panel::WIDTH + 14.0,
            false => 14.0,
        };
        let corner = egui::pos2(left, height as f32 / self.scale - 10.0);
        overlay::legend(painter, corner, &lines)
    }

    /// One line about an element.
    fn describe(&self, element: u32) -> String {
        let e = element as usize;
        let material = self.scene.triangles[e].material as usize;
        let name = &self.scene.materials[material].name;
        let light = self.snapshot.irradiance[e];
        format!(
            "element {element}, {name}: E = {:.3}, {:.3}, {:.3} W/m²",
            light.x, light.y, light.z
        )
    }

    /// Draws marks of lights, light by direction, an item buffer and a legend over the view; how
    /// high the legend is.
    fn marks(&mut self, context: &egui::Context, size: (u32, u32)) -> f32 {
        let layer = egui::LayerId::new(egui::Order::Background, egui::Id::new("marks"));
        let mut beside = context.content_rect();
        if self.switches.panel {
            beside.min.x += panel::WIDTH;
        }
        let painter = context.layer_painter(layer).with_clip_rect(beside);
        let marked_lamps = self.lamps.iter().enumerate();
        for (i, lamp) in marked_lamps.filter(|_| self.switches.panel) {
            if let Some(at) = lamp.position.and_then(|p| self.eye.pixel(p, size)) {
                let name = (i == self.lamp).then_some(lamp.name.as_str());
                overlay::lamp(&painter, at, self.scale, lamp.colour, name);
            }
        }
        self.draw_line(&painter, size);
        let legend = match self.switches.notes {
            true => self.draw_legend(&painter, size),
            false => 0.0,
        };
        let exposure = self.exposure().exp2();
        let screen = context.content_rect();
        let light = self.lights;
        let subject = |index| Subject {
            index,
            light,
            exposure: exposure.to_bits(),
        };
        let slots = marked(&self.input).filter(|_| self.switches.slots);
        match (slots, &self.snapshot.relief) {
            (Some(e), Some(relief)) => {
                let draw = || overlay::hemisphere(relief, e, exposure);
                let texture =
                    self.overlays
                        .slots_picture
                        .of(context, "hemisphere", subject(e), draw);
                let at = self.input.pointer.unwrap_or_default();
                let corner = egui::pos2(at.0 / self.scale + 16.0, at.1 / self.scale + 16.0);
                lay(&painter, texture, corner, overlay::SIDE as f32);
            }
            _ => self.overlays.slots_picture = KeptTexture::default(),
        }
        let wanted = self.switches.items && self.input.chosen.is_some();
        match self.overlays.items.as_ref().filter(|_| wanted) {
            Some(items) => {
                let draw = || Some(overlay::items(items, &self.snapshot.irradiance, exposure));
                let key = subject(items.source);
                let texture = self.overlays.items_picture.of(context, "items", key, draw);
                let side = 0.35 * screen.width().min(screen.height());
                let corner = screen.right_bottom() - egui::vec2(side + 8.0, side + 8.0);
                lay(&painter, texture, corner, side);
            }
            None => self.overlays.items_picture = KeptTexture::default(),
        }
        legend
    }
}
