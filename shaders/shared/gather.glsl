// Every element adds up what kept rows bring it: form factor times radiosity, the paper's equation (2)
// by reciprocity. One subgroup a block of GROUP elements, sources in slot order: no atomics, the same
// bits every run and for every size of subgroup. FROM_RELIEF: some sources send by direction.
// TO_RELIEF: the elements of this dispatch receive by direction.
//
// A dispatch takes emitted or reflected light. Few sources emit, so that its other half mostly need
// not run; and a software device pays for both sides of every branch, but a loop over the slots of
// one kind costs what there are of them.

#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#include "shared/types.glsl"
#include "shared/kept.glsl"
#include "shared/lanes.glsl"
#ifdef FROM_RELIEF
#include "shared/directions.glsl"
#include "shared/load4.glsl"
#endif
#ifdef TO_RELIEF
#include "shared/disc.glsl"
#define FLUX vec3
#else
#define FLUX float
#endif

// The workgroup is one subgroup. An invocation takes PAIRS pairs of elements, a pair because two kept factors share a word; the
// pairs of one step lie side by side.
layout(constant_id = 0) const uint LANES = GROUP / 2;
layout(local_size_x_id = 0) in;
const uint PAIRS = LANES < GROUP / 2 ? GROUP / 2 / LANES : 1;

// What each source sends, and where its row lies.
layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
// Of emitted or of reflected light.
layout(scalar, binding = 1) buffer Irradiance { vec3 irradiance[]; };
layout(scalar, binding = 2) buffer IrradianceError { vec3 irradiance_error[]; };
// [slot]
layout(scalar, binding = 3) readonly buffer Rows { KeptRow rows[]; };
layout(scalar, binding = 4) readonly buffer Chunks { uvec2 chunks[]; };
#ifdef FROM_RELIEF
// Light that the sources with a relief send by direction,
// [slot from first_slot on][emitted, reflected][direction].
layout(scalar, binding = 5) readonly buffer Exits { vec3 exits[]; };
// Words of struct Source.
layout(scalar, binding = 6) readonly buffer Sources { uint source_words[]; };
layout(scalar, binding = 7) readonly buffer Balls { vec4 balls[]; };
#endif
#ifdef TO_RELIEF
layout(scalar, binding = 8) readonly buffer MesoElements { MesoElement meso_elements[]; };
// Radiosity for each moment, [response][direction][colour].
layout(scalar, binding = 9) readonly buffer Albedos { vec3 albedos[]; };
// Moments ∫ L ω dω of the light that arrives, in the element's frame, [meso element][direction][colour].
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
#ifdef FROM_RELIEF
    uint first_relief_source;
    uint relief_source_count;
    uvec2 cells;              // of the directions' square
#endif
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Words { uint word[]; };

#include "shared/accumulate.glsl"
#ifdef FROM_RELIEF
#include "shared/sent.glsl"
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

// What a slot sends, and the place of its form factors.
struct Sent {
    vec3 light;
    uint source;
    float scale;
    uvec2 address;  // of the chunk with the factors
    uint block;     // where this block's factors start; 0: it sees nothing of the source
};

// Place of the n-th element in its block; past the block where there are more lanes than pairs.
uint in_block(uint n) {
    return 2 * (gl_LocalInvocationID.x + n / 2 * LANES) + n % 2;
}

// Light of which the element sees the share f.
void receive(inout Receiver receiver, FLUX f, vec3 light) {
#ifdef TO_RELIEF
    receiver.irradiance += f.z * light;
    uint directions = cells.x * cells.y;
    // A near source fills many slots: it is spread over the disc that sends the same light.
    Disc disc = disc_of(f);
    for (uint j = 0; j < disc.points; j++) {
        vec3 point = disc_point(disc, j);
        uint k = direction_of(point * inversesqrt(dot(point, point)), cells);
        uint at = 3 * (receiver.i * directions + k);
        uint response = 3 * (receiver.response * directions + k);
        for (uint c = 0; c < 3; c++) {
            moments[at + c] += light[c] * point;
            receiver.reflected[c] += dot(albedos[response + c], point) * light[c];
        }
    }
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
    uint first = source * SOURCE_WORDS;
    return Sender(LOAD4(source_words, first + 8).xyz, LOAD4(source_words, first + 12).xyz,
                  LOAD4(source_words, first + 4).xyz, LOAD4(source_words, first + 24).yzw);
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
    Sent sent = Sent(vec3(0.0), NONE, 1.0, uvec2(0), 0);
    if (slot < end_slot) {
        Slot shot = slots[slot];
        sent.light = reflected == 1 ? shot.reflected : shot.emitted;
        sent.source = shot.source;
        sent.scale = shot.scale;
    }
    bool sends = sent.light != vec3(0.0);
#ifdef FROM_RELIEF
    // What leaves by direction may sum to nothing.
    sends = sends || reflected == 1 && by_direction(sent.source);
#endif
    if (sends) {
        KeptRow row = rows[slot];
        sent.address = chunks[row.chunk];
        sent.block = Words(sent.address).word[row.first + first_block + gl_WorkGroupID.x];
        sent.block += sent.block == 0 ? 0 : row.first;
    }
    return sent;
}

