// What lies over a surface in a window: outlines of elements, colours of sources and the element
// that is marked. Colours are premultiplied with their alpha.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shared/view_parameters.glsl"

layout(location = 0) in vec3 corner_share;
layout(location = 1) flat in uint corner_triangle;

layout(location = 0) out vec4 code;

// A hue for a number; neighbours differ.
vec3 hue(uint number) {
    float turn = fract(float(number) * 0.61803399);
    return clamp(abs(fract(turn + vec3(1.0, 2.0 / 3.0, 1.0 / 3.0)) * 6.0 - 3.0) - 1.0, 0.0, 1.0);
}

vec4 over(vec4 below, vec3 colour, float alpha) {
    return mix(below, vec4(colour, 1.0), alpha);
}

void main() {
    About own = about[corner_triangle];
    code = vec4(0.0);
    if (sources > 0.0) {
        code = over(code, hue(own.source), 0.45 * sources);
    }
    // Pixels to the nearest edge.
    vec3 to_edge = corner_share / max(fwidth(corner_share), vec3(1e-6));
    float edge = min(to_edge.x, min(to_edge.y, to_edge.z));
    if (elements > 0.0) {
        // Edges closer together than a few pixels fade, or the far end of a fine mesh would be
        // black.
        float widest = max(fwidth(corner_share).x, max(fwidth(corner_share).y, fwidth(corner_share).z));
        float seen = elements * clamp(1.0 - 3.0 * widest, 0.0, 1.0);
        code = over(code, vec3(0.0), 0.6 * seen * clamp(1.2 - edge, 0.0, 1.0));
    }
    if (own.triangle == chosen) {
        code = over(code, vec3(1.0, 0.6, 0.1), edge < 2.0 ? 1.0 : 0.25);
    }
}
