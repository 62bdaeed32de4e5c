// As shared/gather.glsl, to elements without relief. An invocation takes the FACTORS elements whose
// factors share a texel, or several such; where there are more lanes than texels in a block, the
// others only look up slots.

#include "shared/gather.glsl"

const uint PER_LANE = LANES < TEXELS ? TEXELS / LANES : 1;

// One element of this invocation, and what it has received.
struct Receiver {
    uint i;         // of the elements of the dispatch; NONE: past the last one
    vec3 irradiance;
#ifdef FROM_RELIEF
    vec3 middle;
#endif
};

// The factors of the elements of one texel.
void load(uint block, uint texel, out float f[FACTORS]) {
    uvec4 pairs = fetch_words(words, block + texel);
    for (uint k = 0; k < FACTORS; k++) {
        uint pair = pairs[k / 2];
        float factor = kept_factor(k % 2 == 0 ? pair & 0xffff : pair >> 16);
        f[k] = factor;
    }
}

void main() {
    Receiver receivers[FACTORS * PER_LANE];
    uint lane = gl_SubgroupInvocationID;
    for (uint n = 0; n < FACTORS * PER_LANE; n++) {
        uint texel = lane + n / FACTORS * LANES;
        uint i = GROUP * gl_WorkGroupID.x + FACTORS * texel + n % FACTORS;
        bool inside = texel < TEXELS && i < element_count;
        receivers[n].i = inside ? i : NONE;
        receivers[n].irradiance = inside && continues == 1 ? partial_sums[i] : vec3(0.0);
#ifdef FROM_RELIEF
        receivers[n].middle = inside ? balls[first_element + i].xyz : vec3(0.0);
#endif
    }

    // Each lane looks up one slot and shares it with the others; slots of which the block sees
    // nothing are passed over.
    uint next = first_slot;
    while (next < end_slot) {
        // On to the next slots of which the block sees any, in a loop of its own: a software device
        // works through what a branch leaves out.
        uint first;
        Sent mine;
        uvec4 even;
        do {
            first = next;
            mine = look_up(first + lane);
            even = subgroupBallot(mine.block != 0);
            next = first + LANES;
        } while (even == uvec4(0) && next < end_slot);
#ifdef FROM_RELIEF
        uint source = first + lane < end_slot ? slots[first + lane].source : NONE;
        uvec4 directed = subgroupBallot(mine.block != 0 && by_direction(source));
        even &= ~directed;
        while (any(notEqual(directed, uvec4(0)))) {
            uint from = next_lane(directed);
            uint block = subgroupBroadcast(mine.block, from);
            Slot shot = slots[first + from];
            Sender s = sender(shot.source);
            for (uint n = 0; n < PER_LANE; n++) {
                float f[FACTORS];
                load(block, min(lane + n * LANES, TEXELS - 1), f);
                for (uint k = 0; k < FACTORS; k++) {
                    uint of = FACTORS * n + k;
                    vec3 light = sent_to(first + from, s, receivers[of].middle);
                    // Lanes past the block have nothing to add to.
                    float factor = receivers[of].i != NONE ? shot.scale * f[k] : float(0.0);
                    receivers[of].irradiance += factor * light;
                }
            }
        }
#endif
        while (any(notEqual(even, uvec4(0)))) {
            uint from = next_lane(even);
            vec3 light = subgroupBroadcast(mine.light, from);
            uint block = subgroupBroadcast(mine.block, from);
            for (uint n = 0; n < PER_LANE; n++) {
                float f[FACTORS];
                load(block, min(lane + n * LANES, TEXELS - 1), f);
                for (uint k = 0; k < FACTORS; k++) {
                    receivers[FACTORS * n + k].irradiance += f[k] * light;
                }
            }
        }
    }

    for (uint n = 0; n < FACTORS * PER_LANE; n++) {
        uint i = receivers[n].i;
        if (i == NONE) {
            continue;
        }
        uint e = first_element + i;
        if (is_continued == 1) {
            partial_sums[i] = receivers[n].irradiance;
        } else {
            accumulate(irradiance[e], irradiance_error[e], receivers[n].irradiance);
        }
    }
}
