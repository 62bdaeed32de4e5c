//! Draws the triangles of egui's panel. Shaders: `panel.vert`, `panel.frag`.

use std::collections::HashMap;
use std::sync::Arc;

use egui::epaint::{ImageData, ImageDelta, Primitive, Vertex};
use egui::{ClippedPrimitive, Color32, ColorImage, TextureId, TexturesDelta};
use glam::Vec2;

use crate::error::Result;
use crate::passes::shaders::panel::{Bindings, Parameters, SHADER};
use crate::vk::{
    Blending, Buffer, BufferUse, Commands, DescriptorSet, Device, Format, GraphicsPipeline,
    GraphicsState, Image, ImageUse, RenderPass, Sampled, Sampler, Sides, VertexAttribute,
};

/// Draws panels, one frame at a time.
pub struct PanelPass {
    pipeline: GraphicsPipeline,
    sampler: Sampler,
    textures: HashMap<TextureId, Texture>,
    /// Shares of the images that are the pictures, `[Layer]`.
    shares: [Vec2; LAYERS.len()],
    vertices: Buffer,
    indices: Buffer,
    device: Arc<Device>,
}

struct Texture {
    set: DescriptorSet,
    /// Content of the image, of which egui updates parts.
    pixels: ColorImage,
}

/// Pictures as large as the window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layer {
    /// Behind the surfaces.
    Backdrop,
    /// Over them.
    Picture,
    /// Over them on the left side of a comparison.
    Left,
}

const LAYERS: [Layer; 3] = [Layer::Backdrop, Layer::Picture, Layer::Left];

impl Layer {
    fn texture(self) -> TextureId {
        TextureId::User(self as u64)
    }
}

/// Triangles of one texture within one rectangle.
struct Draw {
    first_index: u32,
    index_count: u32,
    texture: TextureId,
    /// Left, top, width, height in pixels.
    clip: [u32; 4],
}

/// Draws of one frame, uploaded by [`PanelPass::prepare`].
pub struct Prepared {
    /// Those of the layers first.
    draws: Vec<Draw>,
    /// Size of the window in points.
    size: Vec2,
}

/// Bytes of a new buffer for `bytes`: with a reserve, so that a growing panel does not need a new
/// one each frame.
fn roomy(bytes: u64) -> u64 {
    (bytes * 3 / 2).max(1 << 16)
}

impl PanelPass {
    pub fn new(device: &Arc<Device>, pass: &RenderPass) -> Result<Self> {
        let attribute = |format, offset: usize| VertexAttribute {
            format,
            offset: offset as u32,
        };
        let pipeline = GraphicsPipeline::new(
            device,
            pass,
            &GraphicsState {
                name: "panel",
                shaders: &SHADER,
                constants: &[],
                vertex_stride: size_of::<Vertex>() as u32,
                attributes: &[
                    attribute(Format::R32G32_SFLOAT, std::mem::offset_of!(Vertex, pos)),
                    attribute(Format::R32G32_SFLOAT, std::mem::offset_of!(Vertex, uv)),
                    attribute(Format::R8G8B8A8_UNORM, std::mem::offset_of!(Vertex, color)),
                ],
                blending: Blending::Over,
                sides: Sides::Both,
            },
        )?;
        let stream = |name| Buffer::new(device, name, roomy(0), BufferUse::Stream);
        Ok(Self {
            pipeline,
            sampler: Sampler::held(device, "panel")?,
            textures: HashMap::new(),
            shares: [Vec2::ONE; LAYERS.len()],
            vertices: stream("panel vertices")?,
            indices: stream("panel indices")?,
            device: Arc::clone(device),
        })
    }

