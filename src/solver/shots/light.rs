//! What the elements have received, from the sums on the device.

use glam::{DVec3, Vec3};

use super::super::Light;
use super::super::relief_light::ReliefLight;
use super::Shots;
use crate::error::Result;
use crate::mesh::elements::Elements;
use crate::passes::buffers::download;
use crate::passes::shot_light::{RECEIVED_SUMS, REFLECTED_SUMS};

/// Direct and indirect power, RGB each, in units.
type Received = [u64; RECEIVED_SUMS];

impl Shots {
    /// Of the elements that the solution is of.
    pub fn light(&self, elements: &Elements) -> Result<Light> {
        let first = self.light.first_relief as usize;
        let received: Vec<Received> = download(&self.device, &self.light.received, elements.len())?;
        let mut light = Light {
            irradiance_direct: Vec::with_capacity(elements.len()),
            irradiance: Vec::with_capacity(elements.len()),
            radiosity: Vec::with_capacity(elements.len()),
            relief: None,
        };
        for (e, sums) in received[..first].iter().enumerate() {
            let [direct, indirect] = self.lit(sums, elements.area[e]);
            let all = (direct + indirect).as_vec3();
            light.irradiance_direct.push(direct.as_vec3());
            light.irradiance.push(all);
            light
                .radiosity
                .push(elements.emitted[e] + elements.reflectance[e] * all);
        }
        self.add_relief(elements, &mut light)?;
        Ok(light)
    }

    /// Adds the elements with relief.
    fn add_relief(&self, elements: &Elements, light: &mut Light) -> Result<()> {
        let Some(relief) = &elements.relief else {
            return Ok(());
        };
        let sums = &self.light;
        let device = &self.device;
        let (first, count) = (sums.first_relief as usize, relief.count());
        let k = relief.directions.count();
        let incoming: Vec<Received> = download(device, &sums.incoming, k * count)?;
        let reflected: Vec<[u64; REFLECTED_SUMS]> = download(device, &sums.reflected, count)?;
        let hidden: Vec<[u64; 3]> = download(device, &sums.hidden, k * count)?;
        // A scalar as a vector: its light comes from the middle of its slot.
        let ways: Vec<DVec3> = (0..k)
            .map(|slot| relief.directions.centre(slot))
            .map(|middle| middle / middle.z)
            .collect();
        let moment = |way: DVec3, light: DVec3| -> [Vec3; 3] {
            light.to_array().map(|light| (way * light).as_vec3())
        };
        let mut of_relief = ReliefLight {
            elements: (first as u32..elements.len() as u32).collect(),
            moments: Vec::with_capacity(k * count),
            moments_direct: Vec::with_capacity(k * count),
            coefficients: Vec::new(),
            exitant: Vec::with_capacity(k * count),
        };
        for (m, sums) in reflected.iter().enumerate() {
            let e = first + m;
            let (area, emitted) = (elements.area[e], elements.emitted[e].as_dvec3());
            let mut all = [DVec3::ZERO; 2];
            for (received, &way) in incoming[m * k..].iter().zip(&ways) {
                let [direct, indirect] = self.lit(received, area);
                all[0] += direct;
                all[1] += direct + indirect;
                of_relief.moments_direct.push(moment(way, direct));
                of_relief.moments.push(moment(way, direct + indirect));
            }
            light.irradiance_direct.push(all[0].as_vec3());
            light.irradiance.push(all[1].as_vec3());
            let sent = |units: [u64; 3]| -> Vec3 {
                let radiosity = units.map(|units| self.light.per_area(units, area));
                (emitted + DVec3::from_array(radiosity)).as_vec3()
            };
            light.radiosity.push(sent([3, 4, 5].map(|c| sums[c])));
            let hidden = hidden[m * k..(m + 1) * k].iter();
            of_relief
                .exitant
                .extend(hidden.map(|hidden| sent([0, 1, 2].map(|c| sums[c] - hidden[c]))));
        }
        light.relief = Some(of_relief);
        Ok(())
    }

    /// Direct and indirect irradiance, W·m⁻².
    fn lit(&self, sums: &Received, area: f64) -> [DVec3; 2] {
        let light = |c: usize| self.light.per_area(sums[c], area);
        [0, 3].map(|first| DVec3::new(light(first), light(first + 1), light(first + 2)))
    }
}
