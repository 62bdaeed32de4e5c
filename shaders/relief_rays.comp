// Segments over height maps, for tests and timings of shared/height_march.glsl. One invocation a
// segment. src/reference/relief_rays.rs is the same in f64, without the pyramid.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shared/types.glsl"
#include "shared/texels.glsl"

layout(local_size_x = GROUP) in;

// See shared/height_march.glsl.
layout(constant_id = 0) const uint LEVELS = 1;

layout(scalar, binding = 0) readonly buffer Tiles { HeightTile tiles[]; };
layout(binding = 1) uniform usamplerBuffer pyramid;
layout(scalar, binding = 2) readonly buffer Rays { HeightRay rays[]; };
layout(scalar, binding = 3) writeonly buffer Hits { HeightHit hits[]; };

layout(push_constant, scalar) uniform Parameters {
    uint first;       // of the rays of this dispatch
    uint count;
};

#include "shared/height_march.glsl"

void main() {
    if (gl_GlobalInvocationID.x >= count) {
        return;
    }
    uint item = first + gl_GlobalInvocationID.x;
    HeightRay ray = rays[item];
    HeightHit hit;
    march(tiles[ray.tile], ray.from, ray.to, hit);
    hits[item] = hit;
}
