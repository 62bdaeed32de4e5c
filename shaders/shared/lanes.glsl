// Walking a set of a subgroup's lanes.

// The first lane of a set, which it leaves.
uint next_lane(inout uvec4 lanes) {
    uint lane = subgroupBallotFindLSB(lanes);
    lanes[lane / 32] &= ~(1u << (lane % 32));
    return lane;
}
