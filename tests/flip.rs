//! ꟻLIP against closed forms and against the numbers of its authors' own program.

use mesolux::render::{Flip, Picture, ldr};

const WIDTH: u32 = 48;
const HEIGHT: u32 = 40;
/// Sums of some hundred f32 products of values about 1, each rounded to 2⁻²⁴, raised to powers of
/// 0.5 and 0.7, which enlarge what is near 0; the authors' program rounds likewise.
const ROUNDING: f32 = 2e-5;

/// Exposures of scaled pictures differ by 2⁻²¹, and with them their colours; the root enlarges that
/// of features to 7e-4.
const SCALED: f32 = 1e-3;

fn alike(value: [f32; 3]) -> Vec<[f32; 3]> {
    vec![value; (WIDTH * HEIGHT) as usize]
}

/// Linear light of 8-bit sRGB codes.
fn linear(code: u32) -> f32 {
    let v = f64::from(code) / 255.0;
    let l = if v <= 0.04045 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    };
    l as f32
}

/// A picture of stripes and curves, or a changed one: paler red, a bar and a line.
fn pattern(changed: bool) -> Vec<[f32; 3]> {
    let mut pixels = Vec::new();
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let mut p = [
                (x * 7 + y * 3) % 256,
                (x * x + 11 * y) % 200,
                (5 * y + 60 + x) % 256,
            ];
            if changed {
                p[0] = p[0] * 9 / 10;
                if (21..24).contains(&x) {
                    p = [220, 40, 90];
                }
                if y == 30 {
                    p[2] = 255 - p[2];
                }
            }
            pixels.push(p.map(linear));
        }
    }
    pixels
}

fn picture(radiance: Vec<[f32; 3]>) -> Picture {
    let metered = vec![true; radiance.len()];
    Picture::new((WIDTH, HEIGHT), radiance, &metered)
}

fn mean(error: &[f32]) -> f32 {
    (error.iter().map(|&e| f64::from(e)).sum::<f64>() / error.len() as f64) as f32
}

/// The mean and pixels that the C++ of the authors gives for the same codes (the crate nv-flip
/// 0.1.2, at 67.020645 pixels to a degree).
const MEAN: f32 = 0.211_709_42;

#[test]
fn agrees_with_the_authors_program() {
    let found = ldr(&pattern(true), &pattern(false), WIDTH);
    let known = [
        (0, 0, 0.008_122_198),
        (22, 12, 0.485_655_4),
        (25, 12, 0.278_936_42),
        (10, 30, 0.395_880_67),
        (40, 20, 0.086_330_36),
        (47, 39, 0.275_082_05),
    ];
    println!("mean {} for {MEAN}", mean(&found));
    assert!((mean(&found) - MEAN).abs() < ROUNDING);
    for (x, y, value) in known {
        let e = found[(y * WIDTH + x) as usize];
        println!("({x}, {y}): {e} for {value}");
        assert!((e - value).abs() < ROUNDING);
    }
}

/// Black and white have the HyAB distance 100, d = 100^0.7 = 25.119; the largest, green and blue,
/// is 203.30^0.7 = 41.27 by their L*a*b* (87.73, −86.18, 83.18) and (32.30, 79.19, −107.86) after
/// Hunt. The knee is at 0.4 · 41.27 = 16.51, and 0.95 + 0.05 (25.119 − 16.51) / (41.27 − 16.51) =
/// 0.96739. Pictures without edges differ by their colours alone.
#[test]
fn even_pictures_have_closed_forms() {
    let found = ldr(&alike([1.0; 3]), &alike([0.0; 3]), WIDTH);
    assert!(found.iter().all(|e| (e - 0.967_39).abs() < ROUNDING));
    let found = ldr(&alike([0.0, 1.0, 0.0]), &alike([0.0, 0.0, 1.0]), WIDTH);
    assert!(found.iter().all(|e| (e - 1.0).abs() < ROUNDING));
    // L* of a grey of 18.4187 % is 50, of which 100 is the double: below the knee 0.95 (50^0.7) /
    // 16.51.
    let grey = [0.184_186_52; 3];
    let found = ldr(&alike(grey), &alike([0.0; 3]), WIDTH);
    let expected = 0.95 * 50_f32.powf(0.7) / (0.4 * 203.30_f32.powf(0.7));
    println!("{} for {expected}", found[0]);
    assert!(found.iter().all(|e| (e - expected).abs() < ROUNDING));
}

