// Every element adds up what the chosen sources send it: form factor times radiosity, the paper's equation (2) by reciprocity. One
// subgroup a block of GROUP elements, sources in slot order: no atomics, the same bits every run and for every size of subgroup.
// FROM_RELIEF: some sources send by direction. TO_RELIEF: the elements of this dispatch receive by direction.

#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#include "shared/types.glsl"
#include "shared/kept.glsl"
#ifdef FROM_RELIEF
#include "shared/directions.glsl"
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

// The batch's sources: fresh_slots that were just drawn, then kept ones.
layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
layout(scalar, binding = 1) readonly buffer Sources { Source sources[]; };
layout(scalar, binding = 2) readonly buffer Planes { vec4 planes[]; };
layout(scalar, binding = 3) readonly buffer Balls { vec4 balls[]; };
layout(scalar, binding = 4) buffer Direct { vec3 direct[]; };
layout(scalar, binding = 5) buffer DirectError { vec3 direct_error[]; };
layout(scalar, binding = 6) buffer Indirect { vec3 indirect[]; };
layout(scalar, binding = 7) buffer IndirectError { vec3 indirect_error[]; };
// Form factors that were passed over because the source lies behind the element's plane.
layout(scalar, binding = 8) buffer Behind { uint behind_count[]; };
// [slot][element of this dispatch]
layout(scalar, binding = 9) readonly buffer Fresh { FLUX fresh[]; };
layout(scalar, binding = 10) readonly buffer KeptRows { KeptRow kept_rows[]; };
layout(scalar, binding = 11) readonly buffer Chunks { uvec2 chunks[]; };

#ifdef FROM_RELIEF
// Light that the sources with a relief send by direction, [slot][emitted, reflected][direction].
layout(scalar, binding = 12) readonly buffer Exits { vec3 exits[]; };
#endif
#ifdef TO_RELIEF
layout(scalar, binding = 13) readonly buffer MesoElements { MesoElement meso_elements[]; };
// Radiosity for each moment, [response][direction][colour].
layout(scalar, binding = 14) readonly buffer Albedos { vec3 albedos[]; };
// Moments ∫ L ω dω of the light that arrives, in the element's frame, [meso element][direction][colour].
layout(scalar, binding = 15) buffer MomentsDirect { vec3 moments_direct[]; };
layout(scalar, binding = 16) buffer MomentsIndirect { vec3 moments_indirect[]; };
layout(scalar, binding = 17) buffer MesoReflected { Reflected meso_reflected[]; };
#endif

