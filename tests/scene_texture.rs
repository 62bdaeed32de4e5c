//! Textures: what each format decodes to, sampling, and the mean over a triangle.

use std::path::{Path, PathBuf};

use image::{DynamicImage, ImageBuffer, Luma, Rgb, Rgba};
use mesolux::scene::Texture;

fn save(dir: &Path, name: &str, image: impl Into<DynamicImage>) -> PathBuf {
    let path = dir.join(name);
    image.into().save(&path).unwrap();
    path
}

fn close(a: [f32; 3], b: [f32; 3], tolerance: f32) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance)
}

/// IEC 61966-2-1.
fn linear(c: f64) -> f32 {
    (if c <= 0.04045 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    }) as f32
}

#[test]
fn codes_become_linear_light() {
    let dir = tempfile::tempdir().unwrap();
    let rgb8 = ImageBuffer::from_fn(2, 1, |x, _| Rgb([if x == 0 { 0_u8 } else { 188 }, 255, 10]));
    let texture = Texture::load(&save(dir.path(), "rgb8.png", rgb8)).unwrap();
    assert_eq!((texture.width, texture.height), (2, 1));
    // One unit in the last place of f32 at 1.
    const ROUNDING: f32 = 1.2e-7;
    assert_eq!(texture.texels[0][0], 0.0);
    assert_eq!(texture.texels[0][1], 1.0);
    assert!(close(
        texture.texels[1],
        [linear(188.0 / 255.0), 1.0, linear(10.0 / 255.0)],
        ROUNDING
    ));

    let rgb16 = ImageBuffer::from_pixel(1, 1, Rgb([1_u16, 30_000, 65_535]));
    let texture = Texture::load(&save(dir.path(), "rgb16.png", rgb16)).unwrap();
    let expected = [linear(1.0 / 65_535.0), linear(30_000.0 / 65_535.0), 1.0];
    assert!(
        close(texture.texels[0], expected, ROUNDING),
        "{:?}",
        texture.texels[0]
    );

    let grey = ImageBuffer::from_pixel(1, 1, Luma([100_u8]));
    let texture = Texture::load(&save(dir.path(), "grey.png", grey)).unwrap();
    assert!(close(
        texture.texels[0],
        [linear(100.0 / 255.0); 3],
        ROUNDING
    ));

    let transparent = ImageBuffer::from_pixel(1, 1, Rgba([100_u8, 100, 100, 0]));
    let texture = Texture::load(&save(dir.path(), "alpha.png", transparent)).unwrap();
    assert!(close(
        texture.texels[0],
        [linear(100.0 / 255.0); 3],
        ROUNDING
    ));

    let jpeg = ImageBuffer::from_pixel(16, 16, Rgb([128_u8, 128, 128]));
    let texture = Texture::load(&save(dir.path(), "grey.jpg", jpeg)).unwrap();
    // The coder may be off by two codes, each at most 1 % of the range in linear light here.
    assert!(close(texture.texels[37], [linear(128.0 / 255.0); 3], 0.02));
}

#[test]
fn exr_is_linear_already() {
    let dir = tempfile::tempdir().unwrap();
    let exr = |name, value| {
        let image = ImageBuffer::from_fn(3, 2, |x, y| Rgb([x as f32, value, y as f32]));
        save(dir.path(), name, image)
    };
    let texture = Texture::load(&exr("good.exr", 0.2)).unwrap();
    assert_eq!(texture.texels[5], [2.0, 0.2, 1.0]);
    assert_eq!(texture.highest(), [2.0, 0.2, 1.0]);
    for (name, value) in [
        ("nan.exr", f32::NAN),
        ("inf.exr", f32::INFINITY),
        ("minus.exr", -0.1),
    ] {
        let error = Texture::load(&exr(name, value)).unwrap_err().to_string();
        assert!(
            error.contains(name) && error.contains("texel (0, 0)"),
            "{error}"
        );
    }
}

