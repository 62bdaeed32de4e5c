//! Small pictures over the view: light by direction, an item buffer, error bounds, marks of lights.

use egui::{Color32, ColorImage, Painter, Pos2, Sense, Shape, Stroke, Ui, pos2, vec2};
use glam::{DVec3, Vec3};

use crate::bake::solution::DirectionalLight;
use crate::math::directions::Directions;
use crate::math::hemicube::face_rectangle;
use crate::render::tone;
use crate::solver::ItemPicture;

/// Pixels a side of the picture of a hemisphere.
pub const SIDE: usize = 96;

/// Light that falls on one element by direction, seen from above: the disc's middle is the normal,
/// its rim the horizon, u goes right and v up. Each slot shows its mean radiance. None for an
/// element without relief.
pub fn hemisphere(light: &DirectionalLight, triangle: u32, exposure: f32) -> Option<ColorImage> {
    let m = light.elements.binary_search(&triangle).ok()?;
    let k = light.directions.len();
    let directions = Directions::new(k as u32).ok()?;
    let moments = light.incident_moment.get(m * k..(m + 1) * k)?;
    // |∫ L ω dω| over a slot is nearly its solid angle times L.
    let angle = 2.0 * std::f32::consts::PI / k as f32;
    let colours: Vec<Color32> = moments
        .iter()
        .map(|m| code(m.map(|c| c.length() / angle * exposure)))
        .collect();
    let pixels = (0..SIDE * SIDE).map(|i| {
        let at = |n: usize| 2.0 * (n as f64 + 0.5) / SIDE as f64 - 1.0;
        // Lambert's azimuthal map preserves areas, so that slots appear in proportion to their
        // solid angles.
        let (x, y) = (at(i % SIDE), -at(i / SIDE));
        let square = x * x + y * y;
        if square > 1.0 {
            return Color32::TRANSPARENT;
        }
        let scale = (2.0 - square).sqrt();
        let towards = DVec3::new(x * scale, y * scale, 1.0 - square);
        colours[directions.slot_of(towards)]
    });
    Some(ColorImage::new([SIDE, SIDE], pixels.collect()))
}

/// The sRGB code of exposed radiance.
pub fn code(linear: [f32; 3]) -> Color32 {
    // A place near the middle of the dither's matrix, which amounts to rounding.
    let [r, g, b] = tone::neutral(linear).map(|c| tone::code(c, 0, 4));
    Color32::from_rgb(r, g, b)
}

/// An item buffer unfolded: the top face in the middle of its four sides, each triangle in the
/// colour of its own light.
pub fn items(picture: &ItemPicture, irradiance: &[Vec3], exposure: f32) -> ColorImage {
    let n = picture.face;
    let (half, side) = (n / 2, 2 * n);
    let mut image = ColorImage::filled([side as usize; 2], Color32::TRANSPARENT);
    let colour = |item: u32| match irradiance.get(item as usize) {
        None => Color32::BLACK,
        Some(e) => {
            // Half its light and half a hue of its own, so that neighbours can be distinguished.
            let hue = egui::ecolor::Hsva::new((item as f32 * 0.618_034).fract(), 0.7, 0.8, 1.0);
            let [r, g, b] = hue.to_rgb();
            let lit = (e.to_array()).map(|c| c / std::f32::consts::PI * exposure);
            code([
                0.3 * r + 0.5 * lit[0],
                0.3 * g + 0.5 * lit[1],
                0.3 * b + 0.5 * lit[2],
            ])
        }
    };
    for face in 0..5 {
        let [x, y, width, height] = face_rectangle(face, n);
        for row in 0..height {
            for column in 0..width {
                let item = picture.items[((y + row) * n + x + column) as usize];
                let (across, down) = unfolded(face, (column, row), half);
                image.pixels[(down * side + across) as usize] = colour(item);
            }
        }
    }
    image
}

/// Position of a face's pixel in the unfolded cross, x of the source's frame to the right and y
/// down: sides adjoin the edges of the top face, with the horizon outermost. `half` is half a
/// face's side.
fn unfolded(face: u32, (column, row): (u32, u32), half: u32) -> (u32, u32) {
    // The first row of a side is at the horizon.
    let after = 3 * half + (half - 1 - row.min(half - 1));
    match face {
        0 => (half + column, half + row),
        1 => (after, half + column),
        2 => (row, half + column),
        3 => (half + column, after),
        _ => (half + column, row),
    }
}

/// Points across that the figures of a bound take.
const FIGURES: f32 = 54.0;

