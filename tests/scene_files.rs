//! OBJ and scene files: what they mean, and that a scene written out reads back the same.

use std::fs;
use std::path::Path;

use glam::DVec3;
use mesolux::error::Result;
use mesolux::scene::{LoadOptions, Scene, load, write_scene};

fn read(path: &Path) -> Result<Scene> {
    load(path.to_str().unwrap(), &LoadOptions::default())
}

/// Writes files into a new folder and loads the first.
fn load_files(files: &[(&str, &str)]) -> (tempfile::TempDir, Result<Scene>) {
    let dir = tempfile::tempdir().unwrap();
    for (name, text) in files {
        fs::write(dir.path().join(name), text).unwrap();
    }
    let scene = read(&dir.path().join(files[0].0));
    (dir, scene)
}

fn good(files: &[(&str, &str)]) -> Scene {
    load_files(files).1.unwrap()
}

const LAMP: &str = "newmtl lamp\nKe 1 2 3\nKd 0.1 0.2 0.3\nKa 1\nTf 9\nnewmtl dull\nillum x\n";
const SQUARE: &str =
    "mtllib lamp.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl lamp\nf 1 2 3 4\n";

fn same(a: &Scene, b: &Scene) {
    assert_eq!(a.name, b.name);
    assert_eq!(a.vertices, b.vertices);
    assert_eq!(a.triangles, b.triangles);
    assert_eq!(a.lights.points, b.lights.points);
    assert_eq!(a.cameras, b.cameras);
    assert_eq!(a.materials.len(), b.materials.len());
    for (a, b) in a.materials.iter().zip(&b.materials) {
        assert_eq!((&a.name, a.kd, a.ke), (&b.name, b.kd, b.ke));
        let texels = |m: &mesolux::scene::Material| m.map_kd.as_ref().map(|t| t.texels.clone());
        assert_eq!(texels(a), texels(b));
    }
    assert_eq!(a.hash(), b.hash());
}

#[test]
fn the_cornell_box_reads_back_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let options = LoadOptions {
        patches: Some(5_001),
        ..LoadOptions::default()
    };
    let scene = load("cornell", &options).unwrap();
    let path = write_scene(&scene, &dir.path().join("new/folder")).unwrap();
    let again = read(&path).unwrap();
    same(&scene, &again);
    assert!(again.notes.is_empty(), "{:?}", again.notes);
    // Writing over what is there, also from itself.
    write_scene(&again, path.parent().unwrap()).unwrap();
    same(&scene, &read(&path).unwrap());
    let left: Vec<_> = fs::read_dir(path.parent().unwrap()).unwrap().collect();
    assert_eq!(left.len(), 3, "no temporary file stays: {left:?}");
}

#[test]
fn awkward_numbers_textures_and_names_read_back_the_same() {
    let picture =
        image::ImageBuffer::from_fn(3, 2, |x, y| image::Rgb([x as u8 * 90, y as u8 * 200, 7]));
    let dir = tempfile::tempdir().unwrap();
    image::DynamicImage::from(picture)
        .save(dir.path().join("my picture.png"))
        .unwrap();
    let files = [
        (
            "a.toml",
            "name = \"a \\\"b\\\"\"\n[[mesh]]\nfile = 'a.obj'\nrotate = [12.3, -45.6, 78.9]\nscale = [1e-3, -0.1, 7]\ntranslate = [1e6, 1e-7, -3]\n[[mesh]]\nfile = 'a.obj'\nmaterial = 'new one'\n[material.'new one']\nkd = [0.1, 0.7, 0.333]\nmap_kd = 'my picture.png'\n[[point_light]]\nposition = [0.1, 2, 1e-9]\nintensity = [0.1, 1e-20, 3e9]\n[[camera]]\nname = 'é'\nposition = [0.1, 0.2, 0.3]\nlook_at = [1, 2, 3]\nfov = 33.3\n",
        ),
        (
            "a.obj",
            "mtllib a.mtl\nv 0.1 0.2 0.3\nv 1e-17 3.3333333333333335 2\nv 123456.78901234567 1e-5 -0\nv 1 2 3\nvt 0.1 0.7\nvt 1e-9 0.3333333\nvt 12345.678 -2\nusemtl steel # blue\nf 1/1 2/2 3/3\nusemtl plain\nf 2 3 4\n",
        ),
        (
            "a.mtl",
            "newmtl steel # blue\nKd 0.1 0.2 0.3\nmap_Kd my picture.png\nnewmtl plain\nKd 0.7 0.33333334 1 # comment\nnewmtl unused\nKd 1 1 1\n",
        ),
    ];
    for (name, text) in files {
        fs::write(dir.path().join(name), text).unwrap();
    }
    let scene = read(&dir.path().join("a.toml")).unwrap();
    assert_eq!(scene.triangles.len(), 4);
    assert_eq!(scene.materials[0].name, "steel # blue");
    assert!(
        scene
            .materials
            .iter()
            .filter(|m| m.map_kd.is_some())
            .count()
            == 2
    );
    let out = tempfile::tempdir().unwrap();
    same(
        &scene,
        &read(&write_scene(&scene, out.path()).unwrap()).unwrap(),
    );
}

