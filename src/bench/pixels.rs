//! Charts as pixels: a backend of plotters that draws into a picture, with letters of 8 × 8 points,
//! so that no font has to be found.

use std::convert::Infallible;
use std::path::Path;

use font8x8::UnicodeFonts;
use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{
    BackendColor, BackendCoord, BackendTextStyle, DrawingBackend, DrawingErrorKind, FontTransform,
};

use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};

type Drawn<E = Infallible> = std::result::Result<(), DrawingErrorKind<E>>;

/// An RGB picture that charts are drawn into.
pub struct Pixels<'a>(pub &'a mut image::RgbImage);

/// A white picture of a width and a height.
pub fn blank((width, height): (u32, u32)) -> image::RgbImage {
    image::RgbImage::from_pixel(width, height, image::Rgb([255; 3]))
}

/// Writes a PNG.
///
/// # Errors
/// A file that cannot be written.
pub fn write_png(image: &image::RgbImage, path: &Path) -> Result<()> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, image::ImageFormat::Png)
        .map_err(|e| Error::file(path, e.to_string()))?;
    write_atomically(path, |out| out.write_all(bytes.get_ref()))
}

/// Pixels of a point of a letter: letters of 8 points stand for a font of about 10.
fn scale<S: BackendTextStyle>(style: &S) -> i32 {
    ((style.size() / 10.0).round() as i32).max(1)
}

impl DrawingBackend for Pixels<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        self.0.dimensions()
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, color: BackendColor) -> Drawn {
        let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else {
            return Ok(());
        };
        if let Some(pixel) = self.0.get_pixel_mut_checked(x, y) {
            let (r, g, b) = color.rgb;
            for (old, new) in pixel.0.iter_mut().zip([r, g, b]) {
                let mixed = f64::from(*old) * (1.0 - color.alpha) + f64::from(new) * color.alpha;
                *old = mixed.round() as u8;
            }
        }
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, at: BackendCoord) -> Drawn {
        let (scale, letters) = (scale(style), text.chars().count() as i32);
        let (width, height) = (8 * scale * letters, 8 * scale);
        let anchor = style.anchor();
        let left = match anchor.h_pos {
            HPos::Left => 0,
            HPos::Right => -width,
            HPos::Center => -width / 2,
        };
        let top = match anchor.v_pos {
            VPos::Top => 0,
            VPos::Center => -height / 2,
            VPos::Bottom => -height,
        };
        let turned = |x: i32, y: i32| match style.transform() {
            FontTransform::None => (x, y),
            FontTransform::Rotate90 => (-y, x),
            FontTransform::Rotate180 => (-x, -y),
            FontTransform::Rotate270 => (y, -x),
        };
        for (i, letter) in text.chars().enumerate() {
            let rows = font8x8::BASIC_FONTS
                .get(letter)
                .or_else(|| font8x8::LATIN_FONTS.get(letter))
                .unwrap_or([0x7e; 8]);
            for point in 0..64 * scale * scale {
                let (x, y) = (point % (8 * scale), point / (8 * scale));
                if rows[(y / scale) as usize] >> (x / scale) & 1 == 1 {
                    let (x, y) = turned(left + i as i32 * 8 * scale + x, top + y);
                    self.draw_pixel((at.0 + x, at.1 + y), style.color())?;
                }
            }
        }
        Ok(())
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        text: &str,
        style: &S,
    ) -> std::result::Result<(u32, u32), DrawingErrorKind<Infallible>> {
        let side = 8 * scale(style) as u32;
        Ok((side * text.chars().count() as u32, side))
    }
}
