//! The same light and the same picture by other drivers: SwiftShader, which has subgroups of four,
//! small texel buffers, no geometry shaders and no 64-bit atomics; and lavapipe of Debian 13.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use safetensors::SafeTensors;

/// A driver, and what a program is run with by it alone.
struct Driver {
    name: &'static str,
    manifest: PathBuf,
    /// The libraries of another system that the driver is of, its dynamic loader and C library
    /// among them.
    libraries: Option<PathBuf>,
    /// Largest differences to the other tests' driver, near twice what was measured.
    limits: Limits,
}

/// Of irradiance over its mean, the mean and the root mean square, and HDR-FLIP of a picture.
struct Limits {
    mean: f64,
    rms: f64,
    flip: f64,
}

/// Where Debian's chromium-common puts it; `MESOLUX_SWIFTSHADER` names another manifest.
fn swiftshader() -> Driver {
    let given = std::env::var_os("MESOLUX_SWIFTSHADER").map(PathBuf::from);
    let folders = ["/usr/lib/chromium", "/usr/lib/chromium-browser"];
    let usual = folders.map(|folder| Path::new(folder).join("vk_swiftshader_icd.json"));
    let found = given.into_iter().chain(usual).find(|path| path.is_file());
    Driver {
        name: "SwiftShader",
        manifest: found.expect("SwiftShader: `scripts/setup --window` brings it with Chromium"),
        libraries: None,
        limits: Limits {
            mean: 2e-5,
            rms: 4.2e-4,
            flip: 0.013,
        },
    }
}

/// As `scripts/setup --drivers` unpacks it.
fn lavapipe_of_debian_13() -> Driver {
    let of_user = std::env::var_os("HOME").map_or("/root".into(), PathBuf::from);
    let caches = std::env::var_os("XDG_CACHE_HOME").map(PathBuf::from);
    let caches = caches.unwrap_or_else(|| of_user.join(".cache"));
    let usr = caches.join("mesolux/debian-13/usr");
    Driver {
        name: "Mesa 25",
        manifest: usr.join("share/vulkan/icd.d/lvp_icd.json"),
        libraries: Some(
            one_in(&usr.join("lib"), |name| name.ends_with("-linux-gnu"))
                .expect("lavapipe of Debian 13: `scripts/setup --drivers` brings it"),
        ),
        limits: Limits {
            mean: 2e-8,
            rms: 2e-8,
            flip: 1e-6,
        },
    }
}

/// The file of a folder whose name is like that.
fn one_in(folder: &Path, is_like: impl Fn(&str) -> bool) -> Option<PathBuf> {
    let mut paths = std::fs::read_dir(folder).ok()?.flatten();
    let found = paths.find(|file| is_like(&file.file_name().to_string_lossy()))?;
    Some(found.path())
}

impl Driver {
    fn command(&self) -> Command {
        let program = env!("CARGO_BIN_EXE_mesolux");
        let mut command = match &self.libraries {
            None => Command::new(program),
            Some(libraries) => {
                let loader = one_in(libraries, |name| name.starts_with("ld-linux"));
                let mut command = Command::new(loader.expect("a dynamic loader"));
                command.arg("--library-path").arg(libraries).arg(program);
                let layers = self.manifest.parent().and_then(Path::parent);
                let layers = layers.expect("a folder").join("explicit_layer.d");
                command.env("VK_LAYER_PATH", layers);
                command
            }
        };
        command.env("VK_DRIVER_FILES", &self.manifest);
        // As loaders before 1.3.207 call it.
        command.env("VK_ICD_FILENAMES", &self.manifest);
        command
    }
}

/// The program under the validation layer.
fn command(folder: &Path, driver: Option<&Driver>, arguments: &str) -> Command {
    let mut command = driver.map_or_else(
        || Command::new(env!("CARGO_BIN_EXE_mesolux")),
        Driver::command,
    );
    command
        .args(arguments.split(' '))
        .current_dir(folder)
        .env("MESOLUX_VALIDATE", "true");
    match std::env::var("MESOLUX_TEST_DEVICE") {
        Ok(device) if driver.is_none() && !arguments.starts_with("compare") => {
            command.args(["--device", &device]);
        }
        _ => {}
    }
    command
}

/// What the program says.
fn run(folder: &Path, driver: Option<&Driver>, arguments: &str) -> String {
    let told = told(command(folder, driver, arguments));
    assert!(!told.contains("WARN"), "{told}");
    told
}

/// What the program says, and of what it warns.
fn told(mut command: Command) -> String {
    let done = command.output().expect("the program starts");
    let told = String::from_utf8_lossy(&done.stderr).into_owned();
    // A message of the validation layer ends it with an error.
    assert!(done.status.success(), "{told}");
    told + &String::from_utf8_lossy(&done.stdout)
}

/// Light of a bake, `[element]`.
struct Light {
    area: Vec<f64>,
    /// Summed over the colours.
    irradiance: Vec<f64>,
    /// RGB of each element.
    direct: Vec<f64>,
}

