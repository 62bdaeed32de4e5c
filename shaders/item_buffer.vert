// One face of a hemicube: reversed infinite depth, so that near wins and the far end of the scene
// never clips.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.glsl"

layout(location = 0) flat out uint drawn_item;

layout(scalar, binding = 0) readonly buffer Views { View views[]; };
// [triangle]
layout(scalar, binding = 1) readonly buffer Items { uint drawn_items[]; };
// [triangle][corner]
layout(scalar, binding = 2) readonly buffer Corners { uint drawn_corners[]; };
layout(scalar, binding = 3) readonly buffer Vertices { vec3 vertices[]; };

layout(push_constant, scalar) uniform Parameters {
    uint region;         // slot · FACES + face
    float near;
    vec2 half_size;      // of the face, pixels
};

// Steps of a pixel that corners are moved to. What the rasteriser rounds them to then does not
// depend on where in the image the slot lies, and a source's item buffer is the same in every slot.
const float STEPS = 256.0;

void main() {
    drawn_item = drawn_items[gl_VertexIndex / 3];
    View v = views[region];
    vec3 d = vertices[drawn_corners[gl_VertexIndex]] - v.eye;
    vec2 xy = vec2(dot(d, v.x), dot(d, v.y));
    float w = dot(d, v.w);
    vec2 grid = STEPS * half_size;
    gl_Position = vec4(w > near ? round(xy / w * grid) / grid * w : xy, near, w);
}
