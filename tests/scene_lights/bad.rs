//! Bad lights: one line that names the file, the line and the light, and no panic.

use std::fs;

use tempfile::TempDir;

use super::read_in;

/// As [`super::ies::file`] writes it, shorter.
const IES: &str = "IESNA:LM-63-2002\n[TEST] x\nTILT=NONE\n1 -1 1 3 2 1 2 0 0 0\n1 1 0\n0 45 90\n0 90\n\
                   3 2 1\n3 2 1\n";

fn error(ies: &str, tables: &str) -> String {
    let dir = TempDir::new().unwrap();
    fs::write(dir.path().join("x.ies"), ies).unwrap();
    fs::write(dir.path().join("x.exr"), b"not a picture").unwrap();
    fs::write(dir.path().join("x.png"), b"not a picture").unwrap();
    let error = read_in(dir.path(), tables).expect_err(tables).to_string();
    assert!(!error.contains('\n'), "one line: {error:?}");
    assert!(error.contains("a.toml"), "{error}");
    error
}

#[test]
fn bad_ies_files() {
    let table = "[[point_light]]\nname = 'p'\nposition = [0, 2, 0]\nies = 'x.ies'\n";
    for (from, to, fragments) in [
        (IES, "", ["TILT="]),
        (IES, "\0\u{ff}garbage", ["TILT="]),
        (
            "TILT=NONE",
            "TILT=lamp.tlt",
            [":3: the lamp's tilt stands in another file, lamp.tlt"],
        ),
        ("TILT=NONE", "TILT=", [":3: TILT= must be"]),
        (
            "TILT=NONE",
            "TILT=INCLUDE",
            ["number of tilts must be a whole number"],
        ),
        (
            "TILT=NONE",
            "TILT=INCLUDE\n1 900000 2 3",
            [":4: more tilts"],
        ),
        (
            "TILT=NONE",
            "TILT=INCLUDE\n1 2 9 0 1 1",
            ["tilt angles must ascend"],
        ),
        ("1 -1 1 3", "0 -1 1 3", ["lamps must be 1"]),
        ("1 -1 1 3", "1 -2 1 3", ["lumens"]),
        (
            "1 -1 1 3",
            "1 -1 0 3",
            [":4: the multiplier of candelas must be above 0"],
        ),
        (
            "1 -1 1 3",
            "1 -1 1 3.5",
            ["vertical angles must be a whole number"],
        ),
        (
            "1 -1 1 3",
            "1 -1 1 1e9",
            ["vertical angles must be a whole number"],
        ),
        ("1 -1 1 3 2", "1 -1 1 999999 999999", ["need more numbers"]),
        ("1 -1 1 3 2", "1 -1 1 1 2", ["more follows"]),
        (
            "1 -1 1 3 2 1",
            "1 -1 1 3 2 4",
            ["type of photometry must be 1, 2 or 3"],
        ),
        ("1 2 0 0 0", "1 3 0 0 0", ["the unit 1 or 2"]),
        (
            "1 1 0\n",
            "0 1 0\n",
            ["factor of the ballast must be above 0"],
        ),
        ("1 1 0\n", "1 1\n", ["x.ies"]),
        (
            "1 1 0\n",
            "one 1 0\n",
            [":5: the factor of the ballast: \"one\" is no number"],
        ),
        (
            "1 1 0\n",
            "1e308 1 0\n",
            [":8: an intensity must be finite"],
        ),
        (
            "0 45 90",
            "0 90 45",
            [":6: the vertical angles must ascend"],
        ),
        ("0 45 90", "0 45 190", ["must lie in 0..=180"]),
        (
            "0 45 90",
            "0 nan 90",
            [":6: a vertical angle: \"nan\" is no number"],
        ),
        ("\n0 90\n", "\n0 100\n", ["from 0 to 90, 180 or 360"]),
        ("\n0 90\n", "\n30 90\n", ["from 0 to 90, 180 or 360"]),
        ("3 2 1\n3 2 1", "3 2 1\n3 2", ["need more numbers"]),
        ("3 2 1\n3 2 1", "3 2 1\n3 2 1 7", [":9: more follows"]),
        (
            "3 2 1\n3 2 1",
            "3 -2 1\n3 2 1",
            [":8: an intensity must be finite and not negative"],
        ),
        ("3 2 1\n3 2 1", "0 0 0\n0 0 0", ["no light"]),
        (
            "3 2 1 2 0 0 0
1 1 0
0 45 90
0 90
3 2 1
3 2 1",
            "1 2 1 2 0 0 0
1 1 0
0
0 90
3
3",
            ["two vertical angles"],
        ),
    ] {
        assert!(IES.contains(from), "{from}");
        let text = IES.replacen(from, to, 1);
        let error = error(&text, table);
        assert!(error.contains("a.toml:4: point light \"p\""), "{error}");
        assert!(error.contains("x.ies"), "{error}");
        for fragment in fragments {
            assert!(
                error.contains(fragment),
                "{to:?}: {fragment:?} is not in {error:?}"
            );
        }
    }
}

