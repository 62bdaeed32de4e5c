// How elements receive from a source, and their lists. Including files have shared/receivers.glsl.

// Workgroups for so many elements of a list: those that a silhouette may cut take several
// invocations each. A device has no more than 65,535, which go on with those that are left.
uint groups_of(uint which, uint count) {
    uint each = which == RECEIVE_CROSSED ? CROSSED_LANES : 1;
    return min((count * each + GROUP - 1) / GROUP, 65535);
}

// Makes room in one list for all lanes.
void append_one(uint slot, uint which, bool mine, uint listed_word) {
    uvec4 lanes = subgroupBallot(mine);
    if (lanes == uvec4(0)) {
        return;
    }
    uint count = subgroupBallotBitCount(lanes);
    uint list = slot * RECEIVE_LISTS + which;
    uint first = 0;
    if (subgroupElect()) {
        first = atomicAdd(lists[list].count, count);
        atomicMax(lists[list].groups_x, groups_of(which, first + count));
    }
    first = subgroupBroadcastFirst(first);
    if (mine) {
        listed[list * element_count + first + subgroupBallotExclusiveBitCount(lanes)] = listed_word;
    }
}

// The same in the list of each lane's kind: lane k for all lanes of kind k, but for RECEIVE_NEAR,
// of which there are few.
void append(uint slot, uint kind, bool mine, uint listed_word) {
    append_one(slot, RECEIVE_NEAR, mine && kind == RECEIVE_NEAR, listed_word);
    mine = mine && kind < RECEIVE_NEAR;
    uint count = 0;
    uint before = 0;
    for (uint k = 0; k < RECEIVE_NEAR; k++) {
        uvec4 lanes = subgroupBallot(mine && kind == k);
        count = gl_SubgroupInvocationID == k ? subgroupBallotBitCount(lanes) : count;
        before = kind == k ? subgroupBallotExclusiveBitCount(lanes) : before;
    }
    uint first = 0;
    if (count > 0) {
        uint list = slot * RECEIVE_LISTS + gl_SubgroupInvocationID;
        first = atomicAdd(lists[list].count, count);
        atomicMax(lists[list].groups_x, (first + count + GROUP - 1) / GROUP);
    }
    for (uint k = 0; k < RECEIVE_NEAR; k++) {
        uint first_of_kind = subgroupBroadcast(first, k);
        before += kind == k ? first_of_kind : 0;
    }
    if (mine) {
        listed[(slot * RECEIVE_LISTS + kind) * element_count + before] = listed_word;
    }
}

// An element with the share of the source that it sees, rounded to a multiple of SHARE_STEP above 0.
uint with_share(uint i, float share) {
    return i | uint(max(share / SHARE_STEP - 0.5, 0.0)) << LISTED_BITS;
}

// How the form factor from an element to a source is found, should it be seen; RECEIVE_KINDS where
// it is 0. `near`: parts of the element may be seen, whether its centroid is or not.
uint kind_of(Source s, vec4 ball, vec3 n, out bool near) {
    vec3 d = ball.xyz - s.middle;
    float distance_middle = length(d);
    float across = dot(d, n);
    near = gap_to(s, ball.xyz) <= NEAR * ball.w;
    bool behind = across >= s.radius;
    bool above = across <= -s.radius && distance_middle * distance_middle >= ACUTE * s.radius * s.radius;
    bool whole = shows_whole_front(s, ball.xyz);
    bool points = distance_middle - s.radius >= (whole ? POINT_DISTANCE : PART_POINT_DISTANCE) * s.part_radius;
    bool curved = s.cone_sin != 0.0;
    float far_distance = (curved ? POINT_DISTANCE : FLAT_POINT_DISTANCE) * s.radius;
    bool far = s.kind == KIND_POINT || whole && distance_middle >= far_distance;
    bool by_parts = curved && points;
    uint kind = near ? RECEIVE_NEAR : far ? RECEIVE_FAR : by_parts ? RECEIVE_PARTS
        : !whole ? RECEIVE_NEAR : above ? RECEIVE_OUTLINE : RECEIVE_CUT;
    bool shows = shows_front(s, ball.xyz) && !lies_in_plane(s, ball.xyz, n);
    return !behind && (near || shows) ? kind : RECEIVE_KINDS;
}
