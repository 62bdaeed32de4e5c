//! What is inside a scene or a bake, as text.

use serde_json::Value;

use super::info::{Baked, Inside};
use mesolux::scene::contents::{Contents, ElementCounts, LightContents, MaterialContents};

/// Meshes and materials that are listed, the largest ones.
const MOST_ROWS: usize = 40;

pub fn print(inside: &Inside) {
    if let Some(baked) = &inside.bake {
        let origin = &baked.origin;
        mesolux::say!("{}: a bake by {}", inside.input, shown(&baked.program));
        mesolux::say!(
            "  of {}, SHA-256 {}",
            shown(&origin.scene),
            shown(&origin.hash)
        );
    } else {
        mesolux::say!("{}: a scene", inside.input);
    }
    match (&inside.contents, &inside.elements, &inside.bake) {
        (Some(contents), Some(elements), _) => print_contents(contents, elements),
        (.., Some(baked)) => mesolux::say!(
            "  {} elements; a bake of an earlier program, which kept no names",
            baked.elements
        ),
        _ => {}
    }
    if let Some(baked) = &inside.bake {
        print_baked(baked);
    }
}

fn print_contents(contents: &Contents, elements: &ElementCounts) {
    let (count, triangles) = (elements.elements, contents.triangles);
    let cut = match count == triangles {
        true => String::new(),
        false => format!(", cut to {count} elements"),
    };
    let left_out = match contents.left_out {
        0 => String::new(),
        n => format!("; {n} triangles were left out"),
    };
    mesolux::say!(
        "  {} vertices, {triangles} triangles{cut}{left_out}",
        contents.vertices
    );
    let [low, high] = contents.bounds.map(triple);
    mesolux::say!(
        "  bounds ({low}) to ({high}), area {}",
        short(contents.area)
    );
    let meshes = contents.meshes.iter().zip(&elements.of_meshes);
    let rows = meshes.map(|(mesh, &elements)| Row {
        name: &mesh.name,
        triangles: mesh.ranges.iter().map(|&[_, n]| n as usize).sum(),
        elements,
        area: mesh.area,
        more: String::new(),
    });
    print_rows("meshes", rows.collect());
    let materials = contents.materials.iter().zip(&elements.of_materials);
    let rows = materials.map(|(material, &elements)| Row {
        name: &material.name,
        triangles: material.triangles,
        elements,
        area: material.area,
        more: light_and_maps(material),
    });
    print_rows("materials", rows.collect());
    for light in &contents.lights {
        mesolux::say!("  light \"{}\": {}", shown(&light.name), light_text(light));
    }
    for camera in &contents.cameras {
        mesolux::say!(
            "  camera \"{}\": from ({}) to ({}), {}°",
            shown(&camera.name),
            triple(camera.position),
            triple(camera.look_at),
            short(camera.fov)
        );
    }
    for note in &contents.notes {
        mesolux::say!("  note: {}", shown(note));
    }
    for warning in &contents.warnings {
        mesolux::say!("  warning: {}", shown(warning));
    }
}

/// A mesh or a material.
struct Row<'a> {
    name: &'a str,
    triangles: usize,
    elements: usize,
    area: f64,
    more: String,
}

fn print_rows(what: &str, mut rows: Vec<Row>) {
    let count = rows.len();
    if count > MOST_ROWS {
        rows.sort_by(|a, b| b.area.total_cmp(&a.area));
        rows.truncate(MOST_ROWS);
    }
    let names: Vec<String> = rows.iter().map(|row| shown(row.name)).collect();
    let widest = names.iter().map(|name| name.chars().count()).max();
    let width = widest.unwrap_or(0).clamp(16, 40);
    let head = format!("{what} ({count})");
    mesolux::say!("  {head:<width$}  triangles  elements        area");
    for (row, name) in rows.iter().zip(names) {
        let area = short(row.area);
        let text = format!(
            "    {name:<width$}{:>9} {:>9}  {area:>10}  {}",
            row.triangles, row.elements, row.more
        );
        mesolux::say!("{}", text.trim_end());
    }
    if count > MOST_ROWS {
        mesolux::say!("    and {} smaller ones", count - MOST_ROWS);
    }
}

