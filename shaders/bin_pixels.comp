// The paper's equation (1): every pixel adds its delta form factor to the item that it sees. One
// invocation a pixel; integer sums, so that their order does not matter.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_atomic_int64 : require
#include "shared/types.glsl"

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Slots { Slot slots[]; };
layout(scalar, binding = 1) readonly buffer Sources { Source sources[]; };
// Fixed point, FIXED_POINT_BITS: of a surface's form factor, then of a point's share of half the
// sphere; each [3 n][n].
layout(scalar, binding = 2) readonly buffer Deltas { uint64_t deltas[]; };
layout(scalar, binding = 3) buffer FormFactors { uint64_t form_factors[]; };
layout(scalar, binding = 4) readonly buffer Planes { vec4 planes[]; };
layout(binding = 5) uniform usampler2D items;

layout(push_constant, scalar) uniform Parameters {
    uint element_count;
    uint face_size;
};

void main() {
    uint pixel = gl_GlobalInvocationID.x;
    uint slot = gl_WorkGroupID.y;
    uint count = 3 * face_size * face_size;
    if (pixel >= count || slots[slot].source == NONE) {
        return;
    }
    ivec2 at = ivec2(slot * face_size + pixel % face_size, pixel / face_size);
    uint item = texelFetch(items, at, 0).r;
    if (item == NONE) {
        return;
    }
    // A back blocks light and takes none.
    uint source = slots[slot].source;
    vec4 plane = planes[item];
    if (dot(plane.xyz, sources[source].eye) <= plane.w) {
        return;
    }
    uint table = sources[source].kind == KIND_POINT ? count : 0;
    atomicAdd(form_factors[slot * element_count + item], deltas[table + pixel]);
}