#[test]
fn an_obj_means_what_it_says() {
    let scene = good(&[("a.obj", SQUARE), ("lamp.mtl", LAMP)]);
    assert_eq!(scene.name, "a");
    assert_eq!(scene.vertices.len(), 4);
    // The fan of the polygon: 1 2 3, 1 3 4.
    assert_eq!(scene.triangles[0].vertices, [0, 1, 2]);
    assert_eq!(scene.triangles[1].vertices, [0, 2, 3]);
    assert_eq!(scene.triangles[1].uv, [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    let lamp = &scene.materials[0];
    assert_eq!((lamp.kd, lamp.ke), ([0.1, 0.2, 0.3], [1.0, 2.0, 3.0]));
    assert_eq!(scene.materials[1].kd, [0.5; 3]);
    assert_eq!(scene.cameras[0].name, "default");
    for said in ["material \"dull\" has no Kd", "box projection", "no camera"] {
        assert!(
            scene.notes.iter().any(|n| n.contains(said)),
            "{said}: {:?}",
            scene.notes
        );
    }
}

#[test]
fn the_odd_corners_of_the_format_are_read() {
    let text = "\u{feff}# comment\nmtllib lamp.mtl\no thing\nv 0 0 0 1 0 0\nv 2 0 0 2.0\r\nv 1 1 0\nv 1 1 0 # the same\n\
        vn 0 0 1\nvt 0 0\nvt 1 0 0\nvt 1 1\nl 1 2 3\np 1\nl 1/1 2/2 3/3 1/1\nusemtl lamp\n\
        f -4//-1 -3//1 -2//1\ng other\nf 1/1 4/3 \\\n2/2\nf 1 2 2\n";
    let scene = good(&[("a.obj", text), ("lamp.mtl", LAMP)]);
    assert_eq!(scene.triangles.len(), 2);
    assert_eq!(scene.dropped_degenerate, 1);
    assert_eq!(
        scene.vertices,
        [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0)]
    );
    assert_eq!(scene.triangles[0].vertices, [0, 1, 2]);
    assert_eq!(scene.triangles[1].vertices, [0, 2, 1]);
    assert_eq!(scene.triangles[1].uv, [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0]]);
}

#[test]
fn offsets_and_extents_do_not_eat_the_shape() {
    let far = "mtllib lamp.mtl\nusemtl lamp\nv 1000000.001 0 0\nv 1000000.002 0 0\nv 1000000.001 0.001 0\nf 1 2 3\n";
    let scene = good(&[("a.obj", far), ("lamp.mtl", LAMP)]);
    assert_eq!(scene.vertices[0].x, 1_000_000.001);
    assert!(
        scene.triangles[0]
            .uv
            .iter()
            .flatten()
            .all(|c| (0.0..1.0).contains(c))
    );
    for size in ["1e-12", "1e12"] {
        let text =
            format!("mtllib lamp.mtl\nusemtl lamp\nv 0 0 0\nv {size} 0 0\nv 0 {size} 0\nf 1 2 3\n");
        assert_eq!(
            good(&[("a.obj", &text), ("lamp.mtl", LAMP)])
                .triangles
                .len(),
            1
        );
    }
}