fn light_and_maps(material: &MaterialContents) -> String {
    let [kd, ke] = [material.kd, material.ke].map(|rgb| triple(rgb.map(f64::from)));
    let mut words = vec![format!("kd {kd}")];
    if material.ke.iter().any(|&c| c > 0.0) {
        words.push(format!("ke {ke}"));
    }
    if let Some(range) = material.relief {
        words.push(format!("relief {}", short(range)));
    }
    for (key, file) in &material.maps {
        words.push(format!("{key} {}", shown(file)));
    }
    words.join(", ")
}

fn light_text(light: &LightContents) -> String {
    let strength = triple(light.strength.map(f64::from));
    let place = light.place.map(triple).unwrap_or_default();
    match light.kind.as_str() {
        "sun" => format!("sun towards ({place}), {strength} W·m⁻²"),
        "sky" => format!("sky, times {strength} W·m⁻²·sr⁻¹"),
        kind => format!("{} at ({place}), {strength} W·sr⁻¹", shown(kind)),
    }
}

fn print_baked(baked: &Baked) {
    let report = &baked.report;
    let settings: Vec<String> = (baked.settings.as_object().into_iter().flatten())
        .filter(|(_, value)| !value.is_null())
        .map(|(key, value)| format!("{} {}", shown(key), plain(value)))
        .collect();
    mesolux::say!("  settings: {}", settings.join(", "));
    let number = |key: &str| report[key].as_f64();
    let count = |key: &str| report[key].as_u64().unwrap_or(0);
    mesolux::say!(
        "  solved on {}: {} sources, {} hemicubes of {}, {} s; stopped by {}",
        plain(&report["device"]),
        count("sources"),
        count("hemicubes"),
        count("hemicube"),
        short(report["seconds"]["solve_wall"].as_f64().unwrap_or(0.0)),
        plain(&report["stop"])
    );
    let percent = |share: Option<f64>| match share {
        Some(share) => format!("{} %", decimal(100.0 * share)),
        None => "unknown".into(),
    };
    mesolux::say!(
        "  error bound {} of the emitted power, unshot {}",
        percent(number("error_bound")),
        percent(number("unshot_share"))
    );
    let cutting = &report["discretisation"];
    if let Some(rms) = cutting["rms"].as_f64() {
        mesolux::say!(
            "  error of cutting into elements: {} rms of the mean light",
            percent(Some(rms))
        );
        for surface in cutting["surfaces"].as_array().into_iter().flatten() {
            let rms = surface["rms"].as_f64();
            mesolux::say!("    {}: {}", plain(&surface["name"]), percent(rms));
        }
    }
    if let Some(relief) = report["relief"].as_object() {
        mesolux::say!(
            "  {} elements with relief, {} directions",
            plain(&relief.get("elements").cloned().unwrap_or_default()),
            plain(&relief.get("directions").cloned().unwrap_or_default())
        );
    }
}

/// A value without quotes.
fn plain(value: &Value) -> String {
    match value {
        Value::String(text) => shown(text),
        Value::Null => "unknown".into(),
        other => other.to_string(),
    }
}

/// A text of a file, without what would move the cursor of a terminal.
fn shown(text: &str) -> String {
    let of = |c: char| match c.is_control() {
        true => c.escape_debug().to_string(),
        false => c.to_string(),
    };
    text.chars().map(of).collect()
}

/// Four digits or so.
fn short(number: f64) -> String {
    if number != 0.0 && !(1e-3..1e6).contains(&number.abs()) {
        return format!("{number:.3e}");
    }
    decimal(number)
}

fn decimal(number: f64) -> String {
    let text = format!("{number:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

fn triple(numbers: [f64; 3]) -> String {
    numbers.map(short).join(" ")
}
