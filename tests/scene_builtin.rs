//! The built-in scenes with relief: exact counts, closed statues and fruit, maps that repeat.

use mesolux::scene::HeightMap;
use mesolux::scene::builtin::relief_maps;

/// Root mean square slope of a map whose peak stands `height` tiles above its valley.
fn rms_slope(map: &HeightMap, height: f64) -> f64 {
    let n = map.width as usize;
    let at = |x: usize, y: usize| f64::from(map.values[(y % n) * n + x % n]);
    let mut sum = 0.0;
    for y in 0..n {
        for x in 0..n {
            let (du, dv) = (at(x + 1, y) - at(x, y), at(x, y + 1) - at(x, y));
            sum += (du * du + dv * dv) * (height * n as f64).powi(2);
        }
    }
    (sum / (n * n) as f64).sqrt()
}

#[test]
fn maps_span_all_codes_and_repeat_without_a_seam() {
    for map in [
        relief_maps::hammered_metal(64),
        relief_maps::orange_peel(64),
        relief_maps::knit(64),
        relief_maps::brick(64),
    ] {
        let name = map.path.display().to_string();
        assert_eq!(map.values.len(), 64 * 64);
        for value in &map.values {
            let code = (value * 65_535.0).round();
            assert_eq!(code / 65_535.0, *value, "{name}");
        }
        assert!(
            map.values.contains(&0.0) && map.values.contains(&1.0),
            "{name}"
        );
        println!(
            "{name}: rms slope {:.3} at a tenth of the tile, mean {:.3}",
            rms_slope(&map, 0.1),
            map.mean()
        );
        // The step across the seam is no greater than the greatest step within.
        let at = |x: usize, y: usize| map.values[(y % 64) * 64 + x % 64];
        let step = |x: usize, y: usize| {
            (at(x + 1, y) - at(x, y))
                .abs()
                .max((at(x, y + 1) - at(x, y)).abs())
        };
        let inside = (0..63).flat_map(|y| (0..63).map(move |x| (x, y)));
        let inside = inside.map(|(x, y)| step(x, y)).fold(0.0, f32::max);
        let seam = (0..64)
            .map(|k| step(63, k).max(step(k, 63)))
            .fold(0.0, f32::max);
        assert!(seam <= inside, "{name}: {seam} over {inside}");
    }
}
