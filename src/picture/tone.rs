//! From radiance to the codes of a picture: tone curve, sRGB, dither.

/// Khronos PBR Neutral (Khronos Group 2024): keeps values below 0.76 except for a Fresnel offset,
/// and compresses values above to 1 without a change of hue. Exposed linear RGB in, linear RGB in
/// 0..=1 out.
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

/// 8-bit sRGB codes of the colour map magma (Smith and van der Walt 2015) at 0..=1, from black over
/// purple to pale yellow, by Zucker's polynomial of 2019, which is within five codes of it.
pub fn magma(value: f32) -> [u8; 3] {
    const TERMS: [[f32; 3]; 7] = [
        [-0.002_136_485, -0.000_749_655, -0.005_386_128],
        [0.251_660_54, 0.677_523_2, 2.494_026_6],
        [8.353_717, -3.577_719_5, 0.314_467_9],
        [-27.668_734, 14.264_731, -13.649_213],
        [52.176_14, -27.943_606, 12.944_17],
        [-50.768_525, 29.046_583, 4.234_153],
        [18.655_706, -11.489_773, -5.601_961_5],
    ];
    let t = value.clamp(0.0, 1.0);
    std::array::from_fn(|c| {
        let shown = TERMS.iter().rev().fold(0.0, |sum, term| sum * t + term[c]);
        (255.0 * shown + 0.5) as u8
    })
}

/// Relative luminance of linear RGB, ITU-R BT.709.
pub fn luminance([r, g, b]: [f32; 3]) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// The 8-bit sRGB code (IEC 61966-2-1) of linear light in 0..=1 at a pixel: with an ordered dither
/// of half a code about the exact value, which prevents banding and keeps exact codes, such as
/// black and white, unchanged.
pub fn code(linear: f32, column: u32, row: u32) -> u8 {
    // The cast saturates.
    (255.0 * coded(linear) + threshold(column, row)) as u8
}

/// The sRGB value (IEC 61966-2-1) of linear light, both in 0..=1; what is outside is cut off.
pub fn coded(linear: f32) -> f32 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
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
