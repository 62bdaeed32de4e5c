//! Several devices for one bake.

use std::sync::Arc;
use std::thread;

use super::drawer::Drawer;
use super::helpers::Helper;
use super::several::Team;
use super::{Estimator, Settings, choose_device, open_device};
use crate::charts::Connections;
use crate::elements::Elements;
use crate::error::{Error, Result};
use crate::occluders::Occluders;
use crate::passes::buffers::SceneBuffers;
use crate::passes::relief_buffers::meso_elements;
use crate::sources::{Sources, least_strong};
use crate::vk::{Device, Instance};

/// Opens the devices asked for: one as [`open_device`] does, or several, divided by commas. One that is named twice is opened twice: a
/// software device has threads of its own each time.
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

/// The device that holds the solution, and those that draw for it.
///
/// # Errors
/// No device; several for the `pixel` estimator, which takes irradiance from the pixels themselves.
pub fn check_devices<'a>(
    devices: &'a [Arc<Device>],
    settings: &Settings,
) -> Result<(&'a Arc<Device>, &'a [Arc<Device>])> {
    match devices.split_first() {
        None => Err(Error::Device("a bake needs a device".into())),
        Some((_, others)) if !others.is_empty() && settings.estimator == Estimator::Pixel => Err(
            Error::Usage("--estimator pixel takes one --device, not several".into()),
        ),
        Some(split) => Ok(split),
    }
}

/// What a device must know of a scene to draw it.
pub(super) struct Parts<'a> {
    pub elements: &'a Elements,
    pub sources: &'a Sources,
    pub connections: &'a Connections,
    pub occluders: &'a Occluders,
}

impl Parts<'_> {
    pub fn scene(&self, device: &Arc<Device>) -> Result<SceneBuffers> {
        SceneBuffers::new(
            device,
            self.elements,
            self.sources,
            self.connections,
            self.occluders,
        )
    }

    /// Makes all of them ready to draw, at the same time. None without others.
    pub fn team(
        &self,
        settings: &Settings,
        (first, scene): (&Arc<Device>, &SceneBuffers),
        others: &[Arc<Device>],
    ) -> Result<Option<Team>> {
        if others.is_empty() {
            return Ok(None);
        }
        let relief = self.elements.relief.as_ref();
        let meso = relief.map_or_else(Vec::new, |relief| meso_elements(self.elements, relief));
        let sources = &self.sources.list;
        let least = least_strong(sources, &settings.grouping);
        let helper = |device| {
            let scene = self.scene(device)?;
            let drawer = Drawer::with_scene(device, settings, scene, &meso)?;
            Ok(Helper::start(drawer))
        };
        thread::scope(|scope| {
            let helpers: Vec<_> = (others.iter())
                .map(|device| scope.spawn(|| helper(device)))
                .collect();
            let own = Drawer::new(first, settings, scene, &meso)?;
            let helpers = helpers.into_iter().map(|helper| {
                let made = helper.join();
                made.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            });
            Ok(Some(Team {
                own,
                helpers: helpers.collect::<Result<_>>()?,
                strong: (sources.iter())
                    .map(|s| s.emitted_power() >= least)
                    .collect(),
            }))
        })
    }
}
