// What the chosen patches shoot: all that they have not sent yet, the paper's ΔB_i, by direction
// where they have a relief. One workgroup a slot, one invocation a direction.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.glsl"
#include "shared/texels.glsl"
#include "shared/shots.glsl"

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
layout(scalar, binding = 1) readonly buffer Sources { Source sources[]; };
layout(scalar, binding = 2) readonly buffer Reflectances { vec3 reflectance[]; };
layout(scalar, binding = 3) readonly buffer Received { uint64_t received[]; };
layout(scalar, binding = 4) readonly buffer ReflectedSums { uint64_t reflected[]; };
layout(scalar, binding = 5) readonly buffer Hidden { uint64_t hidden[]; };
layout(binding = 6) uniform usamplerBuffer patches;
// Received by then, or the share that leaves of what is reflected, [element][colour].
layout(scalar, binding = 7) buffer Sent { uint64_t sent[]; };
// [patch with relief][direction][colour]
layout(scalar, binding = 8) buffer SentBy { uint64_t sent_by[]; };
layout(scalar, binding = 9) writeonly buffer Shots { Shot shots[]; };
// Reflected radiosity by direction, [slot][direction], a texel each.
layout(scalar, binding = 10) writeonly buffer Exits { vec4 exits[]; };

layout(push_constant, scalar) uniform Parameters {
    uint first_relief;        // element
    uint directions;
    float unit;               // units of a power of 1
};

void main() {
    uint slot = gl_WorkGroupID.x;
    uint j = gl_LocalInvocationID.x;
    Slot wanted = slots[slot];
    Shot shot;
    shot.source = wanted.source;
    if (wanted.source == NONE) {
        if (j == 0) {
            shots[slot] = shot;
        }
        return;
    }
    Source s = sources[wanted.source];
    uint e = s.first_element;
    bool surface = s.kind == KIND_SURFACE;
    bool relief = surface && e >= first_relief;
    float per_area = surface ? 1.0 / (unit * s.area) : 0.0;
    uint m = e - first_relief;
    if (relief && j < directions) {
        vec3 radiosity = vec3(0.0);
        for (uint c = 0; c < 3; c++) {
            uint at = 3 * (m * directions + j) + c;
            uint64_t leaving = reflected[REFLECTED_SUMS * m + c] - hidden[at];
            radiosity[c] = float(leaving - sent_by[at]) * per_area;
            sent_by[at] = leaving;
        }
        exits[slot * directions + j] = vec4(radiosity, 0.0);
    }
    if (j != 0) {
        return;
    }
    shot.eye = s.eye;
    // A point light sends intensity · solid angle; its table holds shares of 2π.
    shot.power = unit * (surface ? s.area : 6.28318531);
    shot.tangent = s.tangent;
    shot.bitangent = s.bitangent;
    shot.kind = s.kind;
    shot.normal = s.normal;
    shot.by_direction = relief ? 1 : 0;
    shot.emitted = wanted.emitted;
    shot.reflected = vec3(0.0);
    for (uint c = 0; surface && c < 3; c++) {
        uint at = RECEIVED_SUMS * e + c;
        uint64_t all = relief ? reflected[REFLECTED_SUMS * m + 3 + c] : received[at] + received[at + 3];
        float unsent = float(all - sent[3 * e + c]) * per_area;
        shot.reflected[c] = relief ? 0.0 : reflectance[e][c] * unsent;
        sent[3 * e + c] = all;
    }
    if (relief) {
        shot.along_u = fetch(patches, PATCH_TEXELS * m + 2).xyz;
        shot.along_v = fetch(patches, PATCH_TEXELS * m + 3).xyz;
    }
    shots[slot] = shot;
}
