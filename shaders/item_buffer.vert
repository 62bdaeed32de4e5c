// One face of a hemicube: reversed infinite depth, so that near wins and the far end of the scene
// never clips.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.glsl"

layout(location = 0) in vec3 position;

layout(scalar, binding = 0) readonly buffer Views { View views[]; };

layout(push_constant, scalar) uniform Parameters {
    uint region;         // slot · FACES + face
    uint first_item;
    float near;
    vec2 half_size;      // of the face, pixels
};

// Steps of a pixel that corners are moved to. What the rasteriser rounds them to then does not
// depend on where in the image the slot lies, and a source's item buffer is the same in every slot.
const float STEPS = 256.0;

void main() {
    View v = views[region];
    vec3 d = position - v.eye;
    vec2 xy = vec2(dot(d, v.x), dot(d, v.y));
    float w = dot(d, v.w);
    vec2 grid = STEPS * half_size;
    gl_Position = vec4(w > near ? round(xy / w * grid) / grid * w : xy, near, w);
}
