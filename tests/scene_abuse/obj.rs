//! Wrong lines of a model and of its materials.

use super::{GOOD, MTL, refused, try_files};

#[test]
fn wrong_obj_lines_are_named() {
    for (from, to, fragments) in [
        ("v 1 0 0", "v 1 0", ["a.obj:3:", "3 coordinates, found 2"]),
        ("v 1 0 0", "v 1 0 0 0 0", ["a.obj:3:", "found 5"]),
        ("v 1 0 0", "v", ["a.obj:3:", "found 0"]),
        (
            "v 1 0 0",
            "v 1 nan 0",
            ["a.obj:3:", "\"nan\" is not a finite number"],
        ),
        (
            "v 1 0 0",
            "v 1 -inf 0",
            ["a.obj:3:", "\"-inf\" is not a finite"],
        ),
        (
            "v 1 0 0",
            "v 1 1e999 0",
            ["a.obj:3:", "\"1e999\" is not a finite"],
        ),
        ("v 1 0 0", "v 1 o 0", ["a.obj:3:", "\"o\" is not a number"]),
        ("v 1 0 0", "v 1 0 0 0", ["a.obj:3:", "weight"]),
        ("vt 1 0", "vt 1", ["a.obj:6:", "2 coordinates, found 1"]),
        ("vt 1 0", "vt 1 NaN", ["a.obj:6:", "NaN"]),
        ("vt 1 0", "vt 1 1e300", ["a.obj:6:", "too large"]),
        ("2/2 3/3", "2/2", ["a.obj:9:", "3 corners, found 2"]),
        ("1/1 2/2 3/3", "", ["a.obj:9:", "3 corners, found 0"]),
        ("3/3", "0/3", ["a.obj:9:", "vertex index 0"]),
        (
            "3/3",
            "4/3",
            ["a.obj:9:", "vertex index 4 is out of range: 3 so far"],
        ),
        (
            "3/3",
            "-4/3",
            ["a.obj:9:", "vertex index -4 is out of range"],
        ),
        (
            "3/3",
            "3/4",
            ["a.obj:9:", "texture vertex index 4 is out of range"],
        ),
        (
            "3/3",
            "3/3/1",
            ["a.obj:9:", "normal index 1 is out of range"],
        ),
        ("3/3", "3/3/1/1", ["a.obj:9:", "normal index"]),
        ("3/3", "3", ["a.obj:9:", "2 of 3 corners"]),
        ("3/3", "x/3", ["a.obj:9:", "\"x\" is not a vertex index"]),
        (
            "3/3",
            "99999999999999999999",
            ["a.obj:9:", "is not a vertex index"],
        ),
        (
            "3/3",
            "-9223372036854775808/3",
            ["a.obj:9:", "out of range"],
        ),
        ("usemtl lamp", "usemtl lamb", ["a.obj:8:", "\"lamb\""]),
        ("usemtl lamp", "usemtl", ["a.obj:8:", "no material"]),
        ("mtllib a.mtl", "mtllib b.mtl", ["a.obj:1:", "\"b.mtl\""]),
        ("mtllib a.mtl", "mtllib", ["a.obj:1:", "no file"]),
        ("f 1/1 2/2 3/3", "", ["a.obj", "no face"]),
        (
            "v 1 1 0",
            "v 0.5 0 0",
            ["a.obj", "no triangle in it with an area (1"],
        ),
        (
            "v 1 0 0\nv 1 1 0",
            "v 1e16 0 0\nv 0 1e16 0",
            ["a.obj", "units across"],
        ),
        (
            "v 1 0 0\nv 1 1 0",
            "v 1e308 -1e308 0\nv 0 1e308 0",
            ["a.obj", "units across"],
        ),
        ("usemtl lamp", "", ["a.obj", "no light"]),
    ] {
        refused("a.obj", "a.obj", from, to, &fragments);
    }
}

#[test]
fn wrong_materials_are_named() {
    for (from, to, fragments) in [
        (
            "0.1 0.2 0.3",
            "0.1 1.2 0.3",
            [
                "material \"lamp\": reflectance Kd (0.1, 1.2, 0.3) must be in 0..=1",
                "a.mtl",
            ],
        ),
        (
            "0.1 0.2 0.3",
            "-0.1 0.2 0.3",
            ["material \"lamp\": reflectance Kd", "a.mtl"],
        ),
        (
            "0.1 0.2 0.3",
            "nan 0.2 0.3",
            ["a.mtl:2: material \"lamp\": Kd", "nan"],
        ),
        (
            "0.1 0.2 0.3",
            "0.1 0.2",
            ["a.mtl:2: material \"lamp\": Kd", "found 2"],
        ),
        (
            "Kd 0.1 0.2 0.3",
            "Kd",
            ["a.mtl:2: material \"lamp\": Kd", "found 0"],
        ),
        (
            "Ke 1 2 3",
            "Ke 1 -2 3",
            ["material \"lamp\": emitted radiance Ke (1, -2, 3)", "a.mtl"],
        ),
        (
            "Ke 1 2 3",
            "Ke 1 inf 3",
            ["a.mtl:3: material \"lamp\": Ke", "inf"],
        ),
        (
            "Ke 1 2 3",
            "Ke 1 1e39 3",
            ["a.mtl:3: material \"lamp\": Ke", "too large"],
        ),
        ("Ke 1 2 3", "Ke 0 0 0", ["no light", "a.obj"]),
        (
            "Ke 1 2 3",
            "Ke 1 2 3\nmap_Kd gone.png",
            ["material \"lamp\": map_Kd", "gone.png"],
        ),
        (
            "Ke 1 2 3",
            "Ke 1 2 3\nmap_Kd a.obj",
            ["material \"lamp\": map_Kd", "cannot be decoded"],
        ),
        (
            "Ke 1 2 3",
            "Ke 1 2 3\nmap_Kd",
            ["a.mtl:4:", "names no file"],
        ),
        (
            "Ke 1 2 3",
            "Ke 1 2 3\nmap_Kd -zoom 2 x.png",
            ["a.mtl:4:", "-zoom is not known"],
        ),
        (
            "Ke 1 2 3",
            "Ke 1 2 3\nmap_Kd -s 0 2 1 x.png",
            ["a.mtl:4:", "-s: must not be 0"],
        ),
        (
            "Ke 1 2 3",
            "Ke 1 2 3\nmap_Kd -o x.png",
            ["a.mtl:4:", "-o: \"x.png\" is not a number"],
        ),
        (
            "Ke 1 2 3",
            "Ke 1 2 3\nd half",
            ["a.mtl:4:", "d: \"half\" is not a number"],
        ),
        ("newmtl lamp", "newmtl", ["a.mtl:1:", "no name"]),
        ("newmtl lamp", "", ["a.mtl:2:", "before the first newmtl"]),
        ("Ke 1 2 3", "newmtl lamp", ["a.mtl:3:", "twice"]),
    ] {
        refused("a.obj", "a.mtl", from, to, &fragments);
    }
}

#[test]
fn a_texture_brighter_than_white_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let picture = image::ImageBuffer::from_pixel(2, 2, image::Rgb([0.5_f32, 20.0, 0.5]));
    image::DynamicImage::from(picture)
        .save(dir.path().join("x.exr"))
        .unwrap();
    let mtl = format!("{MTL}map_Kd x.exr\n");
    let files = [("a.mtl", mtl.as_str()), GOOD[1], GOOD[2]];
    let error = try_files(dir.path(), "a.obj", files).unwrap_err();
    assert!(
        error.contains("material \"lamp\"") && error.contains("x.exr"),
        "{error}"
    );
}
