// Lists the elements that see each source of the batch, by how their form factor is found: as of a point, by the outline of
// the source, by its parts as points, or, near it, with more care. Elements that it lies behind, turns its back to or is hidden from are in no
// list, and their form factor is 0.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/receivers.glsl"

void append(uint slot, uint kind, bool mine, uint i) {
    uvec4 lanes = subgroupBallot(mine);
    uint count = subgroupBallotBitCount(lanes);
    uint list = slot * RECEIVE_KINDS + kind;
    uint first = 0;
    if (count > 0 && subgroupElect()) {
        first = atomicAdd(lists[list].count, count);
        atomicMax(lists[list].groups_x, (first + count + GROUP - 1) / GROUP);
    }
    first = subgroupBroadcastFirst(first);
    if (mine) {
        listed[list * element_count + first + subgroupBallotExclusiveBitCount(lanes)] = i;
    }
}

void main() {
    uint slot = gl_WorkGroupID.y;
    uint source = slots[slot].source;
    if (source == NONE) {
        return;
    }
    bool inside = gl_GlobalInvocationID.x < element_count;
    uint i = min(gl_GlobalInvocationID.x, element_count - 1);
    uint e = first_element + i;
    Source s = load_source(source);
    vec4 ball = balls[e];
    vec3 n = planes[e].xyz;
    vec3 d = ball.xyz - s.eye;
    float distance_eye = length(d);
    float across = dot(d, n);
    bool near = distance_eye - s.radius <= NEAR * ball.w;
    bool above = across <= -s.radius && distance_eye * distance_eye >= ACUTE * s.radius * s.radius;
    bool whole = shows_whole_front(s, ball.xyz);
    bool points = distance_eye - s.radius >= POINT_DISTANCE * s.part_radius;
    bool seen = shows_front(s, ball.xyz) && visible(ball.xyz, n, e, slot, s);
    bool mine = inside && across < s.radius && (near || seen);
    bool curved = s.cone_sin != 0.0;
    float far_distance = (curved ? POINT_DISTANCE : FLAT_POINT_DISTANCE) * s.radius;
    bool far = s.kind == KIND_POINT || whole && length(ball.xyz - s.middle) >= far_distance;
    bool by_parts = curved && points;
    uint kind = near ? RECEIVE_NEAR : far ? RECEIVE_FAR : by_parts ? RECEIVE_PARTS
        : whole && above ? RECEIVE_OUTLINE : RECEIVE_NEAR;
    for (uint k = 0; k < RECEIVE_KINDS; k++) {
        append(slot, k, mine && kind == k, i);
    }
}
