// Where the rays land that a facet of a relief sends out, cosine-weighted about its normal: the
// facet that each hits, NONE for the sky. One invocation a facet and ray.
// src/reference/relief_visibility.rs is the same in f64.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Heights { float heights[]; };
// [facet][ray]
layout(scalar, binding = 1) writeonly buffer Hits { uint hits[]; };

#include "shared/relief.glsl"

// A number in 0..1 for a facet and a dimension (PCG, O'Neill 2014).
float random(uint facet, uint dimension) {
    uint state = (2 * facet + dimension) * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28) + 4)) ^ state) * 277803737u;
    return float(((word >> 22) ^ word) >> 8) / 16777216.0;
}

void main() {
    uint item = gl_GlobalInvocationID.x;
    if (item >= count) {
        return;
    }
    item += first;
    uint self = item / (RAY_STRATA * RAY_STRATA);
    uint ray = item % (RAY_STRATA * RAY_STRATA);
    Facet facet = facet_of(self);

    // A cell of the unit square with an offset of the facet's own, taken to the disk and up to the
    // hemisphere (Malley).
    vec2 square = (vec2(ray % RAY_STRATA, ray / RAY_STRATA) + vec2(random(self, 0), random(self, 1))) / float(RAY_STRATA);
    float radius = sqrt(square.x);
    float angle = 6.28318531 * square.y;
    vec3 n = facet.normal;
    vec3 tangent = vec3(n.z, 0.0, -n.x) * inversesqrt(n.z * n.z + n.x * n.x);
    vec3 direction = radius * (cos(angle) * tangent + sin(angle) * cross(n, tangent)) + sqrt(1.0 - square.x) * n;

    vec2 step = vec2(direction.x, direction.y / aspect);
    Crossings crossings = crossings_begin(facet.centre.xy, step);
    float before = 0.0;
    uint hit = NONE;
    for (uint i = 0; i < MOST_CROSSINGS; i++) {
        float distance = crossings_next(crossings);
        if (distance >= NEVER) {
            break;
        }
        vec2 at = facet.centre.xy + distance * step;
        float z = facet.centre.z + distance * direction.z;
        if (z < height_at(at)) {
            uint found = facet_at(facet.centre.xy + 0.5 * (before + distance) * step);
            if (found != self) {
                hit = found;
                break;
            }
        }
        if (direction.z > 0.0 && z > highest) {
            break;
        }
        before = distance;
    }
    hits[item] = hit;
}
