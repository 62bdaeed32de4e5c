// Every element adds up what kept rows bring it: form factor times radiosity, the paper's equation
// (2) by reciprocity. One subgroup a block of GROUP elements, sources in slot order: no atomics,
// the same bits every run and for every size of subgroup. FROM_RELIEF: some sources send by
// direction. TO_RELIEF: the elements of this dispatch receive by direction.
//
// A dispatch takes emitted or reflected light. Few sources emit, so that its other half mostly need
// not run; and a software device pays for both sides of every branch, but a loop over the slots of
// one kind costs what there are of them.

#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require
#include "shared/types.glsl"
#include "shared/kept.glsl"
#include "shared/lanes.glsl"
#include "shared/texels.glsl"
#ifdef FROM_RELIEF
#include "shared/directions.glsl"
#endif
#ifdef TO_RELIEF
#include "shared/disc.glsl"
#define FLUX vec3
#else
#define FLUX float
#endif

// The workgroup is one subgroup. An invocation takes the FACTORS elements whose factors share a
// texel, or several such; where there are more lanes than texels in a block, the others only look
// up slots.
const uint FACTORS = 8;
layout(constant_id = 0) const uint LANES = GROUP / FACTORS;
layout(local_size_x_id = 0) in;
const uint TEXELS = GROUP / FACTORS;
const uint PER_LANE = LANES < TEXELS ? TEXELS / LANES : 1;

// What each row's source sends, times the scale of its form factors, and the first word of the row,
// [slot][emitted, reflected].
layout(binding = 0) uniform usamplerBuffer lit_rows;
// Of emitted or of reflected light.
layout(scalar, binding = 1) buffer Irradiance { vec3 irradiance[]; };
layout(scalar, binding = 2) buffer IrradianceError { vec3 irradiance_error[]; };
// Words of the chunk that holds the rows.
layout(binding = 3) uniform usamplerBuffer words;
#ifdef FROM_RELIEF
layout(scalar, binding = 4) readonly buffer Slots { Slot slots[]; };
// Light that the sources with a relief send by direction,
// [slot from first_slot on][emitted, reflected][direction].
layout(binding = 5) uniform usamplerBuffer exits;
// SOURCE_TEXELS a source.
layout(binding = 6) uniform usamplerBuffer sources;
layout(scalar, binding = 7) readonly buffer Balls { vec4 balls[]; };
#endif
#ifdef TO_RELIEF
layout(scalar, binding = 8) readonly buffer MesoElements { MesoElement meso_elements[]; };
// Radiosity for each moment, [response][direction][colour].
layout(binding = 9) uniform usamplerBuffer albedos;
// Moments ∫ L ω dω of the light that arrives, in the element's frame, [meso
// element][direction][colour].
layout(scalar, binding = 10) buffer Moments { vec3 moments[]; };
layout(scalar, binding = 11) buffer MesoReflected { Reflected meso_reflected[]; };
#endif

layout(push_constant, scalar) uniform Parameters {
    uint first_element;
    uint element_count;
    uint first_slot;
    uint end_slot;
    uint first_block;
    uint reflected;           // 0: light that is emitted, 1: that is reflected
    // With relief:
    uint first_relief_source;
    uint relief_source_count;
    uvec2 cells;              // of the directions' square
};

#include "shared/accumulate.glsl"
#ifdef FROM_RELIEF
#include "shared/sent.glsl"
#endif
#ifdef TO_RELIEF
#include "shared/receive_relief.glsl"
#endif

// One element of this invocation, and what it has received.
struct Receiver {
    uint i;         // of the elements of the dispatch; NONE: past the last one
    vec3 irradiance;
#ifdef FROM_RELIEF
    vec3 middle;
#endif
#ifdef TO_RELIEF
    uint response;
    vec3 reflected;
#endif
};

// What a slot sends, and the texel where this block's factors start; 0: the block sees nothing of
// it.
struct Sent {
    vec3 light;
    uint block;
};

uint word_at(uint at) {
    return fetch_words(words, at / 4)[at % 4];
}

// Light of which the element sees the share f.
void receive(inout Receiver receiver, FLUX f, vec3 light) {
#ifdef TO_RELIEF
    receiver.irradiance += f.z * light;
    receiver.reflected += receive_by_direction(receiver.i, receiver.response, f, light);
#else
    receiver.irradiance += f * light;
#endif
}

#ifdef FROM_RELIEF
// Place and frame of a source that sends by direction.
struct Sender {
    vec3 tangent;
    vec3 bitangent;
    vec3 normal;
    vec3 middle;
};

