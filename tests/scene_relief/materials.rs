//! What the statements of a material ask for, and what is told of it.

use std::f64::consts::TAU;

use mesolux::scene::{ImportOptions, LoadOptions, load};

use super::{folder, grey16, ramp, rgb_float, rgb8, square, square_toml, waves};

#[test]
fn the_mtl_statements_and_their_factors() {
    let dir = folder(&[
        ("my height.png", &ramp()),
        ("other.png", &grey16(1, 1, |_, _| 7)),
        ("n.png", &rgb8(1, 1, |_, _| [128, 128, 255])),
    ]);
    for (lines, scale) in [
        ("map_Disp my height.png", 1.0),
        ("disp -bm -0.25 my height.png", -0.25),
        ("map_disp -mm 0.3 2 -bm 3 my height.png", 6.0),
        ("map_Bump -bm 0.5 my height.png", 0.5),
        ("bump my height.png", 1.0),
        ("map_bump other.png\nbump -mm 1 4 my height.png", 4.0),
    ] {
        let scene = square(&dir, lines).unwrap();
        let material = &scene.materials[0];
        assert_eq!(material.height_scale, scale, "{lines}");
        assert_eq!(material.map_height.as_ref().unwrap().width, 4, "{lines}");
        assert!(
            material.has_relief() && scene.notes.len() == 1,
            "{:?}",
            scene.notes
        );
    }
    let scene = square(&dir, "bump -bm 9 other.png\ndisp -bm 2 my height.png").unwrap();
    assert_eq!(scene.materials[0].height_scale, 2.0);
    assert_eq!(scene.materials[0].map_height.as_ref().unwrap().width, 4);
    assert!(scene.notes.iter().any(|n| n.contains("disp and bump")));

    let scene = square(&dir, "map_Norm n.png").unwrap();
    assert!(scene.materials[0].map_normal.is_some() && !scene.materials[0].has_relief());
    assert!(
        scene
            .notes
            .iter()
            .any(|n| n.contains("n.png") && n.contains("height map"))
    );

    let lines = "height_map = 'my height.png'\nheight_scale = 0.125\nnormal_map = 'n.png'";
    let material = square_toml(&dir, lines).unwrap().materials.remove(0);
    assert_eq!(material.height_scale, 0.125);
    assert!(material.has_relief() && material.map_normal.is_some());
}

#[test]
fn a_map_without_effect_is_told() {
    let dir = folder(&[("one.png", &grey16(1, 1, |_, _| 9)), ("a.png", &ramp())]);
    for (lines, words) in [
        ("disp one.png", "one.png is flat"),
        ("disp -bm 0 a.png", "scale is 0"),
    ] {
        let scene = square(&dir, lines).unwrap();
        assert!(!scene.materials[0].has_relief());
        assert!(
            scene.notes.iter().any(|n| n.contains(words)),
            "{:?}",
            scene.notes
        );
    }
}

#[test]
fn maps_that_contradict_each_other_are_told_with_the_cure() {
    for (signs, cure) in [
        ([1.0, 1.0], None),
        ([1.0, -1.0], Some("green")),
        ([-1.0, -1.0], Some("sign of the heights")),
        ([-1.0, 1.0], Some("red")),
    ] {
        let (height, normal) = waves(1.0, signs);
        let dir = folder(&[("h.png", &height), ("n.exr", &normal)]);
        let scene = square(&dir, "disp h.png\nnorm n.exr").unwrap();
        let note = scene.notes.iter().find(|n| n.contains("contradict"));
        match cure {
            None => assert_eq!(note, None),
            Some(cure) => {
                let note = note.unwrap();
                assert!(note.contains("h.png") && note.contains("n.exr"), "{note}");
                assert!(note.contains(cure) && note.contains("degrees"), "{note}");
            }
        }
    }
    // Another scale is another strength, no contradiction; a flat normal map is one, which no sign
    // mends.
    let (height, normal) = waves(0.2, [1.0, 1.0]);
    let flat = rgb_float(4, 4, |_, _| [0.5, 0.5, 1.0]);
    let dir = folder(&[("h.png", &height), ("n.exr", &normal), ("flat.exr", &flat)]);
    let scene = square(&dir, "disp -bm 3 h.png\nnorm n.exr").unwrap();
    assert!(!scene.notes.iter().any(|n| n.contains("contradict")));
    let scene = square(&dir, "disp h.png\nnorm flat.exr").unwrap();
    let note = scene
        .notes
        .iter()
        .find(|n| n.contains("contradict"))
        .unwrap();
    assert!(!note.contains("they agree"), "{note}");
}