#[test]
fn slivers_stay_and_triangles_without_area_go() {
    let text =
        |height: &str| format!("{SQUARE}v 0 {height} 0\nv 0.5 0 0\nf 1 2 5\nf 1 2 2\nf 1 2 6\n");
    for (height, kept) in [("1e-6", 3), ("1e-9", 3), ("1e-11", 2), ("0", 2)] {
        let scene = good(&[("a.obj", &text(height)), ("lamp.mtl", LAMP)]);
        assert_eq!(scene.triangles.len(), kept, "{height}");
        assert_eq!(scene.dropped_degenerate, 5 - kept);
    }
}

fn front(scene: &Scene) -> DVec3 {
    let [a, b, c] = scene.corners(&scene.triangles[0]);
    (b - a).cross(c - a).normalize()
}

#[test]
fn placements_are_scale_then_rotate_then_translate() {
    let placed = |table: &str| {
        let toml = format!("[[mesh]]\nfile = 'b.obj'\n{table}\n");
        good(&[("a.toml", &toml), ("b.obj", SQUARE), ("lamp.mtl", LAMP)])
    };
    let scene = placed("scale = [2, 3, 4]\nrotate = [90, 0, 90]\ntranslate = [10, 0, 0]");
    // (1,1,0) → (2,3,0) → about x (2,0,3) → about z (0,2,3) → (10,2,3).
    assert_eq!(scene.vertices[2], DVec3::new(10.0, 2.0, 3.0));
    // z → −y about x → x about z.
    assert_eq!(front(&scene), DVec3::X);
    assert_eq!(front(&placed("scale = 2")), DVec3::Z);
    assert_eq!(front(&placed("reverse = true")), DVec3::NEG_Z);
    // A mirror in the plane of the square leaves its front where it was; one across it turns it.
    assert_eq!(front(&placed("scale = [-1, 1, 1]")), DVec3::Z);
    assert_eq!(front(&placed("scale = [1, 1, -1]")), DVec3::NEG_Z);
    assert_eq!(
        front(&placed("scale = [-1, 1, 1]\nreverse = true")),
        DVec3::NEG_Z
    );
}

#[test]
fn materials_are_changed_shared_and_told_apart() {
    let toml = "[[mesh]]\nfile = 'b.obj'\n[[mesh]]\nfile = 'b.obj'\ntranslate = [0, 0, 1]\nmaterial = 'steel'\n[[mesh]]\nfile = 'c.obj'\ntranslate = [0, 0, 2]\n[material.steel]\nkd = [1, 1, 1]\n";
    let other = ("c.obj", &*SQUARE.replace("lamp.mtl", "c.mtl"));
    let files = [
        ("a.toml", toml),
        ("b.obj", SQUARE),
        ("lamp.mtl", LAMP),
        other,
        ("c.mtl", "newmtl lamp\nKd 1 0 0\n"),
    ];
    let scene = good(&files);
    let name = |t: usize| {
        scene.materials[scene.triangles[t].material as usize]
            .name
            .as_str()
    };
    assert_eq!([name(0), name(2), name(4)], ["lamp", "steel", "lamp.2"]);
    assert!(scene.notes.iter().any(|n| n.contains("lamp.2")));

    let changed = format!("{toml}[material.lamp]\nke = [5, 5, 5]\n");
    let scene = good(&[
        ("a.toml", &*changed),
        files[1],
        files[2],
        files[3],
        files[4],
    ]);
    assert!(
        scene
            .materials
            .iter()
            .filter(|m| m.name.starts_with("lamp"))
            .all(|m| m.ke == [5.0; 3])
    );
}

#[test]
fn without_a_material_file_surfaces_are_grey_and_lights_may_come_from_the_scene_file() {
    let plain = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nusemtl red\nf 1 3 2\n";
    let toml =
        "[[mesh]]\nfile = 'b.obj'\n[[point_light]]\nposition = [0, 0, 1]\nintensity = [1, 1, 1]\n";
    let scene = good(&[("a.toml", toml), ("b.obj", plain)]);
    let names: Vec<_> = scene
        .triangles
        .iter()
        .map(|t| &scene.materials[t.material as usize].name)
        .collect();
    assert_eq!(names, ["default", "red"]);
    assert!(scene.materials.iter().all(|m| m.kd == [0.5; 3]));
    assert_eq!(scene.lights.points[0].name, "light 1");
}

