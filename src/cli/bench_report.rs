//! `mesolux bench report`.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;

use super::progress::{catch_interrupts, interrupted};
use super::{DeviceOptions, watched};
use mesolux::bench::report::{self, Form, Report};
use mesolux::error::{Error, Result};
use mesolux::solver::open_device;
use mesolux::vk::{Device, Instance};

#[derive(Args)]
pub struct Options {
    /// Folder for report.html, report.json and report.md
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// The sizes of the paper, and more runs; takes longer
    #[arg(long)]
    full: bool,
    /// Elements of the Cornell box and of the scenes of Table 1, in place of those of the form
    #[arg(long, value_name = "N")]
    patches: Option<usize>,
    /// The report.json of another run or machine, whose figures are set beside
    #[arg(long, value_name = "REPORT.json")]
    against: Option<PathBuf>,
    /// Measure nothing: write the page of this report again
    #[arg(long, value_name = "REPORT.json", conflicts_with_all = ["full", "patches", "device"])]
    from: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceOptions,
}

pub fn run(options: &Options) -> Result<()> {
    let against = options.against.as_deref().map(Report::load).transpose()?;
    let report = match &options.from {
        Some(path) => {
            let report = Report::load(path)?;
            report::write(&report, against.as_ref(), &options.output)?;
            report
        }
        None => measure(options, against)?,
    };
    if report.devices.is_empty() {
        return Err(Error::Usage(
            "nothing was measured: nothing is written".into(),
        ));
    }
    tracing::info!(
        "{}: open it in a browser",
        options.output.join("report.html").display()
    );
    options.device.check()
}

fn measure(options: &Options, against: Option<Report>) -> Result<Report> {
    let form = match options.full {
        true => Form::Full,
        false => Form::Short,
    };
    let mut plan = form.plan();
    if let Some(patches) = options.patches {
        plan.elements = patches;
        plan.patches = Some(patches);
    }
    let devices = options.devices()?;
    let wanted = report::Options {
        form,
        plan,
        cache: super::solve_options::cache_folder(),
        against,
    };
    catch_interrupts();
    report::run(&devices, &wanted, &options.output, || !interrupted())
}

impl Options {
    /// The one that was asked for, or all that can run.
    fn devices(&self) -> Result<Vec<Arc<Device>>> {
        if self.device.device.is_some() {
            return Ok(vec![self.device.open()?]);
        }
        let candidates = Instance::new(false)?.candidates()?;
        let able = candidates.iter().filter(|c| c.missing.is_empty());
        let devices: Vec<_> = able
            .map(|c| open_device(Some(&c.index.to_string()), watched(self.device.validate)))
            .filter_map(|opened| match opened {
                Ok(device) => {
                    tracing::info!("device: {}", device.name());
                    Some(device)
                }
                Err(error) => {
                    tracing::warn!("{error}");
                    None
                }
            })
            .collect();
        match devices.is_empty() {
            // It says what is missing.
            true => Ok(vec![self.device.open()?]),
            false => Ok(devices),
        }
    }
}