/// Error bounds over seconds: the bound on a logarithmic axis, the time from 0 on.
pub fn bounds(ui: &mut Ui, bounds: &[[f64; 2]]) {
    let size = vec2(ui.available_width(), 76.0);
    let (all, _) = ui.allocate_exact_size(size, Sense::hover());
    let painter = ui.painter();
    let (mut place, axis) = all.split_top_bottom_at_y(all.bottom() - 13.0);
    painter.rect_filled(place, 2.0, Color32::from_black_alpha(120));
    let logs = bounds.iter().filter(|[_, bound]| *bound > 0.0);
    let logs: Vec<[f64; 2]> = logs.map(|&[t, bound]| [t, bound.log10()]).collect();
    let Some([end, _]) = logs.last().copied() else {
        return;
    };
    let high = logs.iter().map(|l| l[1]).fold(f64::NEG_INFINITY, f64::max);
    let low = logs.iter().map(|l| l[1]).fold(f64::INFINITY, f64::min);
    let font = egui::FontId::proportional(10.0);
    let grey = Color32::from_gray(170);
    for (at, align, log) in [
        (place.left_top(), egui::Align2::LEFT_TOP, high),
        (place.left_bottom(), egui::Align2::LEFT_BOTTOM, low),
    ] {
        let text = format!("{:.3} %", 100.0 * 10_f64.powf(log));
        painter.text(at, align, text, font.clone(), grey);
    }
    for (at, align, seconds) in [
        (
            axis.left_top() + vec2(FIGURES, 0.0),
            egui::Align2::LEFT_TOP,
            0.0,
        ),
        (
            pos2((axis.left() + FIGURES + axis.right()) / 2.0, axis.top()),
            egui::Align2::CENTER_TOP,
            end / 2.0,
        ),
        (axis.right_top(), egui::Align2::RIGHT_TOP, end),
    ] {
        painter.text(at, align, format!("{seconds:.1} s"), font.clone(), grey);
    }
    // Beside the figures, not over them.
    place.min.x += FIGURES;
    let points = logs.iter().map(|[t, l]| {
        let x = (t / end.max(1e-9)) as f32;
        let y = ((high - l) / (high - low).max(1e-9)) as f32;
        place.min + vec2(x * place.width(), y * place.height())
    });
    let stroke = Stroke::new(1.5, Color32::LIGHT_GREEN);
    painter.add(Shape::line(points.collect(), stroke));
}

/// What the overlays that are shown mean, in the lower left corner of the view. Returns how far up
/// from the corner it reaches.
pub fn legend(painter: &Painter, corner: Pos2, lines: &[&str]) -> f32 {
    let font = egui::FontId::proportional(12.0);
    let mut at = corner;
    for line in lines.iter().rev() {
        let text = painter.layout_no_wrap((*line).to_owned(), font.clone(), Color32::WHITE);
        let size = text.size();
        at.y -= size.y + 6.0;
        let place = egui::Rect::from_min_size(at, size).expand2(vec2(6.0, 2.0));
        painter.rect_filled(place, 3.0, Color32::from_black_alpha(190));
        painter.galley(at, text, Color32::WHITE);
    }
    corner.y - at.y
}

/// A mark where a point light is, with its name where it is chosen.
pub fn lamp(painter: &Painter, at: (f64, f64), scale: f32, colour: [f32; 3], name: Option<&str>) {
    let at = pos2(at.0 as f32 / scale, at.1 as f32 / scale);
    let [r, g, b] = colour.map(|c| (255.0 * c.clamp(0.0, 1.0).sqrt()) as u8);
    painter.circle_filled(at, 5.0, Color32::from_rgb(r, g, b));
    let ring = if name.is_some() { 2.0 } else { 1.0 };
    painter.circle_stroke(at, 7.0, Stroke::new(ring, Color32::WHITE));
    if let Some(name) = name {
        let font = egui::FontId::proportional(12.0);
        let text = painter.layout_no_wrap(name.to_owned(), font, Color32::WHITE);
        let place = egui::Align2::LEFT_CENTER.anchor_size(at + vec2(12.0, 0.0), text.size());
        painter.rect_filled(place.expand(3.0), 3.0, Color32::from_black_alpha(150));
        painter.galley(place.min, text, Color32::WHITE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The five faces fill a cross without holes or overlaps.
    #[test]
    fn the_faces_do_not_overlap() {
        let n = 8;
        let mut seen = std::collections::HashSet::new();
        for face in 0..5 {
            let [_, _, width, height] = face_rectangle(face, n);
            for at in (0..height).flat_map(|row| (0..width).map(move |column| (column, row))) {
                let place = unfolded(face, at, n / 2);
                assert!(place.0 < 2 * n && place.1 < 2 * n, "{place:?}");
                assert!(seen.insert(place), "face {face}, {at:?}");
            }
        }
        assert_eq!(seen.len(), crate::math::hemicube::pixel_count(n));
        assert_eq!(
            unfolded(1, (0, n / 2 - 1), n / 2).0,
            n / 2 + n,
            "the highest row touches the top face"
        );
    }

    /// Light along the normal only lights the middle of the disc; the rim is dark, and outside it
    /// is transparent.
    #[test]
    fn the_middle_of_the_disc_is_the_normal() {
        let directions = Directions::new(64).expect("a number of the paper");
        let mut moments = vec![[Vec3::ZERO; 3]; 64];
        moments[directions.slot_of(DVec3::new(0.05, 0.05, 1.0).normalize())] = [Vec3::Z; 3];
        let light = DirectionalLight {
            elements: vec![7],
            directions: (0..64).map(|k| directions.centre(k)).collect(),
            frames: vec![[Vec3::X, Vec3::Y, Vec3::Z]],
            incident_moment: moments.clone(),
            incident_moment_direct: moments,
            exitant: vec![Vec3::ZERO; 64],
        };
        let image = hemisphere(&light, 7, 1.0).expect("an element with relief");
        let at = |x: usize, y: usize| image.pixels[y * SIDE + x];
        // Right of the middle and above it.
        assert!(at(SIDE / 2 + 2, SIDE / 2 - 3).r() > 200);
        assert_eq!(at(SIDE - 3, SIDE / 2).r(), 0);
        assert_eq!(at(0, 0), Color32::TRANSPARENT);
        assert!(hemisphere(&light, 8, 1.0).is_none());
    }
}
