// The ID of the element seen. No inputs but the primitive's number: some drivers misplace it beside
// others.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.glsl"

layout(location = 0) out uint item;

layout(scalar, binding = 1) readonly buffer Items { uint drawn_items[]; };

layout(push_constant, scalar) uniform Parameters {
    uint region;
    uint first_item;
    float near;
    vec2 half_size;
};

void main() {
    item = drawn_items[first_item + gl_PrimitiveID];
}
