//! The same light and the same picture by another driver: SwiftShader, which has subgroups of four,
//! no geometry shaders and no 64-bit atomics.

use std::path::{Path, PathBuf};
use std::process::Command;

use safetensors::SafeTensors;

/// Where Debian's chromium-common puts it; `MESOLUX_SWIFTSHADER` names another manifest.
fn swiftshader() -> PathBuf {
    let given = std::env::var_os("MESOLUX_SWIFTSHADER").map(PathBuf::from);
    let folders = ["/usr/lib/chromium", "/usr/lib/chromium-browser"];
    let usual = folders.map(|folder| Path::new(folder).join("vk_swiftshader_icd.json"));
    let found = given.into_iter().chain(usual).find(|path| path.is_file());
    found.expect("SwiftShader: `scripts/setup --window` brings it with Chromium")
}

/// Runs the program under the validation layer, by the only driver of a manifest.
fn run(folder: &Path, manifest: Option<&Path>, arguments: &str) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mesolux"));
    command
        .args(arguments.split(' '))
        .current_dir(folder)
        .env("MESOLUX_VALIDATE", "true");
    match (manifest, std::env::var("MESOLUX_TEST_DEVICE")) {
        (Some(manifest), _) => {
            command.env("VK_DRIVER_FILES", manifest);
            // As loaders before 1.3.207 call it.
            command.env("VK_ICD_FILENAMES", manifest);
        }
        (None, Ok(device)) if !arguments.starts_with("compare") => {
            command.args(["--device", &device]);
        }
        _ => {}
    }
    let done = command.output().expect("the program starts");
    let told = String::from_utf8_lossy(&done.stderr).into_owned();
    // A message of the validation layer ends it with an error.
    assert!(done.status.success() && !told.contains("WARN"), "{told}");
    told + &String::from_utf8_lossy(&done.stdout)
}

#[test]
#[ignore = "long: runs by scripts/test --all"]
fn swiftshader_gives_the_same_light() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let manifest = swiftshader();
    let bake = "bake cornell --patches 3000 --source-area 0.01 --no-cache --checkpoint 0 -o";
    run(folder, None, &format!("{bake} ours.safetensors"));
    let told = run(
        folder,
        Some(&manifest),
        &format!("{bake} theirs.safetensors"),
    );
    assert!(told.contains("SwiftShader"), "{told}");
    let floats = |file: &str, name: &str| {
        let bytes = std::fs::read(folder.join(file)).expect("a bake");
        let tensors = SafeTensors::deserialize(&bytes).expect("tensors");
        let tensor = tensors.tensor(name).expect("a tensor");
        let words = tensor.data().as_chunks::<4>().0.iter();
        words
            .map(|&word| f64::from(f32::from_le_bytes(word)))
            .collect::<Vec<f64>>()
    };
    let both = |name: &str| ["ours", "theirs"].map(|of| floats(&format!("{of}.safetensors"), name));
    let [direct, their_direct] = both("irradiance_direct");
    assert!(direct == their_direct);
    let ([ours, theirs], [areas, _]) = (both("irradiance"), both("area"));
    let (mut sum, mut apart, mut squared, mut area) = (0.0, 0.0, 0.0, 0.0);
    for ((ours, theirs), of) in ours.chunks(3).zip(theirs.chunks(3)).zip(&areas) {
        let [ours, theirs] = [ours, theirs].map(|e| e.iter().sum::<f64>());
        sum += of * ours;
        apart += of * (theirs - ours);
        squared += of * (theirs - ours).powi(2);
        area += of;
    }
    let (mean, rms) = (apart / sum, (squared / area).sqrt() / (sum / area));
    println!("irradiance: mean {mean:.1e}, rms {rms:.1e} apart");
    assert!(mean.abs() < 2e-5 && rms < 4.2e-4);

    let render = "render ours.safetensors --size 160x120 -o";
    run(folder, None, &format!("{render} ours.exr"));
    run(folder, Some(&manifest), &format!("{render} theirs.exr"));
    let compared = run(folder, None, "compare ours.exr theirs.exr");
    let flip = compared.split("HDR-FLIP ").nth(1).expect("a figure");
    let flip: f64 = flip
        .split(' ')
        .next()
        .expect("a figure")
        .parse()
        .expect("a number");
    println!("picture: HDR-FLIP {flip}");
    assert!(flip < 0.013);
}