// All lanes want the same one.
Sender sender(uint source) {
    uint at = SOURCE_TEXELS * source;
    return Sender(fetch(sources, at + 2).xyz, fetch(sources, at + 3).xyz,
                  fetch(sources, at + 1).xyz, fetch(sources, at + 6).yzw);
}

vec3 sent_to(uint slot, Sender s, vec3 middle) {
    vec3 d = middle - s.middle;
    vec3 local = vec3(dot(d, s.tangent), dot(d, s.bitangent), dot(d, s.normal));
    return sent_towards(slot - first_slot, reflected, local * inversesqrt(max(dot(d, d), 1e-38)));
}

bool by_direction(uint source) {
    return source - first_relief_source < relief_source_count;
}
#endif

// This lane's slot, for all lanes to share.
Sent look_up(uint slot) {
    Sent sent = Sent(vec3(0.0), 0);
    if (slot < end_slot) {
        uvec4 lit = fetch_words(lit_rows, 2 * slot + reflected);
        sent.light = uintBitsToFloat(lit.xyz);
        bool sends = sent.light != vec3(0.0);
#ifdef FROM_RELIEF
        // What leaves by direction may sum to nothing.
        sends = sends || reflected == 1 && by_direction(slots[slot].source);
#endif
        if (sends) {
            uint at = word_at(lit.w + first_block + gl_WorkGroupID.x);
            sent.block = at == 0 ? 0 : (lit.w + at) / 4;
        }
    }
    return sent;
}

// The factors of the elements of one texel.
void load(uint block, uint texel, out FLUX f[FACTORS]) {
    uvec4 pairs = fetch_words(words, block + texel);
#ifdef TO_RELIEF
    uvec4 low = fetch_words(words, block + TEXELS + 2 * texel);
    uvec4 high = fetch_words(words, block + TEXELS + 2 * texel + 1);
#endif
    for (uint k = 0; k < FACTORS; k++) {
        uint pair = pairs[k / 2];
        float factor = kept_factor(k % 2 == 0 ? pair & 0xffff : pair >> 16);
#ifdef TO_RELIEF
        uint direction = k < 4 ? low[k % 4] : high[k % 4];
        f[k] = factor == 0.0 ? vec3(0.0) : factor * kept_direction(direction);
#else
        f[k] = factor;
#endif
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
        receivers[n].irradiance = vec3(0.0);
#ifdef FROM_RELIEF
        receivers[n].middle = inside ? balls[first_element + i].xyz : vec3(0.0);
#endif
#ifdef TO_RELIEF
        receivers[n].response = inside ? meso_elements[i].response : 0;
        receivers[n].reflected = vec3(0.0);
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
                FLUX f[FACTORS];
                load(block, min(lane + n * LANES, TEXELS - 1), f);
                for (uint k = 0; k < FACTORS; k++) {
                    uint of = FACTORS * n + k;
                    vec3 light = sent_to(first + from, s, receivers[of].middle);
                    // Lanes past the block have nothing to add to.
                    FLUX factor = receivers[of].i != NONE ? shot.scale * f[k] : FLUX(0.0);
                    receive(receivers[of], factor, light);
                }
            }
        }
#endif
        while (any(notEqual(even, uvec4(0)))) {
            uint from = next_lane(even);
            vec3 light = subgroupBroadcast(mine.light, from);
            uint block = subgroupBroadcast(mine.block, from);
#ifdef TO_RELIEF
            float scale = slots[first + from].scale;
#endif
            for (uint n = 0; n < PER_LANE; n++) {
                FLUX f[FACTORS];
                load(block, min(lane + n * LANES, TEXELS - 1), f);
                for (uint k = 0; k < FACTORS; k++) {
#ifdef TO_RELIEF
                    // How wide the source is follows from its whole form factor.
                    bool inside = receivers[FACTORS * n + k].i != NONE;
                    vec3 factor = inside ? scale * f[k] : vec3(0.0);
                    receive(receivers[FACTORS * n + k], factor, light / scale);
#else
                    receive(receivers[FACTORS * n + k], f[k], light);
#endif
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
        accumulate(irradiance[e], irradiance_error[e], receivers[n].irradiance);
#ifdef TO_RELIEF
        vec3 sum = receivers[n].reflected * meso_elements[i].scale;
        accumulate(meso_reflected[i].sum, meso_reflected[i].error, sum);
#endif
    }
}