Sent share(Sent sent, uint lane) {
    return Sent(subgroupBroadcast(sent.light, lane), subgroupBroadcast(sent.source, lane),
                subgroupBroadcast(sent.scale, lane), subgroupBroadcast(sent.address, lane),
                subgroupBroadcast(sent.block, lane));
}

// The two kept form factors of the n-th and the next element.
void kept_pair(Words words, uint block, uint n, out FLUX f[2]) {
    uint pair = in_block(n) < GROUP ? words.word[block + in_block(n) / 2] : 0;
    for (uint side = 0; side < 2; side++) {
        float factor = kept_factor(side == 0 ? pair & 0xffff : pair >> 16);
#ifdef TO_RELIEF
        uint direction = words.word[block + GROUP / 2 + in_block(n + side)];
        f[side] = factor == 0.0 ? vec3(0.0) : factor * kept_direction(direction);
#else
        f[side] = factor;
#endif
    }
}

void main() {
    Receiver receivers[2 * PAIRS];
    for (uint n = 0; n < 2 * PAIRS; n++) {
        uint i = GROUP * gl_WorkGroupID.x + in_block(n);
        bool inside = in_block(n) < GROUP && i < element_count;
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

    // Each lane looks up one slot and shares it with the others; slots of which the block sees nothing
    // are passed over.
    uint next = first_slot;
    while (next < end_slot) {
        // On to the next slots of which the block sees any, in a loop of its own: a software device
        // works through what a branch leaves out.
        uint first;
        Sent mine;
        uvec4 even;
        do {
            first = next;
            mine = look_up(first + gl_SubgroupInvocationID);
            even = subgroupBallot(mine.block != 0);
            next = first + LANES;
        } while (even == uvec4(0) && next < end_slot);
#ifdef FROM_RELIEF
        uvec4 directed = subgroupBallot(mine.block != 0 && by_direction(mine.source));
        even &= ~directed;
        while (any(notEqual(directed, uvec4(0)))) {
            uint lane = next_lane(directed);
            Sent sent = share(mine, lane);
            Sender s = sender(sent.source);
            for (uint n = 0; n < 2 * PAIRS; n += 2) {
                FLUX f[2];
                kept_pair(Words(sent.address), sent.block, n, f);
                for (uint side = 0; side < 2; side++) {
                    receive(receivers[n + side], sent.scale * f[side], sent_to(first + lane, s, receivers[n + side].middle));
                }
            }
        }
#endif
        while (any(notEqual(even, uvec4(0)))) {
            Sent sent = share(mine, next_lane(even));
            for (uint n = 0; n < 2 * PAIRS; n += 2) {
                FLUX f[2];
                kept_pair(Words(sent.address), sent.block, n, f);
                for (uint side = 0; side < 2; side++) {
                    receive(receivers[n + side], sent.scale * f[side], sent.light);
                }
            }
        }
    }

    for (uint n = 0; n < 2 * PAIRS; n++) {
        uint i = receivers[n].i;
        if (i == NONE) {
            continue;
        }
        uint e = first_element + i;
        accumulate(irradiance[e], irradiance_error[e], receivers[n].irradiance);
#ifdef TO_RELIEF
        accumulate(meso_reflected[i].sum, meso_reflected[i].error, receivers[n].reflected * meso_elements[i].scale);
#endif
    }
}