    /// Adds new textures and frees old ones.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn update(&mut self, delta: &TexturesDelta) -> Result<()> {
        for (id, change) in &delta.set {
            self.set(*id, change)?;
        }
        for id in &delta.free {
            self.textures.remove(id);
        }
        Ok(())
    }

    fn set(&mut self, id: TextureId, change: &ImageDelta) -> Result<()> {
        let ImageData::Color(new) = &change.image;
        let pixels = match (change.pos, self.textures.remove(&id)) {
            (Some(at), Some(texture)) => patched(texture.pixels, new, at),
            _ => new.as_ref().clone(),
        };
        let size = (pixels.size[0] as u32, pixels.size[1] as u32);
        let image = upload(&self.device, "panel texture", size, &pixels.pixels)?;
        let set = self.bind("panel texture", &image)?;
        self.textures.insert(id, Texture { set, pixels });
        Ok(())
    }

    /// Takes a picture for [`Self::record_layer`], of any size, sRGB `[row][column]`.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn set_layer(&mut self, layer: Layer, size: (u32, u32), codes: &[Color32]) -> Result<()> {
        let name = "picture";
        let padded = padded_size(size);
        let image = upload(&self.device, name, padded, &fill(size, codes))?;
        let vector = |(width, height): (u32, u32)| Vec2::new(width as f32, height as f32);
        self.shares[layer as usize] = vector(size) / vector(padded);
        let texture = Texture {
            set: self.bind(name, &image)?,
            pixels: ColorImage::default(),
        };
        self.textures.insert(layer.texture(), texture);
        Ok(())
    }

    /// Uploads the triangles of a frame of this size in pixels, with `scale` pixels per point.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn prepare(
        &mut self,
        primitives: &[ClippedPrimitive],
        (width, height): (u32, u32),
        scale: f32,
    ) -> Result<Prepared> {
        let size = Vec2::new(width as f32, height as f32) / scale;
        let (mut vertices, mut indices, mut draws) = (Vec::new(), Vec::new(), Vec::new());
        for (layer, share) in LAYERS.into_iter().zip(self.shares) {
            let corner = |x: f32, y: f32| Vertex {
                pos: egui::pos2(x * size.x, y * size.y),
                uv: egui::pos2(x * share.x, y * share.y),
                color: Color32::WHITE,
            };
            let first = vertices.len() as u32;
            draws.push(Draw {
                first_index: indices.len() as u32,
                index_count: 6,
                texture: layer.texture(),
                clip: [0, 0, width, height],
            });
            indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
            vertices.extend(
                [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| corner(x, y)),
            );
        }
        for ClippedPrimitive {
            clip_rect,
            primitive,
        } in primitives
        {
            let Primitive::Mesh(mesh) = primitive else {
                continue;
            };
            let pixel = |points: f32, most: u32| ((points * scale).round() as u32).min(most);
            let (left, top) = (
                pixel(clip_rect.min.x, width),
                pixel(clip_rect.min.y, height),
            );
            let (right, bottom) = (
                pixel(clip_rect.max.x, width),
                pixel(clip_rect.max.y, height),
            );
            if left >= right || top >= bottom || !self.textures.contains_key(&mesh.texture_id) {
                continue;
            }
            draws.push(Draw {
                first_index: indices.len() as u32,
                index_count: mesh.indices.len() as u32,
                texture: mesh.texture_id,
                clip: [left, top, right - left, bottom - top],
            });
            let before = vertices.len() as u32;
            indices.extend(mesh.indices.iter().map(|i| before + i));
            vertices.extend_from_slice(&mesh.vertices);
        }
        for (name, buffer, bytes) in [
            (
                "panel vertices",
                &mut self.vertices,
                size_of_val(&vertices[..]),
            ),
            (
                "panel indices",
                &mut self.indices,
                size_of_val(&indices[..]),
            ),
        ] {
            if bytes as u64 > buffer.bytes() {
                *buffer = Buffer::new(&self.device, name, roomy(bytes as u64), BufferUse::Stream)?;
            }
        }
        self.vertices.write(0, &vertices);
        self.indices.write(0, &indices);
        Ok(Prepared { draws, size })
    }

    fn bind(&self, name: &str, image: &Image) -> Result<DescriptorSet> {
        let image = Sampled {
            image,
            sampler: &self.sampler,
        };
        self.pipeline.bind(name, &Bindings { image })
    }

    /// Draws a picture over everything drawn so far, within a render pass that has begun and within
    /// `clip`: left, top, width, height in pixels.
    pub fn record_layer(&self, cmd: &Commands, prepared: &Prepared, layer: Layer, clip: [u32; 4]) {
        let of_layer = &prepared.draws[layer as usize];
        self.draw(cmd, prepared, &[Draw { clip, ..*of_layer }]);
    }

    /// Draws the panel within a render pass that has begun.
    pub fn record(&self, cmd: &Commands, prepared: &Prepared) {
        self.draw(cmd, prepared, &prepared.draws[LAYERS.len()..]);
    }

    fn draw(&self, cmd: &Commands, prepared: &Prepared, draws: &[Draw]) {
        cmd.bind_indices(&self.indices);
        for draw in draws {
            let Some(texture) = self.textures.get(&draw.texture) else {
                continue;
            };
            let [left, top, width, height] = draw.clip;
            cmd.bind_graphics(&self.pipeline, &texture.set, Some(&self.vertices));
            let size = prepared.size;
            cmd.push_graphics(&self.pipeline, &Parameters { size });
            cmd.scissor(left, top, width, height);
            cmd.draw_indexed(draw.first_index, draw.index_count);
        }
    }
}

/// `whole` with `part` at column and row `at`.
fn patched(mut whole: ColorImage, part: &ColorImage, [left, top]: [usize; 2]) -> ColorImage {
    let (width, part_width) = (whole.size[0], part.size[0]);
    for (row, pixels) in part.pixels.chunks_exact(part_width).enumerate() {
        let start = (top + row) * width + left;
        whole.pixels[start..start + part_width].copy_from_slice(pixels);
    }
    whole
}

/// Sides of the image of a picture. A software driver recompiles a shader when the sides of an
/// image become powers of two or cease to be; odd numbers from 3 on never are.
fn padded_size((width, height): (u32, u32)) -> (u32, u32) {
    ((width | 1).max(3), (height | 1).max(3))
}

/// A picture padded to such an image by repeating its edges.
fn fill((width, height): (u32, u32), picture: &[Color32]) -> Vec<Color32> {
    let (wide, high) = padded_size((width, height));
    let row = |y: u32| (y.min(height - 1) * width) as usize;
    let rows =
        (0..high).flat_map(|y| (0..wide).map(move |x| picture[row(y) + x.min(width - 1) as usize]));
    rows.collect()
}

/// An image of 8-bit codes that shaders read without conversion.
fn upload(device: &Arc<Device>, name: &str, size: (u32, u32), pixels: &[Color32]) -> Result<Image> {
    let image = Image::new(
        device,
        name,
        size,
        Format::R8G8B8A8_UNORM,
        ImageUse::Texture,
    )?;
    let bytes = size_of_val(pixels) as u64;
    let mut staging = Buffer::new(device, "texture staging", bytes, BufferUse::Upload)?;
    staging.write(0, pixels);
    Commands::run(device, name, |cmd| {
        cmd.upload_texture(&staging, &image, 4);
        Ok(())
    })?;
    Ok(image)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_patch_changes_its_rectangle_alone() {
        let whole = ColorImage::filled([3, 3], Color32::BLACK);
        let part = ColorImage::filled([2, 1], Color32::WHITE);
        let found = patched(whole, &part, [1, 2]);
        let white = |p: &Color32| *p == Color32::WHITE;
        let places: Vec<_> = (0..9).filter(|&i| white(&found.pixels[i])).collect();
        assert_eq!(places, [7, 8]);
    }
}
