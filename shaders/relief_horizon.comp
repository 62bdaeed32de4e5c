// The horizon of every facet of a relief: in each azimuth, the tangent of the elevation below which
// the relief itself blocks the sky. One invocation a facet and azimuth.
// src/reference/relief_visibility.rs is the same in f64.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Heights { float heights[]; };
// [facet][azimuth]
layout(scalar, binding = 1) writeonly buffer Horizons { float horizons[]; };

#include "shared/relief.glsl"

// Slopes below this hide less than a tenth of the lowest ring of directions.
const float LEAST_SLOPE = 0.01;

void main() {
    uint item = gl_GlobalInvocationID.x;
    if (item >= count) {
        return;
    }
    item += first;
    Facet facet = facet_of(item / AZIMUTHS);
    float angle = 6.28318531 * float(item % AZIMUTHS) / float(AZIMUTHS);
    vec2 step = vec2(cos(angle), sin(angle) / aspect);
    Crossings crossings = crossings_begin(facet.centre.xy, step);
    float slope = -NEVER;
    for (uint i = 0; i < MOST_CROSSINGS; i++) {
        float distance = crossings_next(crossings);
        float rise = height_at(facet.centre.xy + distance * step) - facet.centre.z;
        slope = max(slope, rise / distance);
        if (highest - facet.centre.z <= distance * max(slope, LEAST_SLOPE)) {
            break;
        }
    }
    horizons[item] = slope;
}
