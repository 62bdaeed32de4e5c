// Decides by rays about the elements of which the item buffer leaves open whether a source sees
// them, and about those for which a silhouette may cut the source: they see the share of it from
// which they are seen. Lists those that see any as sort_receivers.comp does. One slot a dispatch.
#version 460
#extension GL_GOOGLE_include_directive : require
#define SHADOW_OCCLUDERS 7
#define RAYS 1
#include "shared/receivers.glsl"
#include "shared/receive_kinds.glsl"

// RECEIVE_DOUBTFUL: from the eye of the source; RECEIVE_CROSSED: from EYES of the places on it,
// evenly chosen.
layout(constant_id = 0) const uint LIST = RECEIVE_DOUBTFUL;
layout(constant_id = 1) const uint EYES = SOURCE_EYES;

// Those of a source on a surface are EYES or a multiple; a point light has none, and nothing crosses
// it.
layout(scalar, binding = 8) readonly buffer Eyes { vec4 eyes[]; };
// [source], one more than there are.
layout(scalar, binding = 9) readonly buffer EyeStarts { uint eye_starts[]; };

// Less than the weight of any place, which is finite in a scene of size 1.
const float LEAST_WEIGHT = 1e-30;

// What a place on the source adds to the form factor from p, but for a constant.
float weight_of(Eye place, Source s, vec3 p, vec3 n) {
    vec3 d = place.at - p;
    float square = dot(d, d);
    float facing = -dot(d, s.cone_sin == 0.0 ? s.normal : place.normal);
    return max(dot(d, n), 0.0) * max(facing, 0.0) / (square * square);
}

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
    uint first_eye = eye_starts[source];
    uint stride = (eye_starts[source + 1] - first_eye) / EYES;
    float open_sum = 0.0;
    float sum = 0.0;
    Source eye = s;
    for (uint k = 0; k < from; k++) {
        float weight = 1.0;
        if (LIST == RECEIVE_CROSSED) {
            Eye place = load_eye(eyes[first_eye + k * stride + stride / 2]);
            eye.eye = place.at;
            weight = weight_of(place, s, ball[0].xyz, n[0]);
        }
        bool open[RAYS] = bool[](weight > 0.0 && gl_GlobalInvocationID.x < count);
        look(eye, ball, n, open);
        open_sum += open[0] ? weight : 0.0;
        sum += weight;
    }
    bool near;
    uint kind = kind_of(s, ball[0], n[0], near);
    append(first_slot, kind, open_sum > 0.0, with_share(i, open_sum / max(sum, LEAST_WEIGHT)));
}
