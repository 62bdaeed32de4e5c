//! Light that elements with a relief receive of the parts of near sources. Shader:
//! `near_to_relief.comp`; its twin is [`crate::reference::near_to_relief`].

use std::sync::Arc;

use glam::Vec3;

use super::buffers::{State, upload};
use super::gather::Part;
use super::groups;
use super::relief_buffers::ReliefBuffers;
use super::shaders::near_to_relief::{Bindings, Parameters, SHADER};
use crate::error::Result;
use crate::mesh::near::NearPairs;
use crate::vk::{BoundCompute, Buffer, BufferUse, Commands, ComputePipeline, Device};

pub struct NearToRelief {
    /// Of emitted and of reflected light: radiosity of the parts.
    beyond: [Buffer; 2],
    bound: [BoundCompute; 2],
    parameters: Parameters,
}

impl NearToRelief {
    /// None where no element with a relief receives part by part.
    pub fn new(
        device: &Arc<Device>,
        near: &NearPairs,
        state: &State,
        relief: &ReliefBuffers,
    ) -> Result<Option<Self>> {
        let entries = &near.relief_entries;
        if entries.list.is_empty() {
            return Ok(None);
        }
        let storage = BufferUse::Storage;
        let starts = upload(device, "near relief starts", &entries.starts, storage)?;
        let parts = upload(device, "near relief parts", &entries.list, storage)?;
        let bytes = 12 * u64::from(near.parts);
        let emitted = Buffer::new(device, "near emitted light", bytes, storage)?;
        let reflected = Buffer::new(device, "near reflected light", bytes, storage)?;
        let pipeline = ComputePipeline::new(device, "near to relief", &SHADER)?;
        let bindings = Bindings {
            starts: &starts,
            parts: &parts,
            beyond: &emitted,
            meso_elements: &relief.elements,
            albedos: &relief.albedos,
            moments: &relief.moments_direct,
            meso_reflected: &relief.reflected,
            irradiance: &state.direct,
            irradiance_error: &state.direct_error,
            bases: &relief.bases,
            coefficients: &relief.coefficients,
        };
        let of_emitted = pipeline.bind(&bindings)?;
        let of_reflected = pipeline.bind(&Bindings {
            beyond: &reflected,
            moments: &relief.moments_indirect,
            irradiance: &state.indirect,
            irradiance_error: &state.indirect_error,
            ..bindings
        })?;
        Ok(Some(Self {
            beyond: [emitted, reflected],
            bound: [of_emitted, of_reflected],
            parameters: Parameters {
                first_element: relief.first_element,
                element_count: relief.element_count,
                kept_cells: relief.kept_cells(),
            },
        }))
    }

    /// Sets the radiosity of the parts beyond their sources' means, `[part]`.
    pub fn write(&self, light: Part, beyond: &[Vec3]) -> Result<()> {
        self.beyond[light as usize].set(beyond)
    }

    /// Adds what the parts send.
    pub fn record(&self, cmd: &Commands, light: Part) {
        let size = [groups(self.parameters.element_count), 1, 1];
        cmd.dispatch(&self.bound[light as usize], &self.parameters, size);
    }
}
