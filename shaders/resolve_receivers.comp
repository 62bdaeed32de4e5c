// Decides by rays about the elements of which the item buffer leaves open whether a source sees
// them, and about those for which a silhouette may cut the source: they see the share of it from
// which they are seen. Lists those that see any as sort_receivers.comp does. One slot a dispatch.
#version 460
#extension GL_GOOGLE_include_directive : require
#define SHADOW_OCCLUDERS 7
#define RAYS 1
#include "shared/receivers.glsl"
#include "shared/receive_kinds.glsl"

// RECEIVE_DOUBTFUL: from the eye of the source; RECEIVE_CROSSED: from EYES of the SOURCE_EYES
// places on it, evenly chosen.
layout(constant_id = 0) const uint LIST = RECEIVE_DOUBTFUL;
layout(constant_id = 1) const uint EYES = SOURCE_EYES;
const uint STRIDE = SOURCE_EYES / EYES;

// SOURCE_EYES a source.
layout(binding = 8) uniform usamplerBuffer eyes;

void main() {
    uint list = first_slot * RECEIVE_LISTS + LIST;
    uint count = lists[list].count;
    // The lanes past the end do as the last one does.
    uint i = listed[list * element_count + min(gl_GlobalInvocationID.x, count - 1)];
    uint e = first_element + i;
    uint source = slots[first_slot].source;
    Source s = load_source(source);
    vec4 ball[RAYS] = vec4[](fetch(balls, e));
    vec3 n[RAYS] = vec3[](fetch(planes, e).xyz);
    uint from = LIST == RECEIVE_CROSSED ? EYES : 1;
    uint open_count = 0;
    uint above_count = 0;
    Source eye = s;
    for (uint k = 0; k < from; k++) {
        if (LIST == RECEIVE_CROSSED) {
            eye.eye = fetch(eyes, SOURCE_EYES * source + k * STRIDE + STRIDE / 2).xyz;
        }
        // What lies below the horizon is not in the form factor.
        bool above = LIST != RECEIVE_CROSSED || dot(eye.eye - ball[0].xyz, n[0]) > 0.0;
        bool open[RAYS] = bool[](above && gl_GlobalInvocationID.x < count);
        look(eye, ball, n, open);
        open_count += open[0] ? 1 : 0;
        above_count += above ? 1 : 0;
    }
    bool near;
    uint kind = kind_of(s, ball[0], n[0], near);
    float share = float(max(open_count, 1)) / float(max(above_count, 1));
    append(first_slot, kind, open_count > 0, with_share(i, share));
}
