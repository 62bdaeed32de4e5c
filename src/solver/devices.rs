//! Several devices for one bake.

use std::sync::Arc;

use super::{Estimator, Settings, choose_device, open_device};
use crate::error::{Error, Result};
use crate::vk::{Device, Instance};

/// Opens the devices asked for: one as [`open_device`] does, or several, divided by commas. One
/// that is named twice is opened twice: a software device has threads of its own each time.
///
/// # Errors
/// A device that is not there or cannot run this program, or a list with a gap.
pub fn open_devices(wanted: Option<&str>, validation: bool) -> Result<Vec<Arc<Device>>> {
    let Some(list) = wanted.filter(|wanted| wanted.contains(',')) else {
        return Ok(vec![open_device(wanted, validation)?]);
    };
    let names: Vec<&str> = list.split(',').map(str::trim).collect();
    if names.contains(&"") {
        return Err(Error::Usage(format!(
            "--device {list}: a device is missing between two commas or at an end"
        )));
    }
    // Names have commas too.
    let instance = Instance::new(validation)?;
    if choose_device(&instance, wanted).is_ok() {
        return Ok(vec![open_device(wanted, validation)?]);
    }
    // All are looked for before the first is opened.
    for name in &names {
        choose_device(&instance, Some(name))?;
    }
    (names.into_iter())
        .map(|name| open_device(Some(name), validation))
        .collect()
}

/// The device that holds the solution, and all of them.
///
/// # Errors
/// No device; several for another estimator than `receiver`.
pub fn check_devices<'a>(
    devices: &'a [Arc<Device>],
    settings: &Settings,
) -> Result<&'a Arc<Device>> {
    match devices {
        [] => Err(Error::Device("a bake needs a device".into())),
        [_, _, ..] if settings.estimator != Estimator::Receiver => Err(Error::Usage(
            "--estimator pixel and --preset paper take one --device, not several".into(),
        )),
        [first, ..] => Ok(first),
    }
}
