//! Vulkan devices, for `mesolux info`.

use serde::Serialize;

use mesolux::error::{Error, Result};
use mesolux::vk::{Candidate, Instance};

#[derive(Serialize)]
struct Row<'a> {
    index: usize,
    name: &'a str,
    kind: &'a str,
    driver: &'a str,
    vulkan: String,
    /// Empty when the device can run Mesolux.
    missing: &'a [&'static str],
    estimators: Vec<&'static str>,
    heap_bytes: u64,
    max_storage_buffer_bytes: u64,
    max_image_side: u32,
    subgroup_size: u32,
}

impl<'a> Row<'a> {
    fn new(c: &'a Candidate) -> Self {
        let mut estimators = Vec::new();
        if c.missing.is_empty() {
            estimators.push("receiver");
            if c.int64_atomics {
                estimators.push("pixel");
            }
        }
        Self {
            index: c.index,
            name: &c.name,
            kind: c.kind,
            driver: &c.driver,
            vulkan: format!("{}.{}.{}", c.api.0, c.api.1, c.api.2),
            missing: &c.missing,
            estimators,
            heap_bytes: c.heap_bytes,
            max_storage_buffer_bytes: c.max_storage_buffer_range,
            max_image_side: c.max_image_side,
            subgroup_size: c.subgroup_size,
        }
    }
}

/// Lists them with their limits and what each can run.
pub fn run(json: bool) -> Result<()> {
    let candidates = Instance::new(false)?.candidates()?;
    let rows: Vec<_> = candidates.iter().map(Row::new).collect();
    if json {
        let text = serde_json::to_string(&rows).map_err(|e| Error::Usage(e.to_string()))?;
        mesolux::say!("{text}");
        return Ok(());
    }
    if rows.is_empty() {
        return Err(Error::Device(
            "no Vulkan device; on Debian install mesa-vulkan-drivers for a software one".into(),
        ));
    }
    for row in rows {
        mesolux::say!(
            "{}: {} ({}, {}, Vulkan {})",
            row.index,
            row.name,
            row.kind,
            row.driver.trim(),
            row.vulkan
        );
        mesolux::say!(
            "   memory {} MiB, storage buffers to {} MiB, images to {}², subgroups of {}",
            row.heap_bytes >> 20,
            row.max_storage_buffer_bytes >> 20,
            row.max_image_side,
            row.subgroup_size
        );
        if row.missing.is_empty() {
            mesolux::say!("   runs bake ({}) and render", row.estimators.join(", "));
        } else {
            mesolux::say!("   cannot run Mesolux: lacks {}", row.missing.join(", "));
        }
    }
    Ok(())
}
