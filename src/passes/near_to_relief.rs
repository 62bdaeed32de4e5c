//! Light that elements with a relief receive of the parts of near sources. Shader:
//! `near_to_relief.comp`; its twin is [`crate::reference::near_to_relief`].

use std::sync::Arc;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::buffers::{State, upload_words};
use super::gather::Part;
use super::groups;
use super::relief_buffers::ReliefBuffers;
use super::shaders::near_to_relief::{Bindings, Parameters, SHADER};
use super::words::Words;
use crate::error::Result;
use crate::mesh::near::NearPairs;
use crate::vk::{BoundCompute, Buffer, BufferUse, Commands, ComputePipeline, Device};

/// What elements with a relief receive of near parts, see [`NearPairs::relief_entries`].
#[derive(Clone, Serialize, Deserialize)]
pub struct NearParts {
    list: Words,
    starts: Words,
    /// Of all near sources.
    parts: u32,
}

impl NearParts {
    pub fn new(near: &NearPairs) -> Self {
        Self {
            list: Words::of(&near.relief_entries.list),
            starts: Words::of(&near.relief_entries.starts),
            parts: near.parts,
        }
    }
}

pub struct NearToRelief {
    /// Of emitted and of reflected light: radiosity of the parts.
    beyond: [Buffer; 2],
    bound: [BoundCompute; 2],
    parameters: Parameters,
}

impl NearToRelief {
    /// None where no element with a relief receives part by part.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn new(
        device: &Arc<Device>,
        near: &NearParts,
        state: &State,
        relief: &ReliefBuffers,
    ) -> Result<Option<Self>> {
        if near.list.words().is_empty() {
            return Ok(None);
        }
        let storage = BufferUse::Storage;
        let starts = upload_words(device, "near relief starts", &near.starts, storage)?;
        let parts = upload_words(device, "near relief parts", &near.list, storage)?;
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
                first_element: relief.shape.first_element,
                element_count: relief.shape.element_count,
                kept_cells: relief.shape.kept_cells(),
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
