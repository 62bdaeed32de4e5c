//! Detailed pictures on the device, and the views that they are of.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use egui::Color32;
use glam::{Vec2, Vec3};

use super::camera::Rows;
use super::detailer::Drawn;
use super::panel_pass;
use crate::error::Result;
use crate::vk::{Buffer, BufferUse, Commands, Device, Format, Image, ImageUse};

/// The view of a picture, as the shader reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct PictureView {
    x: [f32; 4],
    y: [f32; 4],
    w: [f32; 4],
    eye: Vec3,
    /// Tangent of half a pixel's angle; 0 for a picture that is not shown.
    pixel: f32,
    /// Share of the image that is the picture.
    share: Vec2,
}

/// A detailed picture on the device.
pub struct Kept {
    pub image: Image,
    pub distances: Image,
    view: PictureView,
}

/// The last whole picture, and a later coarse one.
pub struct LaidPictures {
    /// The whole one, the coarse one.
    pub kept: [Kept; 2],
    /// Index of the one that came last.
    pub last: usize,
    /// Their views.
    pub views: Buffer,
}

impl LaidPictures {
    /// No pictures yet.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let bytes = size_of::<[PictureView; 2]>() as u64;
        let mut views = Buffer::new(device, "pictures' views", bytes, BufferUse::Stream)?;
        views.write(0, &[PictureView::zeroed(); 2]);
        let none = || -> Result<Kept> {
            let size = padded_size((1, 1));
            let count = (size.0 * size.1) as usize;
            let black = vec![Color32::BLACK; count];
            Ok(Kept {
                image: panel_pass::upload(device, "no picture", size, &black)?,
                distances: upload_distances(device, size, &vec![0.0; count])?,
                view: PictureView::zeroed(),
            })
        };
        Ok(Self {
            kept: [none()?, none()?],
            last: 0,
            views,
        })
    }

    /// Replaces the whole picture or the coarse one. Returns the share of the image that is the
    /// picture.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn set(&mut self, device: &Arc<Device>, drawn: &Drawn, rows: &Rows) -> Result<Vec2> {
        let size = drawn.size;
        let half = (drawn.of.camera.fov_y / 2.0).to_radians().tan();
        let place = usize::from(!drawn.is_whole());
        if drawn.is_whole() {
            // The coarse picture is of an older view.
            self.kept[1].view.pixel = 0.0;
        }
        let padded = padded_size(size);
        let share =
            Vec2::new(size.0 as f32, size.1 as f32) / Vec2::new(padded.0 as f32, padded.1 as f32);
        let codes = fill(size, &drawn.codes);
        self.kept[place] = Kept {
            image: panel_pass::upload(device, "detailed picture", padded, &codes)?,
            distances: upload_distances(device, padded, &fill(size, &drawn.distances))?,
            view: PictureView {
                x: rows.x.to_array(),
                y: rows.y.to_array(),
                w: rows.w.to_array(),
                eye: rows.eye,
                pixel: (half / f64::from(size.1)) as f32,
                share,
            },
        };
        self.last = place;
        Ok(share)
    }

    /// Sets which pictures may be laid over the surfaces: the whole one, the coarse one.
    pub fn lay(&mut self, shown: [bool; 2]) {
        let mut views = [self.kept[0].view, self.kept[1].view];
        for (view, shown) in views.iter_mut().zip(shown) {
            view.pixel *= f32::from(u8::from(shown));
        }
        self.views.write(0, &views);
    }
}

/// Sides of the image of a picture. A software driver recompiles a shader when the sides of an
/// image become powers of two or cease to be; odd numbers from 3 on never are.
fn padded_size((width, height): (u32, u32)) -> (u32, u32) {
    ((width | 1).max(3), (height | 1).max(3))
}

/// A picture padded to such an image by repeating its edges.
fn fill<T: Copy>((width, height): (u32, u32), picture: &[T]) -> Vec<T> {
    let (wide, high) = padded_size((width, height));
    let row = |y: u32| (y.min(height - 1) * width) as usize;
    let rows =
        (0..high).flat_map(|y| (0..wide).map(move |x| picture[row(y) + x.min(width - 1) as usize]));
    rows.collect()
}

/// An image of distances that shaders read texel by texel.
fn upload_distances(device: &Arc<Device>, size: (u32, u32), distances: &[f32]) -> Result<Image> {
    let name = "detailed picture's distances";
    let image = Image::new(device, name, size, Format::R32_SFLOAT, ImageUse::Texture)?;
    let bytes = size_of_val(distances) as u64;
    let mut staging = Buffer::new(device, "distances staging", bytes, BufferUse::Upload)?;
    staging.write(0, distances);
    Commands::run(device, name, |cmd| {
        cmd.upload_texture(&staging, &image, 4);
        Ok(())
    })?;
    Ok(image)
}
