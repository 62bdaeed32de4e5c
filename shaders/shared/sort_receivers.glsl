// Lists the elements that see each source of the batch, by how their form factor is found: as of a point, by the outline of
// the source, by its parts as points, or, near it, with more care. Elements that it lies behind, turns its back to or is
// hidden from are in no list, and their form factor is 0. SHADOW_RAYS: what is seen is asked of rays instead of the item
// buffer, one slot a dispatch, since lavapipe ends all loops of an invocation after 65,535 turns.

#ifdef SHADOW_RAYS
#define SHADOW_OCCLUDERS 8
#define RAYS SORT_ELEMENTS
#endif
#include "shared/receivers.glsl"

// 1: what is passed over is counted by slot, so that a row of form factors that is drawn ahead brings its own count.
layout(constant_id = 0) const uint BEHIND_BY_SLOT = 0;

// Form factors that were passed over because the source lies behind the element's plane, by element or by slot.
layout(scalar, binding = 7) buffer Behind { uint behind_count[]; };

// Lane k of a subgroup makes room in the list of kind k for all lanes.
void append(uint slot, uint kind, bool mine, uint i) {
    uint count = 0;
    uint before = 0;
    for (uint k = 0; k < RECEIVE_KINDS; k++) {
        uvec4 lanes = subgroupBallot(mine && kind == k);
        count = gl_SubgroupInvocationID == k ? subgroupBallotBitCount(lanes) : count;
        before = kind == k ? subgroupBallotExclusiveBitCount(lanes) : before;
    }
    uint first = 0;
    if (count > 0) {
        uint list = slot * RECEIVE_KINDS + gl_SubgroupInvocationID;
        first = atomicAdd(lists[list].count, count);
        atomicMax(lists[list].groups_x, (first + count + GROUP - 1) / GROUP);
    }
    for (uint k = 0; k < RECEIVE_KINDS; k++) {
        uint first_of_kind = subgroupBroadcast(first, k);
        before += kind == k ? first_of_kind : 0;
    }
    if (mine) {
        listed[(slot * RECEIVE_KINDS + kind) * element_count + before] = i;
    }
}

// How the form factor from an element to a source is found, should it be seen; RECEIVE_KINDS where it is 0. `near`: parts of the element
// may be seen, whether its centroid is or not. `behind`: it is 0 since the source lies behind the element.
uint kind_of(Source s, vec4 ball, vec3 n, out bool near, out bool behind) {
    vec3 d = ball.xyz - s.middle;
    float distance_middle = length(d);
    float across = dot(d, n);
    near = distance_middle - s.radius <= NEAR * ball.w;
    behind = across >= s.radius;
    bool above = across <= -s.radius && distance_middle * distance_middle >= ACUTE * s.radius * s.radius;
    bool whole = shows_whole_front(s, ball.xyz);
    bool points = distance_middle - s.radius >= POINT_DISTANCE * s.part_radius;
    bool curved = s.cone_sin != 0.0;
    float far_distance = (curved ? POINT_DISTANCE : FLAT_POINT_DISTANCE) * s.radius;
    bool far = s.kind == KIND_POINT || whole && distance_middle >= far_distance;
    bool by_parts = curved && points;
    uint kind = near ? RECEIVE_NEAR : far ? RECEIVE_FAR : by_parts ? RECEIVE_PARTS
        : whole && above ? RECEIVE_OUTLINE : RECEIVE_NEAR;
    return !behind && (near || shows_front(s, ball.xyz)) ? kind : RECEIVE_KINDS;
}

void main() {
    vec4 ball[SORT_ELEMENTS];
    vec3 n[SORT_ELEMENTS];
    uint passed_over[SORT_ELEMENTS];
    // Of a subgroup the elements follow one another.
    uint in_group = gl_SubgroupID * gl_SubgroupSize;
    uint first = SORT_ELEMENTS * (GROUP * gl_WorkGroupID.x + in_group) + gl_SubgroupInvocationID;
    for (uint j = 0; j < SORT_ELEMENTS; j++) {
        uint e = first_element + min(first + j * gl_SubgroupSize, element_count - 1);
        ball[j] = balls[e];
        n[j] = planes[e].xyz;
        passed_over[j] = 0;
    }
    for (uint slot = first_slot; slot < end_slot; slot++) {
        uint source = slots[slot].source;
        if (source == NONE) {
            break;
        }
        Source s = load_source(source);
        uint kind[SORT_ELEMENTS];
        bool seen[SORT_ELEMENTS];
        bool near[SORT_ELEMENTS];
        bool behind[SORT_ELEMENTS];
        for (uint j = 0; j < SORT_ELEMENTS; j++) {
            uint i = first + j * gl_SubgroupSize;
            kind[j] = kind_of(s, ball[j], n[j], near[j], behind[j]);
            seen[j] = i < element_count && kind[j] < RECEIVE_KINDS && !near[j];
        }
#ifdef SHADOW_RAYS
        look(s, ball, n, seen);
#else
        for (uint j = 0; j < SORT_ELEMENTS; j++) {
            uint e = first_element + first + j * gl_SubgroupSize;
            seen[j] = visible(ball[j].xyz, n[j], e, slot, s, seen[j]);
        }
#endif
        for (uint j = 0; j < SORT_ELEMENTS; j++) {
            uint i = first + j * gl_SubgroupSize;
            bool mine = i < element_count && kind[j] < RECEIVE_KINDS;
            append(slot, kind[j], mine && (near[j] || seen[j]), i);
            if (BEHIND_BY_SLOT == 1) {
                uint lanes = subgroupBallotBitCount(subgroupBallot(behind[j] && i < element_count));
                if (subgroupElect()) {
                    atomicAdd(behind_count[slot], lanes);
                }
            } else {
                passed_over[j] += behind[j] ? 1 : 0;
            }
        }
    }
    for (uint j = 0; j < SORT_ELEMENTS; j++) {
        uint i = first + j * gl_SubgroupSize;
        if (BEHIND_BY_SLOT == 0 && i < element_count) {
            behind_count[first_element + i] += passed_over[j];
        }
    }
}
