//! Extreme height maps.

use glam::DVec3;

use super::{Case, Check, Context, Solved, furnace_material, settings};
use crate::error::{Error, Result};
use crate::scene::HeightMap;
use crate::scene::shapes::Shapes;

pub(super) const MAP_SHAPES: Case = Case {
    name: "map_shapes",
    asked: "height maps of 1x1, of 4x64 and of 16 bit on the floor of a closed furnace: radiosity 1",
    run: map_shapes,
};
pub(super) const EXTREME_HEIGHTS: Case = Case {
    name: "extreme_heights",
    asked: "reliefs a millionth and a half as high as their tile is wide in a closed furnace: radiosity 1; a thousand times: refused",
    run: extreme_heights,
};

/// Measured: 3.1e-3.
const RELIEF_MOST: f64 = 6e-3;

/// A closed furnace whose floor has that relief, four repeats a side.
fn room(relief: impl FnOnce(&mut Shapes, u32)) -> Shapes {
    let mut shapes = Shapes::new();
    let plain = furnace_material(&mut shapes, 0.5);
    let floor = furnace_material(&mut shapes, 0.7);
    let sides = shapes.room(DVec3::ZERO, DVec3::ONE, 6, plain);
    for t in &mut shapes.scene.triangles[sides[0].clone()] {
        t.material = floor;
    }
    shapes.uv(sides[0].clone(), 0.25 * DVec3::Z, 0.25 * DVec3::X);
    relief(&mut shapes, floor);
    shapes
}

fn bumps(x: f64, y: f64) -> f64 {
    let wave = |a: f64| (std::f64::consts::TAU * a).sin();
    0.004 * wave(x) * wave(2.0 * y)
}

fn off(solved: &Solved) -> f64 {
    solved.off_one(0..solved.area.len()).1
}

fn map_shapes(context: &Context) -> Result<Vec<Check>> {
    let solve = |shapes: &Shapes| context.solve(&shapes.scene, &settings());
    let none = solve(&room(|_, _| {}))?;
    let one = solve(&room(|s, m| s.relief_of(m, (1, 1), |_, _| 0.3)))?;
    let narrow = solve(&room(|s, m| s.relief_of(m, (4, 64), bumps)))?;
    // Two codes that are equal in 8 bits.
    let folder = tempfile::tempdir().map_err(|e| Error::write(&std::env::temp_dir(), e))?;
    let path = folder.path().join("heights.png");
    let codes: Vec<u16> = (0..16 * 16)
        .map(|i| 32_768 + (i * 37 % 200) as u16)
        .collect();
    image::ImageBuffer::<image::Luma<u16>, _>::from_raw(16, 16, codes.clone())
        .ok_or_else(|| Error::file(&path, "16² texels are 16² texels"))?
        .save(&path)
        .map_err(|e| Error::file(&path, e.to_string()))?;
    let (map, _) = HeightMap::load(&path)?;
    let exact =
        map.values.iter().zip(&codes).all(|(v, &c)| {
            (f64::from(*v) - f64::from(c) / 65_535.0).abs() <= f64::from(f32::EPSILON)
        });
    let deep = solve(&room(|s, m| {
        let material = &mut s.scene.materials[m as usize];
        material.map_height = Some(std::sync::Arc::new(map));
        material.height_scale = 5.0;
    }))?;
    Ok(vec![
        Check::holds(
            "1x1 is the plain floor to the bit",
            one.radiosity == none.radiosity,
        ),
        Check::at_most("largest error at 4x64", off(&narrow), RELIEF_MOST),
        Check::holds("16 bits are read", exact),
        Check::at_most("largest error of 16 bits", off(&deep), RELIEF_MOST),
    ])
}

fn extreme_heights(context: &Context) -> Result<Vec<Check>> {
    let solve = |factor: f64| {
        // At factor 1 from 0.24 below the mean to 0.24 above it, on tiles of 0.25.
        let shapes = room(|s, m| s.relief(m, 16, |x, y| factor * 60.0 * bumps(x, y)));
        context.solve(&shapes.scene, &settings())
    };
    let mut checks = Vec::new();
    for factor in [1e-6, 0.3] {
        let most = off(&solve(factor)?);
        checks.push(Check::at_most(
            format!("largest error at {factor:e}"),
            most,
            RELIEF_MOST,
        ));
    }
    let said = solve(1e3).err().map_or(String::new(), |e| e.to_string());
    checks.push(Check::holds(
        "1e3 is refused by its slope",
        said.contains("slope"),
    ));
    Ok(checks)
}