layout(push_constant, scalar) uniform Parameters {
    uint first_element;
    uint element_count;
    uint fresh_slots;
    uint slot_count;          // with kept ones
    uint first_block;
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

// What one element has received from the batch.
struct Received {
    vec3 direct;
    vec3 indirect;
#ifdef TO_RELIEF
    vec3 reflected;
#endif
};

#ifdef TO_RELIEF
// Light that comes from about one direction.
void receive_along(inout Received received, vec3 f, uint i, vec3 emitted, vec3 reflected) {
    uint directions = cells.x * cells.y;
    uint k = direction_of(f * inversesqrt(dot(f, f)), cells);
    uint at = 3 * (i * directions + k);
    uint response = 3 * (meso_elements[i].response * directions + k);
    bool emits = emitted != vec3(0.0);
    bool reflects = reflected != vec3(0.0);
    for (uint c = 0; c < 3; c++) {
        if (emits) {
            moments_direct[at + c] += emitted[c] * f;
        }
        if (reflects) {
            moments_indirect[at + c] += reflected[c] * f;
        }
        received.reflected[c] += dot(albedos[response + c], f) * (emitted[c] + reflected[c]);
    }
}
#endif

// Light of one source, of which the element sees the share f.
void receive(inout Received received, FLUX f, uint i, vec3 emitted, vec3 reflected) {
#ifdef TO_RELIEF
    // A near source fills many slots: it is spread over the disc that sends the same light.
    Disc disc = disc_of(f);
    for (uint j = 0; j < disc.points; j++) {
        receive_along(received, disc_point(disc, j), i, emitted, reflected);
    }
    received.direct += f.z * emitted;
    received.indirect += f.z * reflected;
#else
    received.direct += f * emitted;
    received.indirect += f * reflected;
#endif
}

// The n-th element of this invocation, of those of the dispatch.
struct Receiver {
    uint i;         // NONE: past the last one
    vec3 middle;
    uint behind;
    Received received;
};

// Place of the n-th element in its block; past the block where there are more lanes than pairs.
uint in_block(uint n) {
    return 2 * (gl_LocalInvocationID.x + n / 2 * LANES) + n % 2;
}

// Light of the source in a slot, of which the element sees the share f.
void receive_from(uint slot, Slot shot, FLUX f, inout Receiver receiver) {
#ifdef FROM_RELIEF
    if (shot.source - first_relief_source < relief_source_count) {
        Source s = sources[shot.source];
        vec3 d = receiver.middle - s.middle;
        vec3 local = vec3(dot(d, s.tangent), dot(d, s.bitangent), dot(d, s.normal)) * inversesqrt(max(dot(d, d), 1e-38));
        send_by_direction(slot, local, shot.emitted, shot.reflected);
    }
#endif
    receive(receiver.received, shot.scale * f, receiver.i, shot.emitted, shot.reflected);
}

void main() {
    Receiver receivers[2 * PAIRS];
    for (uint n = 0; n < 2 * PAIRS; n++) {
        uint i = GROUP * gl_WorkGroupID.x + in_block(n);
        bool inside = in_block(n) < GROUP && i < element_count;
        receivers[n].i = inside ? i : NONE;
        receivers[n].middle = inside ? balls[first_element + i].xyz : vec3(0.0);
        receivers[n].behind = 0;
        receivers[n].received.direct = vec3(0.0);
        receivers[n].received.indirect = vec3(0.0);
#ifdef TO_RELIEF
        receivers[n].received.reflected = vec3(0.0);
#endif
    }

    // Fresh form factors. These and kept ones each fill their slots from the first on.
    for (uint slot = 0; slot < fresh_slots && slots[slot].source != NONE; slot++) {
        Slot shot = slots[slot];
        vec3 eye = sources[shot.source].eye;
        float radius = sources[shot.source].radius;
        for (uint n = 0; n < 2 * PAIRS; n++) {
            uint i = receivers[n].i;
            if (i != NONE) {
                receivers[n].behind += dot(receivers[n].middle - eye, planes[first_element + i].xyz) >= radius ? 1 : 0;
                receive_from(slot, shot, fresh[slot * element_count + i], receivers[n]);
            }
        }
    }

    // Kept ones. Each lane looks up one slot and shares it with the others; slots of which the block sees nothing are passed over.
    for (uint first = fresh_slots; first < slot_count && slots[first].source != NONE; first += LANES) {
        uint mine = first + gl_SubgroupInvocationID;
        Slot shot = Slot(vec3(0.0), NONE, vec3(0.0), 1.0);
        if (mine < slot_count) {
            shot = slots[mine];
        }
        uvec2 address = uvec2(0);
        uint block = 0;
        if (shot.source != NONE) {
            KeptRow row = kept_rows[shot.source];
            address = chunks[row.chunk];
            block = Words(address).word[row.first + first_block + gl_WorkGroupID.x];
            block += block == 0 ? 0 : row.first;
        }
        uvec4 seen = subgroupBallot(block != 0);
        while (any(notEqual(seen, uvec4(0)))) {
            uint lane = subgroupBallotFindLSB(seen);
            seen[lane / 32] &= ~(1u << (lane % 32));
            Words words = Words(subgroupBroadcast(address, lane));
            uint at = subgroupBroadcast(block, lane);
            Slot sent = Slot(
                subgroupBroadcast(shot.emitted, lane),
                subgroupBroadcast(shot.source, lane),
                subgroupBroadcast(shot.reflected, lane),
                subgroupBroadcast(shot.scale, lane)
            );
            for (uint n = 0; n < 2 * PAIRS; n += 2) {
                uint pair = in_block(n) < GROUP ? words.word[at + in_block(n) / 2] : 0;
                for (uint side = 0; side < 2; side++) {
                    float share = kept_factor(side == 0 ? pair & 0xffff : pair >> 16);
#ifdef TO_RELIEF
                    FLUX f = share == 0.0 ? vec3(0.0) : share * kept_direction(words.word[at + GROUP / 2 + in_block(n + side)]);
#else
                    FLUX f = share;
#endif
                    receive_from(first + lane, sent, f, receivers[n + side]);
                }
            }
        }
    }

    for (uint n = 0; n < 2 * PAIRS; n++) {
        uint i = receivers[n].i;
        if (i == NONE) {
            continue;
        }
        Received received = receivers[n].received;
        behind_count[first_element + i] += receivers[n].behind;
        accumulate(first_element + i, received.direct, received.indirect);
#ifdef TO_RELIEF
        accumulate_reflected(i, received.reflected * meso_elements[i].scale);
#endif
    }
}
