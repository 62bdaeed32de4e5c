// The light that the chosen sources with a relief send, by direction in the hemicube's frame (the
// paper's equation (3), and ΔB_iq of equation (2)): each member's response to its coefficients, turned
// into the common frame, less what was sent before. One workgroup a slot, one invocation a
// direction. Response::send in src/meso/response.rs is the first of the three steps.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.glsl"
#include "shared/directions.glsl"
#include "shared/texels.glsl"

// The number of directions, a power of two.
layout(constant_id = 0) const uint DIRECTIONS = 64;
layout(local_size_x_id = 0) in;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
layout(scalar, binding = 1) readonly buffer Sources { Source sources[]; };
layout(scalar, binding = 2) readonly buffer Planes { vec4 planes[]; };
layout(scalar, binding = 3) readonly buffer Areas { float element_area[]; };
layout(scalar, binding = 4) readonly buffer MesoElements { MesoElement meso_elements[]; };
// [response][rank][direction]
layout(binding = 5) uniform usamplerBuffer matrices;
// Sent light for a mean emitted radiosity of 1, [response][direction].
layout(scalar, binding = 6) readonly buffer Emissions { vec3 emissions[]; };
// Of each direction, and in w its share of a uniform sender's power.
layout(scalar, binding = 7) readonly buffer DirectionList { vec4 direction_list[]; };
// [meso element][rank]
layout(binding = 8) uniform usamplerBuffer coefficients;
// Reflected light that each source has been given to send so far, [relief source][direction].
layout(scalar, binding = 9) buffer ShotExits { vec3 shot_exits[]; };
// Of each member, [slot][member][direction].
layout(scalar, binding = 10) coherent buffer MemberExits { vec3 member_exits[]; };
// [slot][emitted, reflected][direction]
layout(scalar, binding = 11) writeonly buffer Exits { vec4 exits[]; };

layout(push_constant, scalar) uniform Parameters {
    uint first_source;
    uint source_count;
    uint first_element;
    uint most_members;
    uvec2 cells;
    uint first_slot;
};

shared vec3 part[DIRECTIONS];

// Sum over the workgroup, in the same order every time.
vec3 sum_over_directions(uint j, vec3 value) {
    part[j] = value;
    barrier();
    for (uint half_count = DIRECTIONS / 2; half_count > 0; half_count /= 2) {
        if (j < half_count) {
            part[j] += part[j + half_count];
        }
        barrier();
    }
    vec3 sum = part[0];
    barrier();
    return sum;
}

// Brings a distribution to the power that it must have: scaled, or where it is not of one sign,
// shifted.
vec3 with_power(vec3 value, vec3 power, vec3 wanted) {
    bvec3 scales = greaterThan(power, 0.5 * wanted);
    return mix(value + wanted - power, value * (wanted / mix(vec3(1.0), power, scales)), scales);
}

void main() {
    // Light by direction is indexed from first_slot on.
    uint slot = gl_WorkGroupID.x;
    uint j = gl_LocalInvocationID.x;
    Slot shot = slots[first_slot + slot];
    if (shot.source - first_source >= source_count) {
        return;
    }
    Source s = sources[shot.source];
    uint first_member = slot * most_members;

    // Respond: every member's light in its own frame.
    for (uint i = 0; i < s.element_count; i++) {
        uint m = s.first_element + i - first_element;
        MesoElement meso = meso_elements[m];
        vec3 sent = vec3(0.0);
        for (uint r = 0; r < RELIEF_RANK; r++) {
            uint row = meso.response * RELIEF_RANK + r;
            sent += fetch(matrices, row * DIRECTIONS + j).xyz * fetch(coefficients, m * RELIEF_RANK + r).xyz;
        }
        member_exits[(first_member + i) * DIRECTIONS + j] = sent * meso.scale;
    }
    memoryBarrierBuffer();
    barrier();

    // Turn: what the members send together in the direction j of the hemicube's frame.
    vec3 reflected = vec3(0.0);
    vec3 emitted = vec3(0.0);
    vec4 direction = direction_list[j];
    vec3 world = direction.x * s.tangent + direction.y * s.bitangent + direction.z * s.normal;
    float facing = 0.0;
    for (uint i = 0; i < s.element_count; i++) {
        uint e = s.first_element + i;
        MesoElement meso = meso_elements[e - first_element];
        vec3 n = planes[e].xyz;
        float weight = element_area[e] * max(dot(n, world), 0.0);
        if (weight == 0.0) {
            continue;
        }
        facing += weight;
        Look at = look(vec3(dot(meso.tangent, world), dot(meso.bitangent, world), dot(n, world)), cells);
        for (uint l = 0; l < 4; l++) {
            reflected += weight * at.weight[l] * member_exits[(first_member + i) * DIRECTIONS + at.k[l]];
            emitted += weight * at.weight[l] * emissions[meso.response * DIRECTIONS + at.k[l]];
        }
    }
    float scale = facing > 0.0 ? 1.0 / facing : 0.0;
    reflected *= scale;
    emitted *= scale * shot.emitted;

    // Keep the energy: all that the source has been given to send carries its power, whatever the
    // order it came in. What it sends now is that less what it has sent.
    uint kept = (shot.source - first_source) * DIRECTIONS + j;
    vec3 before = shot_exits[kept];
    float share = direction.w;
    vec3 power = sum_over_directions(j, share * reflected);
    vec3 power_before = sum_over_directions(j, share * before);
    vec3 emitted_power = sum_over_directions(j, share * emitted);
    reflected = with_power(reflected, power, power_before + shot.reflected);
    shot_exits[kept] = reflected;
    exits[2 * slot * DIRECTIONS + j] = vec4(with_power(emitted, emitted_power, shot.emitted), 0.0);
    exits[(2 * slot + 1) * DIRECTIONS + j] = vec4(reflected - before, 0.0);
}
