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

// Invocations an element, each of which looks from some of the places: one alone would go through
// more turns of loops than a software device allows, and see what it does not come to.
const uint CROSSED_BY = EYES < CROSSED_LANES ? EYES : CROSSED_LANES;
const uint LANES_EACH = LIST == RECEIVE_CROSSED ? CROSSED_BY : 1;
const uint FROM = LIST == RECEIVE_CROSSED ? EYES / LANES_EACH : 1;
const uint ELEMENTS = GROUP / LANES_EACH;

// Weight of the places that are open, and of all, of each invocation.
shared vec2 weights[GROUP];

void main() {
    uint list = first_slot * RECEIVE_LISTS + LIST;
    uint count = lists[list].count;
    uint source = slots[first_slot].source;
    Source s = load_source(source);
    uint first_eye = eye_starts[source];
    uint stride = (eye_starts[source + 1] - first_eye) / EYES;
    uint lane = gl_LocalInvocationIndex % LANES_EACH;
    uvec2 range = piece_of(count, ELEMENTS, piece, pieces);
    uint end = range.y;
    uint step_size = ELEMENTS * gl_NumWorkGroups.x;
    for (uint at = range.x + ELEMENTS * gl_WorkGroupID.x; at < end; at += step_size) {
        // The lanes past the end do as the last one does.
        uint of = at + gl_LocalInvocationIndex / LANES_EACH;
        uint i = listed[list * element_count + min(of, end - 1)];
        uint e = first_element + i;
        vec4 ball[RAYS] = vec4[](fetch(balls, e));
        vec3 n[RAYS] = vec3[](fetch(planes, e).xyz);
        vec2 sum = vec2(0.0);
        Source eye = s;
        for (uint k = 0; k < FROM; k++) {
            float weight = 1.0;
            if (LIST == RECEIVE_CROSSED) {
                uint place_at = LANES_EACH * k + lane;
                Eye place = load_eye(eyes[first_eye + place_at * stride + stride / 2]);
                eye.eye = place.at;
                weight = weight_of(place, s, ball[0].xyz, n[0]);
            }
            bool open[RAYS] = bool[](weight > 0.0 && of < end);
            look(eye, ball, n, open);
            sum += vec2(open[0] ? weight : 0.0, weight);
        }
        weights[gl_LocalInvocationIndex] = sum;
        barrier();
        vec2 all = vec2(0.0);
        for (uint k = 0; k < LANES_EACH && lane == 0; k++) {
            all += weights[gl_LocalInvocationIndex + k];
        }
        bool near;
        uint kind = kind_of(s, ball[0], n[0], near);
        float share = all.x / max(all.y, LEAST_WEIGHT);
        append(first_slot, kind, lane == 0 && all.x > 0.0, with_share(i, share));
        barrier();
    }
}