#[test]
fn equal_pictures_do_not_differ_and_order_does_not_count() {
    let (a, b) = (pattern(true), pattern(false));
    assert!(ldr(&a, &a, WIDTH).iter().all(|&e| e == 0.0));
    let (there, back) = (ldr(&a, &b, WIDTH), ldr(&b, &a, WIDTH));
    assert_eq!(there, back);
    assert!(there.iter().all(|e| (0.0..=1.0).contains(e)));
    let same = Flip::new(&picture(a.clone()), &picture(a)).expect("alike in size");
    assert_eq!(same.mean(), 0.0);
}

/// The tone curve x (0.9036 x + 0.018) / (x (0.8748 x + 0.354) + 0.14), which is shown as 0.85 at
/// this x.
const BRIGHT: f64 = 2.118_872_3;

/// Exposures bring the reference's brightest and its median to 0.85; what is scaled as a whole
/// differs as before; a change in the dark is seen at the long exposure.
#[test]
fn exposures_follow_the_reference() {
    let x = BRIGHT;
    let shown = x * (0.9036 * x + 0.018) / (x * (0.8748 * x + 0.354) + 0.14);
    assert!((shown - 0.85).abs() < 1e-6, "{shown}");
    let mut reference = alike([0.25; 3]);
    reference[100] = [48.0; 3];
    let mut ours = reference.clone();
    let row = WIDTH as usize;
    ours[20 * row..30 * row].fill([0.35; 3]);
    let scaled =
        |pixels: &[[f32; 3]], by: f32| picture(pixels.iter().map(|p| p.map(|c| c * by)).collect());
    let found = Flip::new(&scaled(&ours, 1.0), &scaled(&reference, 1.0)).expect("alike in size");
    let expected = [(BRIGHT / 48.0).log2() as f32, (BRIGHT / 0.25).log2() as f32];
    for (found, expected) in found.exposures.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-5, "{found} for {expected}");
    }
    // From −4.50 to 3.08 it is eight exposures.
    assert_eq!(found.count, 8);
    println!("{} where it differs", found.error[25 * row]);
    assert!(found.error[25 * row] > 0.1 && found.error[100] == 0.0);
    // Powers of two scale exactly.
    let dark = Flip::new(&scaled(&ours, 0.125), &scaled(&reference, 0.125)).expect("alike in size");
    assert!((dark.exposures[0] - found.exposures[0] - 3.0).abs() < 1e-5);
    for (a, b) in dark.error.iter().zip(&found.error) {
        assert!((a - b).abs() < SCALED);
    }
}

/// No exposure fits a black reference, one pixel has a median, and sizes must agree.
#[test]
fn pictures_at_the_edge_are_compared() {
    let black = picture(alike([0.0; 3]));
    let white = picture(alike([1.0; 3]));
    let found = Flip::new(&white, &black).expect("alike in size");
    assert_eq!((found.exposures, found.count), ([0.0; 2], 2));
    assert!(found.mean() > 0.9);
    let mut lamp = alike([0.0; 3]);
    lamp[7] = [1e6; 3];
    let found = Flip::new(&black, &picture(lamp)).expect("alike in size");
    assert!(found.error.iter().all(|e| (0.0..=1.0).contains(e)));
    let one = |v| Picture::new((1, 1), vec![[v; 3]], &[true]);
    let found = Flip::new(&one(1.0), &one(2.0)).expect("alike in size");
    assert!(found.error[0] > 0.0);
    let error = Flip::new(&one(1.0), &black).expect_err("sizes differ");
    assert!(error.to_string().contains("48x40"), "{error}");
}

#[test]
fn difference_is_written() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let found =
        Flip::new(&picture(pattern(true)), &picture(pattern(false))).expect("alike in size");
    for name in ["flip.png", "flip.exr"] {
        let path = folder.path().join(name);
        found.write(&path).expect("written");
        let read = image::open(&path).expect("a picture").into_rgb32f();
        assert_eq!(read.dimensions(), (WIDTH, HEIGHT));
        // Magma's blue falls between its purple and its orange; its green grows throughout.
        let at = |x: u32, y: u32| read.get_pixel(x, y).0[1];
        assert!(at(22, 12) > at(0, 0), "{name}");
    }
    assert!(found.write(&folder.path().join("flip.bmp")).is_err());
}
