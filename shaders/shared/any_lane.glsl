// Loops that all lanes of a subgroup leave together. A software device (Mesa's llvmpipe) works
// through the body once more, for no lane, where a loop's condition stands before it; where it
// stands behind and differs by lane, those that are done early lose what they have found (Mesa
// 22.3). With this behind the loop neither happens; lanes that are done must find nothing more.
// Including files have GL_KHR_shader_subgroup_ballot.

// A ballot, since lavapipe goes through all lanes for a vote.
bool any_lane(bool goes_on) {
    return subgroupBallot(goes_on) != uvec4(0);
}
