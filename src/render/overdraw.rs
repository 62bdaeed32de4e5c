//! Overdraw, as numbers and as a picture.

use font8x8::{BASIC_FONTS, UnicodeFonts};

use crate::picture::Picture;

/// Fragments of prisms whose rays are followed and steps of their marches, `[row][column]`, means
/// over a pixel's samples. Hidden ones count: each fragment computes its own depth, so that none is
/// culled early.
#[derive(Debug, Clone)]
pub struct Overdraw {
    pub width: u32,
    pub height: u32,
    pub fragments: Vec<f32>,
    pub steps: Vec<f32>,
}

/// The bar's share of the picture's height.
const BAR: u32 = 24;

impl Overdraw {
    /// From a picture whose red counts fragments and whose green counts steps.
    pub(super) fn new(counts: &Picture) -> Self {
        let channel = |c: usize| counts.radiance.iter().map(|p| p[c]).collect();
        Self {
            width: counts.width,
            height: counts.height,
            fragments: channel(0),
            steps: channel(1),
        }
    }

    /// Number of fragments shown in the brightest colour: the greatest number, rounded up to a
    /// power of two.
    pub fn top(&self) -> f32 {
        let most = self.fragments.iter().copied().fold(1.0, f32::max);
        most.log2().ceil().exp2()
    }

    /// The fragments in the colours of viridis, from 0, dark, to [`Self::top`], bright, with a bar
    /// of the same range at the bottom, marked at each quarter, with its number where the bar is high
    /// enough. The range and the steps are logged.
    pub fn picture(&self) -> Picture {
        let top = self.top();
        let statistics = |values: &[f32]| {
            let most = values.iter().copied().fold(0.0, f32::max);
            let sum: f64 = values.iter().map(|&v| f64::from(v)).sum();
            (sum / values.len() as f64, most)
        };
        let ((mean, most), (mean_steps, most_steps)) =
            (statistics(&self.fragments), statistics(&self.steps));
        tracing::info!(
            "overdraw: {mean:.2} fragments a sample, at most {most:.2}; {mean_steps:.0} steps of marches, at most {most_steps:.0}; the bar runs from 0 to {top}"
        );
        let first = self.height - (self.height / BAR).max(1);
        let colour = |(place, &fragments): (usize, &f32)| {
            let (column, row) = (place as u32 % self.width, place as u32 / self.width);
            if row < first {
                return viridis(fragments / top);
            }
            let quarter = |column: u32| 4 * column / self.width;
            if row == first || (column > 0 && quarter(column) != quarter(column - 1)) {
                return [1.0; 3];
            }
            viridis((column as f32 + 0.5) / self.width as f32)
        };
        let mut colours: Vec<_> = self.fragments.iter().enumerate().map(colour).collect();
        self.number(&mut colours, first + 1, top);
        // Nothing is metered, so that the map's colours are not exposed.
        let metered = vec![false; self.fragments.len()];
        Picture::new((self.width, self.height), colours, &metered)
    }

    /// Writes numbers from 0 to `most` at the marks of a bar that begins at that row.
    fn number(&self, colours: &mut [[f32; 3]], row: u32, most: f32) {
        let height = self.height.saturating_sub(row);
        let scale = height.saturating_sub(2) / LETTER;
        if scale == 0 {
            return;
        }
        let top = row + (height - LETTER * scale).div_ceil(2);
        for quarter in 0..=4 {
            let share = quarter as f32 / 4.0;
            let text = (share * most).to_string();
            let mark = (quarter * self.width).div_ceil(4);
            let length = text.len() as u32 * LETTER * scale;
            let left = match quarter {
                4 => self.width.saturating_sub(length + scale),
                _ => mark + 2 * scale,
            };
            // Dark on what is bright.
            let colour = if share < 0.6 { [1.0; 3] } else { [0.0; 3] };
            let letters = text.chars().filter_map(|letter| BASIC_FONTS.get(letter));
            let side = LETTER * scale;
            for (i, rows) in (0..).zip(letters) {
                for (x, y) in (0..side * side).map(|place| (place % side, place / side)) {
                    let column = left + i * side + x;
                    let is_set = rows[(y / scale) as usize] >> (x / scale) & 1 == 1;
                    if is_set && column < self.width {
                        colours[((top + y) * self.width + column) as usize] = colour;
                    }
                }
            }
        }
    }
}

/// Pixels of a letter's side.
const LETTER: u32 = 8;

/// Linear RGB of a value in 0..=1.
fn viridis(share: f32) -> [f32; 3] {
    let colour = colorous::VIRIDIS.eval_continuous(f64::from(share.clamp(0.0, 1.0)));
    colour.as_array().map(|code| {
        let coded = f32::from(code) / 255.0;
        if coded <= 0.040_45 {
            coded / 12.92
        } else {
            ((coded + 0.055) / 1.055).powf(2.4)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_become_colours_over_a_bar() {
        let fragments: Vec<f32> = (0..24 * 24).map(|i| (i % 24) as f32 / 4.0).collect();
        let counts = Overdraw {
            width: 24,
            height: 24,
            steps: fragments.clone(),
            fragments,
        };
        assert_eq!(counts.top(), 8.0);
        let picture = counts.picture();
        assert_eq!(picture.automatic_exposure, 0.0);
        assert_eq!(picture.radiance[0], viridis(0.0));
        assert_eq!(picture.radiance[16], viridis(0.5));
        assert_eq!(picture.radiance[23 * 24], [1.0; 3]);
        let luminance = |p: [f32; 3]| p[0] + p[1] + p[2];
        let row = &picture.radiance[..24];
        assert!(row.is_sorted_by(|a, b| luminance(*a) < luminance(*b)));
    }
}
