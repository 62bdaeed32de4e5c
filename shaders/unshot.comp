// The power that each patch has reflected and not sent yet. One invocation a source.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.glsl"
#include "shared/texels.glsl"
#include "shared/shots.glsl"

layout(local_size_x = GROUP) in;

layout(binding = 0) uniform usamplerBuffer sources;
layout(scalar, binding = 1) readonly buffer Reflectances { vec3 reflectance[]; };
layout(scalar, binding = 2) readonly buffer Received { uint64_t received[]; };
layout(scalar, binding = 3) readonly buffer ReflectedSums { uint64_t reflected[]; };
layout(scalar, binding = 4) readonly buffer Sent { uint64_t sent[]; };
// [source], RGB
layout(scalar, binding = 5) writeonly buffer Unshot { vec3 unshot[]; };

layout(push_constant, scalar) uniform Parameters {
    uint source_count;
    uint first_relief;        // element
    float unit;               // units of a power of 1
};

void main() {
    uint s = gl_GlobalInvocationID.x;
    if (s >= source_count) {
        return;
    }
    vec3 power = vec3(0.0);
    // Texels of struct Source: a light without elements has none.
    bool surface = fetch_words(sources, SOURCE_TEXELS * s + 4).w == KIND_SURFACE;
    if (surface) {
        uint e = fetch_words(sources, SOURCE_TEXELS * s + 5).x;
        for (uint c = 0; c < 3; c++) {
            uint64_t before = sent[3 * e + c];
            uint at = RECEIVED_SUMS * e + c;
            power[c] = e >= first_relief
                ? float(reflected[REFLECTED_SUMS * (e - first_relief) + 3 + c] - before)
                : reflectance[e][c] * float(received[at] + received[at + 3] - before);
        }
    }
    unshot[s] = power / unit;
}
