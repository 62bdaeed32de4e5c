use super::*;

/// A height map of W × H texels, `[row][column]`, in 0..=1.
const SIZE: [usize; 2] = [192, 130];
/// Of one repeat, scene units.
const TILE: DVec2 = DVec2::new(1.5, 1.0);

type Heights = fn(f64, f64) -> f64;

/// u to the right, v down.
fn bricks(u: f64, v: f64) -> f64 {
    let row = (8.0 * v).floor();
    let (along, across) = ((4.0 * u + 0.5 * (row % 2.0)).fract(), (8.0 * v).fract());
    let edge = (along.min(1.0 - along) / 4.0).min(across.min(1.0 - across) / 8.0);
    ((edge - 0.006) / 0.02).clamp(0.0, 1.0)
}

fn bumps(u: f64, v: f64) -> f64 {
    let (x, y) = ((6.0 * u).fract() - 0.5, (6.0 * v).fract() - 0.5);
    (0.16 - x * x - y * y).max(0.0).sqrt() / 0.4
}

/// Waves of random phases, longer ones higher.
fn noise(u: f64, v: f64) -> f64 {
    let mut sum = 0.0;
    for (k, l) in (1..24).flat_map(|k| (-23..24).map(move |l| (k, l))) {
        let size = f64::from(k).hypot(f64::from(l));
        let phase = (f64::from(k * 131 + l * 71).sin() * 43_758.545).fract() * TAU;
        sum += size.powf(-1.8) * (TAU * (f64::from(k) * u + f64::from(l) * v) + phase).cos();
    }
    0.5 + 0.15 * sum
}

fn sampled(of: Heights) -> Vec<f64> {
    let [width, height] = SIZE;
    let at = |k: usize, n: usize| (k as f64 + 0.5) / n as f64;
    (0..width * height)
        .map(|i| of(at(i % width, width), at(i / width, height)))
        .collect()
}

/// Slopes along a row and down a column, at the centre of each texel, by differences of heights.
fn differences(heights: &[f64], by: Derivative) -> Vec<[f64; 2]> {
    let [width, height] = SIZE;
    let at = |x: isize, y: isize| {
        let wrap = |k: isize, n: usize| k.rem_euclid(n as isize) as usize;
        heights[wrap(y, height) * width + wrap(x, width)]
    };
    (0..(width * height) as isize)
        .map(|i| {
            let (x, y) = (i % width as isize, i / width as isize);
            let along = |dy| 0.5 * (at(x + 1, y + dy) - at(x - 1, y + dy));
            let down = |dx| 0.5 * (at(x + dx, y + 1) - at(x + dx, y - 1));
            let smooth = |of: &dyn Fn(isize) -> f64| 0.25 * (of(-1) + 2.0 * of(0) + of(1));
            match by {
                Derivative::Smoothed => [smooth(&along), smooth(&down)],
                Derivative::Neighbour(_) => [at(x + 1, y) - at(x, y), at(x, y) - at(x, y - 1)],
                Derivative::Exact | Derivative::Central => [along(0), down(0)],
            }
        })
        .collect()
}

/// Parts of a texel along a row, and down a column.
const WITHIN: usize = 8;

/// Heights as means over each texel, as an image of a scene or a photograph has them.
fn means(of: Heights) -> Vec<f64> {
    let [width, height] = SIZE;
    let place = |k: usize, part: usize, n: usize| {
        (k as f64 + (part as f64 + 0.5) / WITHIN as f64) / n as f64
    };
    let parts = (WITHIN * WITHIN) as f64;
    (0..width * height)
        .map(|i| {
            let part = |p: usize| {
                let u = place(i % width, p % WITHIN, width);
                of(u, place(i / width, p / WITHIN, height))
            };
            (0..WITHIN * WITHIN).map(part).sum::<f64>() / parts
        })
        .collect()
}

/// Slopes a texel of the heights themselves, as means over each texel.
fn mean_slopes(of: Heights) -> Vec<[f64; 2]> {
    let [width, height] = SIZE;
    let (w, h) = (width as f64, height as f64);
    let mean = |from: &dyn Fn(f64) -> f64| {
        (0..WITHIN)
            .map(|k| from((k as f64 + 0.5) / WITHIN as f64))
            .sum::<f64>()
            / WITHIN as f64
    };
    (0..width * height)
        .map(|i| {
            let (x, y) = ((i % width) as f64, (i / width) as f64);
            // The mean of a derivative is the difference of the ends.
            let column = |x: f64| mean(&|t| of((x / w).rem_euclid(1.0), (y + t) / h));
            let row = |y: f64| mean(&|t| of((x + t) / w, (y / h).rem_euclid(1.0)));
            [column(x + 1.0) - column(x), row(y + 1.0) - row(y)]
        })
        .collect()
}

