//! Bakes a scene with its relief and prints the mean irradiance:
//! `cargo run --release --no-default-features --example bake -- cornell-relief`

use mesolux::bake;
use mesolux::scene::{self, LoadOptions};
use mesolux::solver::{self, Settings};

fn main() -> mesolux::error::Result<()> {
    let name = std::env::args().nth(1);
    let name = name.as_deref().unwrap_or("cornell-relief");
    let scene = scene::load(name, &LoadOptions::default())?;
    let device = solver::open_device(None, false)?;
    let solution = bake::bake(&device, &scene, &Settings::default(), |update| {
        eprintln!("{} shots, {:.4} unshot", update.shots, update.unshot_share);
        true // go on
    })?;

    // Over the area, W/m², RGB.
    let light = solution.irradiance.iter().zip(&solution.area);
    let power = light.fold([0.0; 3], |sum, (irradiance, area)| {
        [0, 1, 2].map(|c| sum[c] + f64::from(irradiance[c]) * area)
    });
    let whole: f64 = solution.area.iter().sum();
    let [r, g, b] = power.map(|p| p / whole);
    println!(
        "{name}: {} elements, mean irradiance {r:.4} {g:.4} {b:.4} W/m²",
        solution.area.len()
    );
    if let Some(relief) = &solution.relief {
        println!(
            "{} of them have relief and hold their light by {} directions",
            relief.elements.len(),
            relief.directions.len()
        );
    }
    Ok(())
}