#[test]
fn what_is_no_picture_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    for (name, bytes) in [
        ("empty.png", &b""[..]),
        ("text.png", b"hello"),
        ("cut.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"),
        // A header that asks for 65,535 by 65,535 texels, past the decoder's limit.
        (
            "vast.png",
            b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\xff\xff\0\0\xff\xff\x10\x06\0\0\0\0\0\0\0",
        ),
    ] {
        let path = dir.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let error = Texture::load(&path).unwrap_err().to_string();
        assert!(error.contains(name) && !error.contains('\n'), "{error}");
    }
    let error = Texture::load(&dir.path().join("absent.png"))
        .unwrap_err()
        .to_string();
    assert!(error.contains("absent.png: cannot be read"), "{error}");
}

fn texture(width: u32, height: u32, texel: impl Fn(u32, u32) -> f32) -> Texture {
    let texels = (0..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .map(|(x, y)| [texel(x, y), 0.25, 1.0 - texel(x, y)])
        .collect();
    Texture {
        path: PathBuf::new(),
        width,
        height,
        texels,
    }
}

#[test]
fn sampling_meets_texel_centres_and_repeats_with_v_up() {
    let t = texture(4, 2, |x, y| (x + 4 * y) as f32);
    // Row 0 is the top one, v = 0.75.
    assert_eq!(t.sample_bilinear(0.125, 0.75)[0], 0.0);
    assert_eq!(t.sample_bilinear(0.125, 0.25)[0], 4.0);
    assert_eq!(t.sample_bilinear(0.25, 0.25)[0], 4.5);
    assert_eq!(t.sample_bilinear(0.25, 0.5)[0], 2.5);
    // Between the last column and the first.
    assert_eq!(t.sample_bilinear(0.0, 0.75)[0], 1.5);
    assert_eq!(
        t.sample_bilinear(-7.875, 2.75)[0],
        t.sample_bilinear(0.125, 0.75)[0]
    );
}

#[test]
fn the_mean_of_a_gradient_is_its_value_at_the_centroid() {
    let t = texture(64, 64, |x, _| (x as f32 + 0.5) / 64.0);
    for uv in [
        [[0.1, 0.1], [0.9, 0.2], [0.3, 0.8]],
        [[0.2, 0.2], [0.21, 0.2], [0.2, 0.21]],
        [[0.5, 0.5], [0.5, 0.5], [0.5, 0.5]],
    ] {
        let centroid = (uv[0][0] + uv[1][0] + uv[2][0]) / 3.0;
        let mean = t.mean_over_triangle(&uv);
        // Exact where the strata resolve the texels; jittered strata err by less than the step of
        // one, 0.8/64, over the root of their number, 64: 2e-4.
        assert!(
            close(mean, [centroid, 0.25, 1.0 - centroid], 4e-4),
            "{mean:?} {centroid}"
        );
    }
}

#[test]
fn the_mean_weighs_by_area() {
    // Left half black, right half white: the triangle (0,0) (1,0) (1,1) has three quarters of its
    // area on the right.
    let t = texture(256, 4, |x, _| if x < 128 { 0.0 } else { 1.0 });
    let mean = t.mean_over_triangle(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]);
    // Standard error of 64² jittered strata of which one in 64 straddles the edge: under 1e-3; the
    // filter's half texel at the repeat adds 1/512.
    assert!((mean[0] - 0.75).abs() < 4e-3, "{mean:?}");
    // A checkerboard far finer than the strata must not fall into step with them.
    let t = texture(512, 512, |x, y| ((x + y) % 2) as f32);
    let mean = t.mean_over_triangle(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    // Standard error of 4,096 independent samples with variance at most 1/4: 0.8 %; three of them.
    assert!((mean[0] - 0.5).abs() < 0.024, "{mean:?}");
    assert_eq!(
        mean,
        t.mean_over_triangle(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    );
    // Wound the other way, over many repeats, and beyond all bounds: still a mean.
    for size in [-1.0, 50.0, 1e30] {
        let mean = t.mean_over_triangle(&[[0.0, 0.0], [0.0, size], [size, 0.0]]);
        assert!(mean.iter().all(|c| (0.0..=1.0).contains(c)), "{mean:?}");
    }
}