/// Normals with another wave as steep as that of the heights: half of the squares are lacking.
#[test]
fn slopes_that_heights_lack_are_told() {
    let (height, _) = waves(1.0, [1.0, 1.0]);
    for (finer, told) in [(0.0, None), (1.0, Some("lacks 71 %"))] {
        let normal = rgb_float(64, 64, |x, y| {
            let [u, v] = [x, 63 - y].map(|c| (f64::from(c) + 0.5) / 64.0);
            let wave = |c: f64| (TAU * c + 0.3).cos() + finer * (5.0 * TAU * c).cos();
            let [u, v] = [u, v].map(|c| TAU * 0.25 / 2.0 * wave(c));
            let length = u.hypot(v).hypot(1.0);
            [-u, -v, 1.0].map(|c| (0.5 + 0.5 * c / length) as f32)
        });
        let dir = folder(&[("h.png", &height), ("n.exr", &normal)]);
        let scene = square(&dir, "disp h.png\nnorm n.exr").unwrap();
        let note = scene.notes.iter().find(|n| n.contains("lacks"));
        assert_eq!(note.is_some(), told.is_some());
        if let (Some(note), Some(told)) = (note, told) {
            assert!(note.contains(told) && note.contains("h.png"), "{note}");
        }
    }
}

#[test]
fn the_mean_angle_is_in_scene_units() {
    // A tile of 2 by 2 units: the slopes are half of those in texture space.
    let (height, normal) = waves(1.0, [0.0, 0.0]);
    let dir = folder(&[("h.png", &height), ("n.exr", &normal)]);
    let scene = square(&dir, "disp h.png\nnorm n.exr").unwrap();
    let note = scene
        .notes
        .iter()
        .find(|n| n.contains("contradict"))
        .unwrap();
    let mut sum = 0.0;
    for x in 0..64 {
        for y in 0..64 {
            let slope = |c: f64| TAU * 0.25 / 2.0 * (TAU * (c + 0.5) / 64.0).cos();
            sum += slope(f64::from(x)).hypot(slope(f64::from(y))).atan();
        }
    }
    let angle = (sum / 4096.0).to_degrees();
    assert!(
        note.contains(&format!("{angle:.0} degrees")),
        "{note} {angle}"
    );
}

/// As Blender 4.5 writes it.
#[test]
fn a_bump_map_of_normals_is_a_normal_map_with_heights_of_its_own() {
    let (_, normal) = waves(1.0, [1.0, 1.0]);
    let dir = folder(&[
        ("n.exr", &normal),
        ("flat.png", &rgb8(4, 4, |_, _| [128, 128, 255])),
    ]);
    let scene = square(&dir, "map_Bump -bm 1.000000 n.exr").unwrap();
    let material = &scene.materials[0];
    assert!(material.map_normal.is_some() && material.has_relief());
    let said = |words: &str| scene.notes.iter().any(|note| note.contains(words));
    assert!(
        said("n.exr holds normals") && said("heights of"),
        "{:?}",
        scene.notes
    );
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);

    // Slopes half as steep come from heights half as high.
    let half = square(&dir, "map_Bump -bm 0.5 n.exr").unwrap();
    let ratio = half.materials[0].height_scale / material.height_scale;
    assert!((ratio - 0.5).abs() < 1e-3, "{ratio}");

    let path = dir.path().join("a.obj");
    let without = LoadOptions {
        import: ImportOptions {
            heights_from_normals: false,
            ..ImportOptions::default()
        },
        ..LoadOptions::default()
    };
    let scene = load(path.to_str().unwrap(), &without).unwrap();
    assert!(scene.materials[0].map_normal.is_some() && !scene.materials[0].has_relief());

    let scene = square(&dir, "norm flat.png").unwrap();
    assert!(!scene.materials[0].has_relief());
    assert!(
        scene.notes.iter().any(|n| n.contains("flat.png is flat")),
        "{:?}",
        scene.notes
    );
}

