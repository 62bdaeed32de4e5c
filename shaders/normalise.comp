// In an enclosed scene all that a source sends arrives. Its form factors were found one by one,
// from samples: this sums each fresh slot's, and scales them so that together they take the whole
// source. One workgroup a slot. src/reference/normalise.rs is the same in f64.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.glsl"

layout(local_size_x = SELECT_GROUP) in;

layout(scalar, binding = 0) buffer Slots { Slot slots[]; };
layout(scalar, binding = 1) readonly buffer Sources { Source sources[]; };
layout(scalar, binding = 2) readonly buffer Areas { float element_area[]; };
// [slot][element], of elements without and with relief.
layout(scalar, binding = 3) readonly buffer Fresh { float fresh[]; };
layout(scalar, binding = 4) readonly buffer FreshMeso { vec3 fresh_meso[]; };

// Share of the source that its form factors take together, [slot].
layout(scalar, binding = 5) writeonly buffer Shares { float shares[]; };

layout(push_constant, scalar) uniform Parameters {
    uint plain_count;
    uint meso_count;
    uint scales;         // 0: the sums are found, and nothing is scaled
};

// A sum further off than this is no error of sampling: the source stands inside another body.
const float MOST_OFF = 0.05;

shared float sums[SELECT_GROUP];

void main() {
    uint slot = gl_WorkGroupID.x;
    uint lane = gl_LocalInvocationID.x;
    uint source = slots[slot].source;
    if (source == NONE) {
        return;
    }
    float sum = 0.0;
    for (uint i = lane; i < plain_count; i += SELECT_GROUP) {
        sum += element_area[i] * fresh[slot * plain_count + i];
    }
    for (uint i = lane; i < meso_count; i += SELECT_GROUP) {
        sum += element_area[plain_count + i] * fresh_meso[slot * meso_count + i].z;
    }
    sums[lane] = sum;
    barrier();
    for (uint half_count = SELECT_GROUP / 2; half_count > 0; half_count /= 2) {
        if (lane < half_count) {
            sums[lane] += sums[lane + half_count];
        }
        barrier();
    }
    float share = sums[0] / sources[source].area;
    bool is_surface = sources[source].kind == KIND_SURFACE;
    if (lane == 0) {
        shares[slot] = is_surface ? share : -1.0;
    }
    if (lane == 0 && scales == 1 && is_surface && abs(share - 1.0) <= MOST_OFF) {
        slots[slot].scale = 1.0 / share;
    }
}
