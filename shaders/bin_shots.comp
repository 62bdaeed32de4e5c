// The paper's equations (1) to (4): one invocation a pixel of the item buffers. It adds what the
// patch sends through it, ΔB_iq ΔF_q A_i, to the item: to the power that it receives, and where it
// has a relief, to the incoming direction nearest to iq and to the outgoing directions less than
// 90° from the texel's normal. Most directions are; those that are not are summed instead, and
// taken from the whole where it is read.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_atomic_int64 : require
#include "shared/types.glsl"
#include "shared/hemicube.glsl"
#include "shared/directions.glsl"
#include "shared/texels.glsl"
#include "shared/shots.glsl"

layout(local_size_x = GROUP) in;

// [slot]
layout(binding = 0) uniform usamplerBuffer shots;
layout(binding = 1) uniform usampler2D items;
layout(binding = 2) uniform usamplerBuffer planes;
layout(binding = 3) uniform usamplerBuffer balls;
// Of a surface's form factor, then of a point's share of half the sphere; each [3 n][n].
layout(binding = 4) uniform usamplerBuffer deltas;
// [element][RECEIVED_SUMS]; of elements without relief.
layout(scalar, binding = 5) buffer Received { uint64_t received[]; };
// [patch with relief]
layout(binding = 6) uniform usamplerBuffer patches;
layout(binding = 7) uniform usamplerBuffer texels;
// Middles of the directions.
layout(binding = 8) uniform usamplerBuffer direction_list;
// Reflected radiosity by direction, [slot][direction].
layout(binding = 9) uniform usamplerBuffer exits;
// [patch with relief][direction][RECEIVED_SUMS]
layout(scalar, binding = 10) buffer Incoming { uint64_t incoming[]; };
// [patch with relief][REFLECTED_SUMS]
layout(scalar, binding = 11) buffer ReflectedSums { uint64_t reflected[]; };
// Reflected power that does not leave in a direction, [patch with relief][direction][colour].
layout(scalar, binding = 12) buffer Hidden { uint64_t hidden[]; };

layout(push_constant, scalar) uniform Parameters {
    uint face_size;
    uint first_relief;        // element
    uvec2 cells;              // of the directions' square
};

struct Power {
    uint64_t r;
    uint64_t g;
    uint64_t b;
};

// To the nearest unit.
Power in_units(vec3 power) {
    i64vec3 units = i64vec3(power + 0.5);
    return Power(uint64_t(units.r), uint64_t(units.g), uint64_t(units.b));
}

#define ADD(sums, at, power) { \
    uint first_sum = at; \
    atomicAdd(sums[first_sum], (power).r); \
    atomicAdd(sums[first_sum + 1], (power).g); \
    atomicAdd(sums[first_sum + 2], (power).b); \
}

// The direction whose middle is nearest: its cell or one of those about it.
uint nearest(vec3 to) {
    vec2 at = (to_square(to) * 0.5 + 0.5) * vec2(cells);
    uvec2 cell = min(uvec2(at), cells - 1);
    uint best = 0;
    float largest = -2.0;
    for (uint i = 0; i < 9; i++) {
        ivec2 next = ivec2(cell) + ivec2(i % 3, i / 3) - 1;
        uvec2 place = uvec2(clamp(next, ivec2(0), ivec2(cells) - 1));
        uint k = place.y * cells.x + place.x;
        float cosine = dot(fetch(direction_list, k).xyz, to);
        best = cosine > largest ? k : best;
        largest = max(largest, cosine);
    }
    return best;
}

// What the patch of the slot reflects towards `to`, in the frame of its directions.
vec3 reflected_towards(uint slot, vec3 to) {
    Look at = look(to, cells);
    uint first = slot * cells.x * cells.y;
    vec3 sent = vec3(0.0);
    for (uint i = 0; i < 4; i++) {
        sent += at.weight[i] * fetch(exits, first + at.k[i]).xyz;
    }
    return sent;
}

