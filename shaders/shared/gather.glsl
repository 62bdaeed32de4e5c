// Every element adds up what the chosen sources send it: form factor times radiosity, the paper's equation (2) by reciprocity. One
// invocation an element, sources in slot order: no atomics, the same bits every run. FROM_RELIEF: some sources send by
// direction. TO_RELIEF: the elements of this dispatch receive by direction.

#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#include "shared/types.glsl"
#include "shared/kept.glsl"
#ifdef FROM_RELIEF
#include "shared/directions.glsl"
#endif
#ifdef TO_RELIEF
#define FLUX vec3
#else
#define FLUX float
#endif

layout(local_size_x = GROUP) in;

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

// The form factor (a vector in the element's frame for TO_RELIEF) of a source that was drawn before.
FLUX replayed(uint source) {
    KeptRow row = kept_rows[source];
    Words words = Words(chunks[row.chunk]);
    uint block = words.word[row.first + first_block + gl_WorkGroupID.x];
    if (block == 0) {
        return FLUX(0.0);
    }
    uint lane = gl_LocalInvocationID.x;
    block += row.first;
    uint pair = words.word[block + lane / 2];
    float f = kept_factor((lane & 1) == 0 ? pair & 0xffff : pair >> 16);
#ifdef TO_RELIEF
    return f == 0.0 ? vec3(0.0) : f * kept_direction(words.word[block + GROUP / 2 + lane]);
#else
    return f;
#endif
}

#ifdef FROM_RELIEF
// What a source with a relief sends towards a place: the slot's own light, by direction.
void send_by_direction(uint slot, Source s, vec3 to, inout vec3 emitted, inout vec3 reflected) {
    vec3 d = to - s.middle;
    vec3 local = vec3(dot(d, s.tangent), dot(d, s.bitangent), dot(d, s.normal)) * inversesqrt(max(dot(d, d), 1e-38));
    Look at = look(local, cells);
    uint count = cells.x * cells.y;
    uint first = 2 * slot * count;
    bool emits = emitted != vec3(0.0);
    emitted = vec3(0.0);
    reflected = vec3(0.0);
    for (uint i = 0; i < 4; i++) {
        if (emits) {
            emitted += at.weight[i] * exits[first + at.k[i]];
        }
        reflected += at.weight[i] * exits[first + count + at.k[i]];
    }
}
#endif

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= element_count) {
        return;
    }
    uint e = first_element + i;
    vec3 middle = balls[e].xyz;
    vec3 n = planes[e].xyz;
    vec3 add_direct = vec3(0.0);
    vec3 add_indirect = vec3(0.0);
    uint behind = 0;
#ifdef TO_RELIEF
    MesoElement meso = meso_elements[i];
    uint directions = cells.x * cells.y;
    vec3 add_reflected = vec3(0.0);
#endif
    for (uint slot = 0; slot < slot_count; slot++) {
        Slot shot = slots[slot];
        if (shot.source == NONE) {
            // Fresh and kept ones each fill their slots from the first on.
            if (slot >= fresh_slots) {
                break;
            }
            slot = fresh_slots - 1;
            continue;
        }
        bool is_fresh = slot < fresh_slots;
        FLUX f;
        if (is_fresh) {
            f = fresh[slot * element_count + i];
            behind += dot(middle - sources[shot.source].eye, n) >= sources[shot.source].radius ? 1 : 0;
        } else {
            f = replayed(shot.source);
        }
        if (f == FLUX(0.0)) {
            continue;
        }
        vec3 emitted = shot.emitted;
        vec3 reflected = shot.reflected;
#ifdef FROM_RELIEF
        if (shot.source - first_relief_source < relief_source_count) {
            send_by_direction(slot, sources[shot.source], middle, emitted, reflected);
        }
#endif
#ifdef TO_RELIEF
        uint k = direction_of(f * inversesqrt(dot(f, f)), cells);
        uint at = 3 * (i * directions + k);
        uint response = 3 * (meso.response * directions + k);
        bool emits = emitted != vec3(0.0);
        bool reflects = reflected != vec3(0.0);
        for (uint c = 0; c < 3; c++) {
            if (emits) {
                moments_direct[at + c] += emitted[c] * f;
            }
            if (reflects) {
                moments_indirect[at + c] += reflected[c] * f;
            }
            add_reflected[c] += dot(albedos[response + c], f) * (emitted[c] + reflected[c]);
        }
        add_direct += f.z * emitted;
        add_indirect += f.z * reflected;
#else
        add_direct += f * emitted;
        add_indirect += f * reflected;
#endif
    }
    behind_count[e] += behind;
    accumulate(e, add_direct, add_indirect);
#ifdef TO_RELIEF
    precise vec3 y = add_reflected * meso.scale - meso_reflected[i].error;
    precise vec3 sum = meso_reflected[i].sum;
    precise vec3 total = sum + y;
    precise vec3 error = (total - sum) - y;
    meso_reflected[i] = Reflected(total, error);
#endif
}
