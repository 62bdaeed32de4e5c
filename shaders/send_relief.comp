// The light that the chosen sources with a relief send, by direction in the hemicube's frame (the
// paper's equation (3), and ΔB_iq of equation (2)): each member's response to its moments, turned
// into the common frame, less what was sent before. One workgroup a slot, one invocation a
// direction. Response::send in src/meso/response.rs is the first of the three steps.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#include "shared/types.glsl"
#include "shared/directions.glsl"
#include "shared/texels.glsl"

layout(local_size_x = MOST_DIRECTIONS) in;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
layout(scalar, binding = 1) readonly buffer Sources { Source sources[]; };
layout(scalar, binding = 2) readonly buffer Planes { vec4 planes[]; };
layout(scalar, binding = 3) readonly buffer Areas { float element_area[]; };
layout(scalar, binding = 4) readonly buffer MesoElements { MesoElement meso_elements[]; };
// [response][direction in][direction out][colour]
layout(binding = 5) uniform usamplerBuffer matrices;
// Sent light for a mean emitted radiosity of 1, [response][direction].
layout(scalar, binding = 6) readonly buffer Emissions { vec3 emissions[]; };
// Share of a uniform sender's power in each direction.
layout(scalar, binding = 7) readonly buffer Shares { float shares[]; };
layout(scalar, binding = 8) readonly buffer MomentsDirect { vec3 moments_direct[]; };
layout(scalar, binding = 9) readonly buffer MomentsIndirect { vec3 moments_indirect[]; };
// Reflected light that each source has been given to send so far, [relief source][direction].
layout(scalar, binding = 10) buffer ShotExits { vec3 shot_exits[]; };
// Of each member, [slot][member][direction].
layout(scalar, binding = 11) coherent buffer MemberExits { vec3 member_exits[]; };
// [slot][emitted, reflected][direction]
layout(scalar, binding = 12) writeonly buffer Exits { vec4 exits[]; };

// Slots without light that were left out so far, [relief source].
layout(scalar, binding = 13) buffer DarkSlots { uint dark_slots[]; };
// With `by_pixel`: what each element sends, [meso element][direction].
layout(scalar, binding = 14) readonly buffer Outgoing { vec3 outgoing[]; };

layout(push_constant, scalar) uniform Parameters {
    uint first_source;
    uint source_count;
    uint first_element;
    uint most_members;
    uvec2 cells;
    uint by_pixel;            // 1: the pixel estimator has reflected the light already
    uint first_slot;
};

shared vec3 part[MOST_DIRECTIONS];

// A subgroup has as many lanes at least, and directions are a multiple of them.
const uint SHARED_MOMENTS = 4;

// Sum over the workgroup, in the same order every time.
vec3 sum_over_directions(uint j, vec3 value) {
    part[j] = value;
    barrier();
    for (uint half_count = MOST_DIRECTIONS / 2; half_count > 0; half_count /= 2) {
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
    uint count = cells.x * cells.y;
    Slot shot = slots[first_slot + slot];
    if (shot.source - first_source >= source_count) {
        return;
    }
    Source s = sources[shot.source];
    uint first_member = slot * most_members;
    bool mine = j < count;

    // Respond: every member's light in its own frame. Moments are the same for all directions out:
    // each lane loads those of one direction in, for all to share.
    uint dark = 0;
    for (uint i = 0; i < s.element_count; i++) {
        uint m = s.first_element + i - first_element;
        if (by_pixel == 1) {
            if (mine) {
                member_exits[(first_member + i) * count + j] = outgoing[m * count + j];
            }
            continue;
        }
        MesoElement meso = meso_elements[m];
        vec3 sent = vec3(0.0);
        for (uint first = 0; first < count; first += SHARED_MOMENTS) {
            uint at = 3 * (m * count + first + gl_SubgroupInvocationID % SHARED_MOMENTS);
            vec3 r = moments_direct[at] + moments_indirect[at];
            vec3 g = moments_direct[at + 1] + moments_indirect[at + 1];
            vec3 b = moments_direct[at + 2] + moments_indirect[at + 2];
            [[unroll]] for (uint lane = 0; lane < SHARED_MOMENTS; lane++) {
                vec3 red = subgroupBroadcast(r, lane);
                vec3 green = subgroupBroadcast(g, lane);
                vec3 blue = subgroupBroadcast(b, lane);
                // A moment of light from above has a z above 0.
                if (red.z == 0.0 && green.z == 0.0 && blue.z == 0.0) {
                    dark++;
                    continue;
                }
                uint row = 3 * ((meso.response * count + first + lane) * count + min(j, count - 1));
                sent += vec3(dot(fetch(matrices, row).xyz, red), dot(fetch(matrices, row + 1).xyz, green), dot(fetch(matrices, row + 2).xyz, blue));
            }
        }
        if (mine) {
            member_exits[(first_member + i) * count + j] = sent * meso.scale;
        }
    }
    if (j == 0) {
        dark_slots[shot.source - first_source] += dark;
    }
    memoryBarrierBuffer();
    barrier();

    // Turn: what the members send together in the direction j of the hemicube's frame.
    vec3 reflected = vec3(0.0);
    vec3 emitted = vec3(0.0);
    if (mine) {
        vec3 local = direction_centre(j, cells);
        vec3 world = local.x * s.tangent + local.y * s.bitangent + local.z * s.normal;
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
                reflected += weight * at.weight[l] * member_exits[(first_member + i) * count + at.k[l]];
                emitted += weight * at.weight[l] * emissions[meso.response * count + at.k[l]];
            }
        }
        float scale = facing > 0.0 ? 1.0 / facing : 0.0;
        reflected *= scale;
        emitted *= scale * shot.emitted;
    }

    // Keep the energy: all that the source has been given to send carries its power, whatever the
    // order it came in. What it sends now is that less what it has sent.
    uint kept = (shot.source - first_source) * count + j;
    vec3 before = mine ? shot_exits[kept] : vec3(0.0);
    float share = mine ? shares[j] : 0.0;
    vec3 power = sum_over_directions(j, share * reflected);
    vec3 power_before = sum_over_directions(j, share * before);
    vec3 emitted_power = sum_over_directions(j, share * emitted);
    if (mine) {
        reflected = with_power(reflected, power, power_before + shot.reflected);
        shot_exits[kept] = reflected;
        exits[2 * slot * count + j] = vec4(with_power(emitted, emitted_power, shot.emitted), 0.0);
        exits[(2 * slot + 1) * count + j] = vec4(reflected - before, 0.0);
    }
}
