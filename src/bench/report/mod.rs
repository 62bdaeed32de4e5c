//! `mesolux bench report`: what GPU precompute costs on each device of a machine, as a page, as
//! JSON and as Markdown.

mod charts;
mod measures;
mod model;
mod page;
mod tables;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

pub use model::{Form, Measure, OfDevice, Plan, Provenance, Report, SCHEMA, Section};

use super::table1;
use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::vk::Device;
use measures::{Measuring, cornell};

/// What is measured and where it is written.
pub struct Options {
    pub form: Form,
    /// In place of what the form says.
    pub plan: Plan,
    /// Folder that keeps the visibility of reliefs for the frames; bakes compute it again.
    pub cache: Option<PathBuf>,
    /// Another report, whose figures are set beside.
    pub against: Option<Report>,
}

/// Measures on every device, and writes `report.json`, `report.html` and `report.md` into `folder`
/// after each of them. Where `go_on` says no, what was measured by then is kept. A device that
/// fails is reported, and the next one is measured.
pub fn run(
    devices: &[Arc<Device>],
    options: &Options,
    folder: &Path,
    go_on: impl Fn() -> bool,
) -> Result<Report> {
    std::fs::create_dir_all(folder).map_err(|e| Error::write(folder, e))?;
    let start = Instant::now();
    let mut report = Report {
        schema: SCHEMA.to_owned(),
        provenance: Provenance::here(options),
        devices: Vec::new(),
    };
    tracing::info!("tracing paths for the errors");
    let Some((scene, truth)) = cornell(&options.plan, &go_on)? else {
        return Ok(report);
    };
    for device in devices {
        let candidate = device.candidate();
        let (major, minor, patch) = candidate.api;
        let mut found = OfDevice {
            name: device.name().to_owned(),
            driver: candidate.driver.trim().to_owned(),
            vulkan: format!("{major}.{minor}.{patch}"),
            measures: Vec::new(),
            failed: None,
        };
        let mut measuring = Measuring {
            device: Arc::clone(device),
            plan: options.plan,
            go_on: &go_on,
            found: &mut found,
        };
        let measured = measuring.presets(&scene, &truth).and_then(|mut whole| {
            for (name, ..) in table1::SCENES {
                whole = whole && measuring.table1(name, options.cache.as_deref())?;
            }
            Ok(whole)
        });
        match measured {
            Ok(whole) => report.provenance.whole = whole,
            Err(error) => {
                tracing::warn!("{}: {error}", device.name());
                found.failed = Some(error.to_string());
            }
        }
        report.devices.push(found);
        report.provenance.seconds = start.elapsed().as_secs_f64();
        write(&report, options.against.as_ref(), folder)?;
        if !go_on() {
            break;
        }
    }
    Ok(report)
}

/// Writes a report in its three forms, beside another one if given.
pub fn write(report: &Report, against: Option<&Report>, folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::write(folder, e))?;
    report.save(&folder.join("report.json"))?;
    let path = folder.join("report.html");
    let html = page::html(report, against)
        .map_err(|e| Error::file(&path, format!("cannot be drawn: {e}")))?;
    write_atomically(&path, |out| out.write_all(html.as_bytes()))?;
    let markdown = page::markdown(report, against);
    write_atomically(&folder.join("report.md"), |out| {
        out.write_all(markdown.as_bytes())
    })
}

impl Provenance {
    fn here(options: &Options) -> Self {
        let threads = std::thread::available_parallelism();
        Self {
            program: format!("mesolux {}", env!("CARGO_PKG_VERSION")),
            commit: env!("MESOLUX_COMMIT").to_owned(),
            date: jiff::Timestamp::now()
                .strftime("%Y-%m-%dT%H:%M:%SZ")
                .to_string(),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            threads: threads.map_or(1, usize::from),
            form: options.form,
            plan: options.plan,
            seconds: 0.0,
            whole: false,
        }
    }
}
