// As gather.comp, for elements with a relief: each source's light is kept as a vector in the slot
// of its direction (the paper's equation (4), with vectors for scalars) and as coefficients of the
// element's response, and what of it leaves again is summed up. An invocation takes one element,
// whose coefficients it sums in registers.
#version 460
#extension GL_GOOGLE_include_directive : require
#define FROM_RELIEF
#define TO_RELIEF
#include "shared/gather.glsl"
#include "shared/keep_coefficients.glsl"

// The form factor of an element of the block, as a vector towards the source. How wide the source is
// follows from the whole of it.
vec3 factor(uint block, uint within, float scale, bool inside) {
    uint k = within % FACTORS;
    uint pair = fetch_words(words, block + within / FACTORS)[k / 2];
    uint direction = fetch_words(words, block + TEXELS + within / 4)[k % 4];
    float kept = kept_factor(k % 2 == 0 ? pair & 0xffff : pair >> 16);
    return inside && kept != 0.0 ? scale * (kept * kept_direction(direction)) : vec3(0.0);
}

void main() {
    uint lane = gl_SubgroupInvocationID;
    uint within = gl_WorkGroupID.y * LANES + lane;
    uint i = GROUP * gl_WorkGroupID.x + within;
    // Other lanes only look up slots.
    bool inside = within < GROUP && i < element_count;
    within = min(within, GROUP - 1);
    i = inside ? i : 0;
    uint e = first_element + i;
    uint m = first_meso + i;
    MesoElement meso = meso_elements[m];
    vec3 middle = balls[e].xyz;
    bool goes_on = inside && continues == 1;
    uint first_sum = i * (1 + RELIEF_RANK);
    vec3 sum = goes_on ? partial_sums[first_sum] : vec3(0.0);
    vec3 sums[RELIEF_RANK];
    for (uint r = 0; r < RELIEF_RANK; r++) {
        sums[r] = goes_on ? partial_sums[first_sum + 1 + r] : vec3(0.0);
    }

    // See gather_even.glsl.
    uint next = first_slot;
    while (next < end_slot) {
        uint first;
        Sent mine;
        uvec4 even;
        do {
            first = next;
            mine = look_up(first + lane);
            even = subgroupBallot(mine.block != 0);
            next = first + LANES;
        } while (even == uvec4(0) && next < end_slot);
        uint source = first + lane < end_slot ? slots[first + lane].source : NONE;
        uvec4 directed = subgroupBallot(mine.block != 0 && by_direction(source));
        even &= ~directed;
        while (any(notEqual(directed, uvec4(0)))) {
            uint from = next_lane(directed);
            Slot shot = slots[first + from];
            vec3 light = sent_to(first + from, sender(shot.source), middle);
            vec3 f = factor(subgroupBroadcast(mine.block, from), within, shot.scale, inside);
            sum += f.z * light;
            receive_by_direction(m, meso.response, f, light, sums);
        }
        while (any(notEqual(even, uvec4(0)))) {
            uint from = next_lane(even);
            float scale = slots[first + from].scale;
            vec3 light = subgroupBroadcast(mine.light, from) / scale;
            vec3 f = factor(subgroupBroadcast(mine.block, from), within, scale, inside);
            sum += f.z * light;
            receive_by_direction(m, meso.response, f, light, sums);
        }
    }

    if (inside && is_continued == 1) {
        partial_sums[first_sum] = sum;
        for (uint r = 0; r < RELIEF_RANK; r++) {
            partial_sums[first_sum + 1 + r] = sums[r];
        }
    } else if (inside) {
        accumulate(irradiance[e], irradiance_error[e], sum);
        keep_coefficients(m, meso, sums);
    }
}