#[test]
fn maps_lie_where_their_options_say() {
    let dir = folder(&[
        (
            "a.png",
            &rgb8(4, 2, |x, y| [10 * x as u8, 20 * y as u8, 200]),
        ),
        ("h.png", &ramp()),
    ]);
    let plain = square(&dir, "").unwrap();
    let scene = square(&dir, "map_Kd -s 2 3 1 -o 0.5 -0.25 a.png").unwrap();
    for (moved, was) in scene.triangles.iter().zip(&plain.triangles) {
        for (uv, [u, v]) in moved.uv.iter().zip(was.uv) {
            assert_eq!(*uv, [2.0 * u + 0.5, 3.0 * v - 0.25]);
        }
    }
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);

    let scene = square(&dir, "map_Kd -s 2 2 1 a.png\ndisp -s 3 3 h.png").unwrap();
    assert_eq!(
        scene.triangles[0].uv[1][0],
        3.0 * plain.triangles[0].uv[1][0]
    );
    let warning = &scene.warnings[0];
    assert!(warning.contains("a.mtl:4: material \"m\": map_Kd") && warning.contains("disp"));

    // The square's coordinates end at 1.
    assert!(
        square(&dir, "map_Kd -clamp on a.png")
            .unwrap()
            .warnings
            .is_empty()
    );
    let scene = square(&dir, "map_Kd -clamp on -s 2 2 a.png").unwrap();
    assert!(
        scene.warnings[0].contains("-clamp is not used"),
        "{:?}",
        scene.warnings
    );

    let heights = |lines| {
        let map = square(&dir, lines).unwrap().materials.remove(0).map_height;
        map.map(|map| map.values.clone()).unwrap()
    };
    assert!(
        heights("disp -imfchan r a.png")[..4] == [0.0, 10.0 / 255.0, 20.0 / 255.0, 30.0 / 255.0]
    );
    assert!(heights("disp -imfchan g a.png")[4..] == [20.0 / 255.0; 4]);
}

/// Faces without texture coordinates are projected as without `-s` and `-o`: a warning with the
/// line.
#[test]
fn places_of_maps_need_texture_coordinates() {
    let dir = folder(&[("a.png", &ramp())]);
    let bare = |lines| {
        square(&dir, lines).unwrap();
        let obj = dir.path().join("a.obj");
        let text = std::fs::read_to_string(&obj).unwrap();
        let face = "f 1/1 2/2 3/3 4/4";
        std::fs::write(&obj, text.replace(face, "f 1 2 3 4")).unwrap();
        load(obj.to_str().unwrap(), &LoadOptions::default()).unwrap()
    };
    let plain = bare("map_Kd a.png");
    assert!(plain.warnings.is_empty(), "{:?}", plain.warnings);
    let scene = bare("map_Kd -s 2 2 1 a.png");
    assert_eq!(scene.triangles, plain.triangles);
    let [warning] = &scene.warnings[..] else {
        panic!("{:?}", scene.warnings);
    };
    assert!(
        warning.contains("a.mtl:4: material \"m\": map_Kd has -s and -o, without effect"),
        "{warning}"
    );
}

#[test]
fn what_would_change_the_light_and_is_not_used_is_a_warning() {
    let lamp = rgb_float(2, 1, |x, _| [4.0 * x as f32, 1.0, 0.5]);
    let dir = folder(&[("lamp.exr", &lamp)]);
    for (lines, words) in [
        (
            "d 0.5",
            "a.mtl:4: material \"m\": d: surfaces are opaque, not 0.5",
        ),
        (
            "Tr 0.25",
            "a.mtl:4: material \"m\": Tr: surfaces are opaque, not 0.75",
        ),
        ("shine 3", "a.mtl:4: material \"m\": shine is not used"),
    ] {
        let scene = square(&dir, lines).unwrap();
        let is_said = scene.warnings.len() == 1 && scene.warnings[0].contains(words);
        assert!(is_said, "{:?}", scene.warnings);
    }
    let scene = square(&dir, "d 1\nTr 0\nKs 0.5 0.5 0.5\nNi 1.45\nillum 2").unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    // Blender writes no Ke beside a texture of it.
    let mtl = "newmtl m\nKd 0.5 0.5 0.5\nmap_Ke lamp.exr\n";
    std::fs::write(dir.path().join("a.mtl"), mtl).unwrap();
    let path = dir.path().join("a.obj");
    let scene = load(path.to_str().unwrap(), &LoadOptions::default()).unwrap();
    assert_eq!(scene.materials[0].ke, [1.0; 3]);
    assert_eq!(scene.materials[0].mean_emission(), [2.0, 1.0, 0.5]);
}
