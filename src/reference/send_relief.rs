//! Twin of the sending pass: what a source with a relief sends by direction.

use glam::{DVec3, Vec3};

use crate::mesh::elements::Elements;
use crate::mesh::sources::Source;
use crate::meso::{RANK, Relief, slot_shares};

/// Light by direction of the hemicube's frame, `[direction]`, as radiosity πL.
pub struct Sent {
    pub emitted: Vec<DVec3>,
    pub reflected: Vec<DVec3>,
    /// All reflected light that the source has been given to send so far, this included.
    pub kept: Vec<DVec3>,
}

/// What `source` sends of its unshot emitted and reflected radiosity, W·m⁻². `coefficients` are
/// those of its members, `[member][rank]`; `before` is [`Sent::kept`] of its last turn,
/// `[direction]`.
pub fn send_relief(
    elements: &Elements,
    relief: &Relief,
    source: &Source,
    coefficients: &[Vec3],
    before: &[DVec3],
    emitted: DVec3,
    reflected: DVec3,
) -> Sent {
    let directions = &relief.directions;
    let k = directions.count();
    let members = source.members();
    // Respond: Σ_r R_jr c_r of each member.
    let responded: Vec<Vec<DVec3>> = members
        .clone()
        .zip(coefficients.chunks_exact(RANK))
        .map(|(e, coefficients)| {
            let response = relief.response(e);
            (0..k)
                .map(|out| {
                    let sum: DVec3 = (coefficients.iter().enumerate())
                        .map(|(r, c)| c.as_dvec3() * response.matrix[r * k + out].as_dvec3())
                        .sum();
                    sum * relief.scale[e].as_dvec3()
                })
                .collect()
        })
        .collect();
    // Turn: the mean over the members that face the direction, by projected area.
    let mean = |j: usize, of: &dyn Fn(usize, usize) -> DVec3| {
        let local = directions.centre(j);
        let world = source.tangent * local.x + source.bitangent * local.y + source.normal * local.z;
        let (mut sum, mut facing) = (DVec3::ZERO, 0.0);
        for (i, e) in members.clone().enumerate() {
            let n = elements.normal[e];
            let weight = elements.area[e] * n.dot(world).max(0.0);
            let seen = DVec3::new(
                relief.tangent[e].as_dvec3().dot(world),
                relief.bitangent[e].as_dvec3().dot(world),
                n.dot(world),
            );
            facing += weight;
            if weight > 0.0 {
                for (slot, share) in directions.bilinear(seen) {
                    sum += of(i, slot) * (weight * share);
                }
            }
        }
        if facing > 0.0 {
            sum / facing
        } else {
            DVec3::ZERO
        }
    };
    let emission = |i: usize, slot: usize| {
        let response = relief.response(members.start + i);
        (response.emission[slot] / response.mean_emission).as_dvec3()
    };
    let shares = slot_shares(directions);
    let all: Vec<DVec3> = (0..k)
        .map(|j| mean(j, &|i, slot| responded[i][slot]))
        .collect();
    let kept = with_power(all, &shares, power(before, &shares) + reflected);
    let new = kept.iter().zip(before).map(|(now, before)| *now - *before);
    let glow: Vec<DVec3> = (0..k).map(|j| emitted * mean(j, &emission)).collect();
    Sent {
        emitted: with_power(glow, &shares, emitted),
        reflected: new.collect(),
        kept,
    }
}

fn power(values: &[DVec3], shares: &[f64]) -> DVec3 {
    values.iter().zip(shares).map(|(v, &s)| *v * s).sum()
}

/// Gives a distribution the wanted power: by scaling, or where it has less than half of it, by
/// adding a constant.
fn with_power(mut values: Vec<DVec3>, shares: &[f64], wanted: DVec3) -> Vec<DVec3> {
    let power = power(&values, shares);
    for value in &mut values {
        for c in 0..3 {
            if power[c] > 0.5 * wanted[c] {
                value[c] *= wanted[c] / power[c];
            } else {
                value[c] += wanted[c] - power[c];
            }
        }
    }
    values
}