void main() {
    uint pixel = gl_GlobalInvocationID.x;
    uint slot = gl_WorkGroupID.y;
    uint count = 3 * face_size * face_size;
    uint first = SHOT_TEXELS * slot;
    uvec4 turned = fetch_words(shots, first + 1);
    if (pixel >= count || turned.w == NONE) {
        return;
    }
    ivec2 at = ivec2(pixel % face_size, pixel / face_size);
    uint item = texelFetch(items, at + ivec2(slot * face_size, 0), 0).r;
    if (item == NONE) {
        return;
    }
    vec4 eye = fetch(shots, first);
    vec4 plane = fetch(planes, item);
    float above = dot(plane.xyz, eye.xyz) - plane.w;
    // A back blocks light and takes none.
    if (above <= 0.0) {
        return;
    }
    uvec4 across = fetch_words(shots, first + 2);
    uvec4 axis = fetch_words(shots, first + 3);
    vec3 normal = uintBitsToFloat(axis.xyz);
    vec3 local = normalize(hemicube_direction(at, face_size));
    vec3 ray = uintBitsToFloat(turned.xyz) * local.x + uintBitsToFloat(across.xyz) * local.y
             + normal * local.z;
    vec3 emitted = fetch(shots, first + 4).xyz;
    vec3 sent = fetch(shots, first + 5).xyz;
    if (axis.w == 1) {
        vec3 u = fetch(shots, first + 6).xyz;
        vec3 v = fetch(shots, first + 7).xyz;
        sent = reflected_towards(slot, vec3(dot(u, ray), dot(v, ray), local.z));
    }
    uint entry = (across.w == KIND_POINT ? count : 0) + pixel;
    float power = eye.w * fetch(deltas, entry / 4)[entry % 4];
    bool emits = emitted != vec3(0.0);
    Power direct = in_units(power * emitted);
    Power indirect = in_units(power * sent);
    if (item < first_relief) {
        if (emits) {
            ADD(received, RECEIVED_SUMS * item, direct)
        }
        ADD(received, RECEIVED_SUMS * item + 3, indirect)
        return;
    }

    uint m = item - first_relief;
    uint directions = cells.x * cells.y;
    vec4 columns = fetch(patches, PATCH_TEXELS * m);
    vec4 rows = fetch(patches, PATCH_TEXELS * m + 1);
    uvec4 tangent = fetch_words(patches, PATCH_TEXELS * m + 2);
    uvec4 bitangent = fetch_words(patches, PATCH_TEXELS * m + 3);
    vec3 from = -vec3(dot(uintBitsToFloat(tangent.xyz), ray),
                      dot(uintBitsToFloat(bitangent.xyz), ray), dot(plane.xyz, ray));
    uint place = RECEIVED_SUMS * (m * directions + nearest(from));
    if (emits) {
        ADD(incoming, place, direct)
    }
    ADD(incoming, place + 3, indirect)

    // The half texel at the place: a point of the field stands for the middle of its texel.
    vec3 there = eye.xyz - fetch(balls, item).xyz + ray * (above / from.z);
    vec2 size = vec2(bitangent.w & 0xffff, bitangent.w >> 16);
    vec2 texel = vec2(dot(columns.xyz, there) + columns.w, dot(rows.xyz, there) + rows.w);
    vec2 cell = floor(texel);
    vec2 within = texel - cell;
    uvec2 wrapped = min(uvec2(cell - size * floor(cell / size)), uvec2(size) - 1);
    uint facet = 2 * (wrapped.y * uint(size.x) + wrapped.x) + (within.x + within.y > 1.0 ? 1 : 0);
    vec4 reflectance = fetch(texels, RELIEF_TEXELS * (tangent.w + facet));
    uvec2 bits = fetch_words(texels, RELIEF_TEXELS * (tangent.w + facet) + 1).xy;
    vec3 brought = power * (emitted + sent) * reflectance.xyz;
    Power leaving = in_units(brought);
    ADD(reflected, REFLECTED_SUMS * m, leaving)
    ADD(reflected, REFLECTED_SUMS * m + 3, in_units(reflectance.w * brought))
    for (uint word = 0; word < 2; word++) {
        uint left = bits[word];
        while (left != 0) {
            uint k = 32 * word + findLSB(left);
            left &= left - 1;
            ADD(hidden, 3 * (m * directions + k), leaving)
        }
    }
}