#[test]
fn the_hash_follows_content_alone() {
    let base = good(&[("a.obj", SQUARE), ("lamp.mtl", LAMP)]);
    let mut renamed = base.clone();
    renamed.name = "other".into();
    renamed.path = None;
    renamed.cameras.clear();
    renamed.materials[0].name = "x".into();
    assert_eq!(base.hash(), renamed.hash());
    let changes: [fn(&mut Scene); 6] = [
        |s| s.vertices[0].x += 1e-12,
        |s| s.triangles[0].uv[2][1] += 0.1,
        |s| s.triangles[0].material = 1,
        |s| s.materials[1].kd[2] = 0.6,
        |s| s.materials[0].ke[0] = 1.1,
        |s| s.triangles.swap(0, 1),
    ];
    for (index, change) in changes.iter().enumerate() {
        let mut changed = base.clone();
        change(&mut changed);
        assert_ne!(base.hash(), changed.hash(), "change {index}");
    }
}

#[test]
fn a_write_that_fails_leaves_what_was_there() {
    use mesolux::atomic_file::write_atomically;
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("out");
    fs::write(&path, "old").unwrap();
    let error = write_atomically(&path, |out| {
        out.write_all(b"half")?;
        Err(std::io::Error::other("disk full"))
    });
    let error = error.unwrap_err().to_string();
    assert!(
        error.contains("out: cannot be written: disk full"),
        "{error}"
    );
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");
    write_atomically(&path, |out| out.write_all(b"new")).unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "new");
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    write_atomically(dir.path(), |_| Ok(())).unwrap_err();
    write_atomically(&dir.path().join("no/folder"), |_| Ok(())).unwrap_err();
}

/// A link stays, and what it leads to is written, there or not; a name need not be UTF-8; what a
/// killed program left an hour ago is cleared away; a pipe that nothing reads is an error.
#[cfg(unix)]
#[test]
fn links_pipes_and_strange_names_are_written() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    use std::os::unix::fs::symlink;
    use std::time::{Duration, SystemTime};

    use mesolux::atomic_file::{with_ending, write_atomically};

    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    fs::create_dir(at("there")).unwrap();
    symlink("there/file", at("link")).unwrap();
    for text in [&b"first"[..], b"second"] {
        write_atomically(&at("link"), |out| out.write_all(text)).unwrap();
        assert_eq!(fs::read(at("there/file")).unwrap(), text);
        assert!(fs::symlink_metadata(at("link")).unwrap().is_symlink());
    }

    let strange = dir.path().join(OsStr::from_bytes(b"\xff.exr"));
    let beside = with_ending(&strange, "-0001.png");
    assert_eq!(
        beside.file_name(),
        Some(OsStr::from_bytes(b"\xff-0001.png"))
    );

    let other = tempfile::tempdir().unwrap();
    let (old, new) = (".mesolux-0123456789abcdef", ".mesolux-fedcba9876543210");
    for name in [old, new] {
        fs::write(other.path().join(name), "left").unwrap();
    }
    let hours_ago = SystemTime::now() - Duration::from_secs(7200);
    let file = fs::File::options()
        .append(true)
        .open(other.path().join(old))
        .unwrap();
    file.set_modified(hours_ago).unwrap();
    write_atomically(&other.path().join("out"), |_| Ok(())).unwrap();
    assert!(!other.path().join(old).exists());
    assert!(other.path().join(new).exists());

    let pipe = at("pipe");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.unwrap().success());
    let error = write_atomically(&pipe, |_| Ok(())).unwrap_err().to_string();
    assert!(
        error.ends_with("pipe: cannot be written: nothing reads this pipe"),
        "{error}"
    );
    let reader = std::thread::spawn({
        let pipe = pipe.clone();
        move || fs::read(pipe).unwrap()
    });
    let write = || write_atomically(&pipe, |out| out.write_all(b"read"));
    while write().is_err() {
        std::thread::sleep(Duration::from_millis(10));
    }
    assert_eq!(reader.join().unwrap(), b"read");
}
