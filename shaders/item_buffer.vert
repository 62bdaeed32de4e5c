// One face of a hemicube: reversed infinite depth, so that near wins and the far end of the scene never clips.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.glsl"

layout(location = 0) in vec3 position;

layout(scalar, binding = 0) readonly buffer Views { View views[]; };

layout(push_constant, scalar) uniform Parameters {
    uint region;         // slot · FACES + face
    uint first_item;
    float near;
};

void main() {
    View v = views[region];
    vec3 d = position - v.eye;
    gl_Position = vec4(dot(d, v.x), dot(d, v.y), near, dot(d, v.w));
}
