//! From radiance to the codes of a picture: tone curve, sRGB, dither.

/// Khronos PBR Neutral (Khronos Group 2024): leaves what is below 0.76 alone but for a Fresnel offset, and brings what is
/// above to 1 without a change of hue. Exposed linear RGB in, linear RGB in 0..=1 out.
pub fn neutral(colour: [f32; 3]) -> [f32; 3] {
    const START: f32 = 0.8 - 0.04;
    const DESATURATION: f32 = 0.15;

    let least = colour.into_iter().fold(f32::INFINITY, f32::min);
    let offset = if least < 0.08 {
        least - 6.25 * least * least
    } else {
        0.04
    };
    let colour = colour.map(|c| c - offset);
    let peak = colour.into_iter().fold(0.0, f32::max);
    if peak < START {
        return colour;
    }
    let rest = 1.0 - START;
    let new_peak = 1.0 - rest * rest / (peak + rest - START);
    let grey = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    colour.map(|c| {
        let scaled = c * new_peak / peak;
        scaled + (new_peak - scaled) * grey
    })
}

/// Relative luminance of linear RGB, ITU-R BT.709.
pub fn luminance([r, g, b]: [f32; 3]) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// The 8-bit sRGB code (IEC 61966-2-1) of linear light in 0..=1 at a pixel: an ordered dither of half a code about
/// the exact value, which keeps a smooth wall from banding and leaves whole codes, black and white among them, as they are.
pub fn code(linear: f32, column: u32, row: u32) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let coded = if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    };
    // The cast saturates.
    (255.0 * coded + threshold(column, row)) as u8
}

/// Bayer's 8 × 8 matrix, thresholds strictly between 0 and 1.
fn threshold(column: u32, row: u32) -> f32 {
    let mixed = column ^ row;
    let rank = (0..3).fold(0, |rank, bit| {
        let pair = ((mixed >> bit) & 1) << 1 | ((row >> bit) & 1);
        rank << 2 | pair
    });
    (rank as f32 + 0.5) / 64.0
}