fn light(file: &Path) -> Light {
    let bytes = std::fs::read(file).expect("a bake");
    let tensors = SafeTensors::deserialize(&bytes).expect("tensors");
    let floats = |name: &str| {
        let tensor = tensors.tensor(name).expect("a tensor");
        let words = tensor.data().as_chunks::<4>().0.iter();
        let floats = words.map(|&word| f64::from(f32::from_le_bytes(word)));
        floats.collect::<Vec<f64>>()
    };
    let irradiance = floats("irradiance");
    let sums = irradiance.chunks(3).map(|e| e.iter().sum());
    Light {
        area: floats("area"),
        irradiance: sums.collect(),
        direct: floats("irradiance_direct"),
    }
}

/// Without relief, direct light is the same to the bit.
fn same_light(scene: &str, bake: &str, has_relief: bool) {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let bake = format!("bake {scene} {bake} --no-cache --checkpoint 0 -o");
    let render = "render ours.safetensors --size 160x120 -o";
    run(folder, None, &format!("{bake} ours.safetensors"));
    run(folder, None, &format!("{render} ours.exr"));
    let ours = light(&folder.join("ours.safetensors"));
    for driver in [swiftshader(), lavapipe_of_debian_13()] {
        let told = run(folder, Some(&driver), &format!("{bake} theirs.safetensors"));
        let version = run(folder, Some(&driver), "info");
        assert!((told + &version).contains(driver.name), "{version}");
        let theirs = light(&folder.join("theirs.safetensors"));
        assert_eq!(theirs.irradiance.len(), ours.irradiance.len());
        assert!(has_relief || ours.direct == theirs.direct, "{scene}");
        let (mut sum, mut apart, mut squared, mut area) = (0.0, 0.0, 0.0, 0.0);
        let each = ours.irradiance.iter().zip(&theirs.irradiance);
        for ((ours, theirs), of) in each.zip(&ours.area) {
            sum += of * ours;
            apart += of * (theirs - ours);
            squared += of * (theirs - ours).powi(2);
            area += of;
        }
        let (mean, rms) = (apart / sum, (squared / area).sqrt() / (sum / area));
        run(folder, Some(&driver), &format!("{render} theirs.exr"));
        let compared = run(folder, None, "compare ours.exr theirs.exr");
        let flip = compared.split("HDR-FLIP ").nth(1).expect("a figure");
        let flip = flip.split(' ').next().expect("a figure");
        let flip: f64 = flip.parse().expect("a number");
        println!(
            "{scene} by {}: irradiance {mean:.1e}, rms {rms:.1e} apart; picture HDR-FLIP {flip}",
            driver.name
        );
        let limits = &driver.limits;
        assert!(mean.abs() <= limits.mean && rms <= limits.rms && flip <= limits.flip);
    }
}

#[test]
#[ignore = "long: runs by scripts/test --all"]
fn other_drivers_give_the_same_light() {
    same_light("cornell", "--patches 3000 --source-area 0.01", false);
}

#[test]
#[ignore = "long: runs by scripts/test --all"]
fn other_drivers_give_the_same_light_on_relief() {
    same_light("cornell-relief", "--patches 8000 --source-area 0.05", true);
}

/// Rows of one driver are nothing to go on from for another.
#[test]
#[ignore = "long: runs by scripts/test --all"]
fn a_checkpoint_of_another_driver_is_not_used() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let bake = "bake cornell --patches 4000 --hemicube 64 --no-cache";
    let killed = || {
        let begun = format!("{bake} --checkpoint 0.001 -o killed.safetensors");
        let mut begun = command(folder, None, &begun);
        let begun = begun.stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        let mut begun = begun.expect("the program starts");
        while !folder.join("killed.checkpoint/0000.rows").is_file() {
            let ended = begun.try_wait().expect("it runs");
            assert!(ended.is_none(), "it ends before its first checkpoint");
            std::thread::sleep(Duration::from_millis(5));
        }
        let _ = begun.kill();
        let _ = begun.wait();
    };
    let goes_on = |driver: Option<&Driver>| {
        let same = format!("{bake} -o killed.safetensors");
        let told = told(command(folder, driver, &same));
        assert!(!folder.join("killed.checkpoint").exists());
        told
    };

    killed();
    let ours = goes_on(None);
    assert!(ours.contains("goes on from killed.checkpoint"), "{ours}");
    killed();
    let swiftshader = swiftshader();
    let theirs = goes_on(Some(&swiftshader));
    assert!(theirs.contains("another device"), "{theirs}");
    assert!(!theirs.contains("goes on from"), "{theirs}");
    let anew = format!("{bake} --checkpoint 0 -o anew.safetensors");
    run(folder, Some(&swiftshader), &anew);
    let lights =
        ["killed", "anew"].map(|name| light(&folder.join(name).with_extension("safetensors")));
    assert!(lights[0].irradiance == lights[1].irradiance);
}