#[test]
fn mangled_ies_files_never_panic() {
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("x.ies");
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut below = |n: usize| {
        state ^= state >> 12;
        state ^= state << 25;
        state ^= state >> 27;
        (state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) as usize % n
    };
    let (mut good, mut bad) = (0, 0);
    for _ in 0..2_000 {
        let mut bytes = IES.as_bytes().to_vec();
        for _ in 0..=below(3) {
            let at = 20 + below(bytes.len() - 20);
            match below(3) {
                0 => bytes[at] = b"0123456789.-+e \nTILT=,\xff"[below(23)],
                1 => drop(bytes.remove(at)),
                _ => bytes.insert(at, b"0123456789.- \n"[below(14)]),
            }
        }
        fs::write(&path, &bytes).unwrap();
        match mesolux::scene::ies::Luminaire::read(&path) {
            Ok(luminaire) => {
                good += 1;
                assert!(luminaire.lumens().is_finite());
            }
            Err(error) => {
                bad += 1;
                assert!(!error.to_string().contains('\n'), "{error}");
            }
        }
    }
    assert!(good > 100 && bad > 100, "{good} {bad}");
}

#[test]
fn bad_tables() {
    const P: &str = "[[point_light]]\nname = 'p'\nposition = [0, 2, 0]\n";
    const S: &str = "[[sun]]\nname = 's'\n";
    const SKY: &str = "[sky]\n";
    const BALL: &str = "[[sphere_lamp]]\nposition = [0, 1, 0]\n";
    const DISK: &str = "[[disk_lamp]]\nposition = [0, 1, 0]\n";
    let sun = "sun = { elevation = 20, azimuth = 0 }";
    for (head, keys, fragment) in [
        (P, "", "intensity, candela, lumens or watts is missing"),
        (
            P,
            "candela = 1\nlumens = 2",
            "candela and lumens contradict",
        ),
        (P, "watts = -1", "watts must be finite and not negative"),
        (P, "lumens = inf", "lumens must be finite"),
        (P, "candela = 1e300", "candela must be finite"),
        (
            P,
            "intensity = [1, 1, 1]\nkelvin = 3000",
            "a colour goes with one number",
        ),
        (
            P,
            "candela = 1\nkelvin = 500",
            "kelvin 500 must be in 1000..=15000",
        ),
        (
            P,
            "candela = 1\nkelvin = 5000\ncolor = [1, 1, 1]",
            "color and kelvin contradict",
        ),
        (P, "candela = 1\ncolor = [0, 0, 0]", "not black"),
        (P, "candela = 1\ncolor = [0, -1, 0]", "not negative"),
        (
            P,
            "candela = 1\nspot = { inner = 30, outer = 20 }",
            "inner 30 and outer 20",
        ),
        (P, "candela = 1\nspot = { outer = 200 }", "outer 200"),
        (P, "candela = 1\nspot = { outer = 20, sharp = 1 }", "sharp"),
        (
            P,
            "candela = 1\nspot = { outer = 20 }\nies = 'x.ies'",
            "spot and ies contradict",
        ),
        (
            P,
            "candela = 1\naxis = [0, 1, 0]",
            "axis belongs to a spot or to ies",
        ),
        (
            P,
            "candela = 1\nies = 'none.ies'",
            "none.ies: cannot be read",
        ),
        (
            P,
            "candela = 1\nspot = { outer = 2 }\naxis = [0, 0, 0]",
            "axis must be finite and not zero",
        ),
        (
            P,
            "candela = 1\nspot = { outer = 2 }\ntowards = [0, 2, 0]",
            "towards its place",
        ),
        (
            P,
            "candela = 1\nies = 'x.ies'\naxis = [0, 1, 0]\nzero = [0, 2, 0]",
            "zero is parallel",
        ),
        (
            P,
            "candela = 1\nies = 'x.ies'\nrotation = nan",
            "rotation must be finite",
        ),
        (P, "candela = 1\nbrightness = 1", "brightness"),
        (S, "", "its place is missing"),
        (S, "towards = [0, 1, 0]", "irradiance or lux is missing"),
        (
            S,
            "towards = [0, 0, 0]\nlux = 1",
            "towards must be finite and not zero",
        ),
        (
            S,
            "towards = [0, 1, 0]\nelevation = 3\nlux = 1",
            "contradict",
        ),
        (S, "elevation = 3\nlux = 1", "belong together"),
        (S, "elevation = 93\nazimuth = 0\nlux = 1", "elevation 93"),
        (
            S,
            "latitude = 50\nlongitude = 8\nlux = 1",
            "its place is missing",
        ),
        (
            S,
            "latitude = 50\nlongitude = 8\ntime = 2024-06-21\nlux = 1",
            "offset from UTC",
        ),
        (
            S,
            "latitude = 50\nlongitude = 8\ntime = 2024-06-21T12:00:00\nlux = 1",
            "offset from UTC",
        ),
        (
            S,
            "latitude = 50\nlongitude = 8\ntime = 2024-06-21T00:00:00Z\nlux = 1",
            "below the horizon",
        ),
        (
            S,
            "latitude = 50\nlongitude = 8\ntime = 1024-06-21T12:00:00Z\nlux = 1",
            "the year 1024",
        ),
        (
            S,
            "latitude = 95\nlongitude = 8\ntime = 2024-06-21T12:00:00Z\nlux = 1",
            "latitude 95",
        ),
        (
            S,
            "towards = [0, 1, 0]\nlux = 1\nirradiance = 2",
            "irradiance and lux contradict",
        ),
        (S, "towards = [0, 1, 0]\nlux = 1\nangle = 100", "angle 100"),
        (
            S,
            "towards = [0, 1, 0]\nlux = 1\nup = [0, 0, 0]",
            "up must be finite and not zero",
        ),
        (
            S,
            "elevation = 1\nazimuth = 1\nlux = 1\nnorth = [0, 1, 0]",
            "north is parallel to up",
        ),
        (SKY, "lux = 1", "model or picture is missing"),
        (
            SKY,
            "model = 'cie clear'\nlux = 1",
            "this sky needs its sun",
        ),
        (SKY, "model = 'blue'\nlux = 1", "model \"blue\" is none of"),
        (SKY, "model = 17\nlux = 1", "model 17 must be in 1..=16"),
        (
            SKY,
            "model = 1",
            "radiance, luminance, irradiance or lux is missing",
        ),
        (SKY, "model = 1\nlux = 1\nradiance = 2", "contradict"),
        (
            SKY,
            "model = 1\nlux = 1\nscale = 2",
            "scale does not go with this sky",
        ),
        (
            SKY,
            "model = 1\nlux = -1",
            "lux must be finite and not negative",
        ),
        (SKY, "model = 'perez'\ndirect = 1", "this sky needs its sun"),
        (SKY, "model = 'cie'\nlux = 1", "needs its coefficients"),
        (
            SKY,
            "model = 12\nlux = 1\nsun = { towards = [0, -1, 0] }",
            "90.0° below the horizon",
        ),
        (
            SKY,
            "model = 12\nlux = 1\nsun = { towards = [0, 1, 0], angle = 1 }",
            "angle needs",
        ),
        (
            SKY,
            "model = 12\nlux = 1\nsun = { towards = [0, 1, 0], up = [0, 1, 0] }",
            "the sky's up",
        ),
        (SKY, "picture = 'x.exr'", "x.exr: cannot be decoded"),
        (SKY, "picture = 'x.png'", "a sky's picture is .hdr or .exr"),
        (SKY, "picture = 'none.hdr'", "none.hdr: cannot be read"),
        (
            SKY,
            "picture = 'x.exr'\nmodel = 1",
            "model and picture contradict",
        ),
        (SKY, "model = 1\nlux = 1\nclouds = 3", "clouds"),
        (BALL, "radius = 1", "radiance, lumens or watts is missing"),
        (BALL, "radius = 0\nwatts = 1", "radius 0 must be above 0"),
        (
            BALL,
            "radius = 1\nwatts = 1\nlumens = 1",
            "lumens and watts contradict",
        ),
        (
            BALL,
            "radius = 1\nwatts = 1\nname = ' x'",
            "the name cannot stand",
        ),
        (
            DISK,
            "radius = 1\nwatts = 1\naxis = [0, 0, 0]",
            "axis must be finite and not zero",
        ),
        (DISK, "radius = 1e-30\nwatts = 1e30", "disk lamp 1"),
    ] {
        let error = error(IES, &format!("{head}{keys}\n"));
        assert!(
            error.contains(fragment),
            "{keys:?}: {fragment:?} is not in {error:?}"
        );
        assert!(error.contains("a.toml:"), "{error:?}");
    }
    for keys in [
        "direct = -1\ndiffuse = 100",
        "direct = 1\ndiffuse = 0",
        "diffuse = 100",
    ] {
        let error = error(IES, &format!("{SKY}model = 'perez'\n{keys}\n{sun}\n"));
        assert!(
            error.contains("a.toml:4: sky:") && error.contains("diffuse"),
            "{error}"
        );
    }
    for (first, second) in [(P, P), (S, S)] {
        let keys = "candela = 1\n";
        let keys = if first == S {
            "towards = [0, 1, 0]\nlux = 1\n"
        } else {
            keys
        };
        let error = error(IES, &format!("{first}{keys}{second}{keys}"));
        assert!(error.contains("an earlier one has this name"), "{error}");
    }
    let dark = error(IES, "[[sun]]\ntowards = [0, 1, 0]\nlux = 0\n");
    assert!(dark.contains("no light"), "{dark}");
}