/// The normal map of slopes a texel of heights `scale` high, rounded to 8 bit.
fn coded(slopes: &[[f64; 2]], scale: f64) -> NormalMap {
    let [width, height] = SIZE;
    let texels = [TILE.x / width as f64, TILE.y / height as f64];
    let normal = |&[along, down]: &[f64; 2]| {
        let n = glam::DVec3::new(-along * scale / texels[0], down * scale / texels[1], 1.0);
        let code = |c: f64| ((c + 1.0) / 2.0 * 255.0).round() / 255.0 * 2.0 - 1.0;
        let n = n.normalize();
        let n = glam::DVec3::new(code(n.x), code(n.y), code(n.z)).normalize();
        n.as_vec3().to_array()
    };
    NormalMap {
        path: "normals.png".into(),
        width: width as u32,
        height: height as u32,
        normals: slopes.iter().map(normal).collect(),
    }
}

/// Root mean square of what heights are off, over the range of the true ones.
fn error(found: &Integrated, truth: &[f64], scale: f64) -> f64 {
    let count = truth.len() as f64;
    let values = || found.map.values.iter().map(|&v| found.scale * f64::from(v));
    let mean = values().sum::<f64>() / count;
    let of_truth = scale * truth.iter().sum::<f64>() / count;
    let squares = values().zip(truth).map(|(v, t)| {
        let off = (v - mean) - (scale * t - of_truth);
        off * off
    });
    let high = truth.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let low = truth.iter().copied().fold(f64::INFINITY, f64::min);
    (squares.sum::<f64>() / count).sqrt() / (scale * (high - low))
}

#[test]
fn heights_come_back_from_their_normals() {
    let next = Derivative::Neighbour([Step::Next, Step::Before]);
    let differenced = [
        ("central", Derivative::Central),
        ("smoothed", Derivative::Smoothed),
        ("next", next),
    ];
    let check = |name: &str, truth: &[f64], slopes: &[[f64; 2]]| {
        for scale in [0.01, 0.1] {
            let found = integrate(&coded(slopes, scale), TILE);
            let off = error(&found, truth, scale);
            println!(
                "{name}, {scale} high: rms {:.2} % of the range, {:.1} % unexplained",
                100.0 * off,
                100.0 * found.unexplained
            );
            assert!(off <= MOST, "{name}");
        }
    };
    for (name, of) in [
        ("bricks", bricks as Heights),
        ("bumps", bumps),
        ("noise", noise),
    ] {
        let truth = sampled(of);
        for (by, derivative) in differenced {
            check(
                &format!("{name}, {by}"),
                &truth,
                &differences(&truth, derivative),
            );
        }
    }
    for (name, of) in [("bricks", bricks as Heights), ("bumps", bumps)] {
        check(&format!("{name}, means"), &means(of), &mean_slopes(of));
    }
}

/// Measured: at most 1.7 %, where the map holds means over each texel; 0.9 % where differences of
/// texels made it.
const MOST: f64 = 0.02;

/// Slopes that turn around each place are those of no height.
#[test]
fn what_no_height_explains_is_reported() {
    let heights = sampled(noise);
    let slopes = differences(&heights, Derivative::Central);
    let turned: Vec<[f64; 2]> = slopes.iter().map(|&[x, y]| [-y, x]).collect();
    let found = integrate(&coded(&turned, 0.05), TILE);
    println!("{:.3} of the slopes are unexplained", found.unexplained);
    assert!(found.unexplained > 0.9);
    // A tilt does not repeat.
    let tilted = integrate(&coded(&vec![[0.01, 0.0]; heights.len()], 0.5), TILE);
    assert!(tilted.unexplained > 0.99 && tilted.scale < 1e-12);
}

#[test]
fn a_flat_map_has_no_heights() {
    let [width, height] = SIZE;
    let flat = integrate(&coded(&vec![[0.0; 2]; width * height], 1.0), TILE);
    // The code of 0 in 8 bit is none: all normals lean by as much.
    assert!(flat.scale < 1e-12, "{}", flat.scale);
}

/// Tiles of one shape have the same heights, in proportion to their size.
#[test]
fn a_map_is_integrated_once_for_each_shape_of_its_tiles() {
    let slopes = differences(&sampled(bumps), Derivative::Central);
    let normals = Arc::new(coded(&slopes, 0.05));
    let known = Known {
        normals: normals.clone(),
        tile: TILE,
        integrated: integrate(&normals, TILE),
    };
    let larger = known.on(&normals, 3.0 * TILE).expect("the same shape");
    assert!(Arc::ptr_eq(&larger.map, &known.integrated.map));
    let anew = integrate(&normals, 3.0 * TILE);
    assert!((larger.scale / anew.scale - 1.0).abs() < 1e-12);
    assert!((larger.unexplained - anew.unexplained).abs() < 1e-12);
    let copy = Arc::new(normals.as_ref().clone());
    assert!(known.on(&copy, TILE).is_some());
    let other = Arc::new(coded(&slopes, 0.06));
    assert!(known.on(&other, TILE).is_none());
    assert!(
        known
            .on(&normals, DVec2::new(TILE.x, 2.0 * TILE.y))
            .is_none()
    );
}
