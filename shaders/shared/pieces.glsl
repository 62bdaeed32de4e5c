// Lists of elements in pieces, a dispatch each: 1 << piece_bits of them.

// A device has no more workgroups, which go on with the elements that are left.
const uint MOST_GROUPS = 65535;

// Workgroups of any piece of a list that they take in steps of so many elements.
uint groups_of_piece(uint count, uint step, uint piece_bits) {
    uint all = (count + step - 1) / step;
    return min((all + (1u << piece_bits) - 1) >> piece_bits, MOST_GROUPS);
}

// Where a piece begins and ends.
uvec2 piece_of(uint count, uint step, uint piece, uint piece_bits) {
    uint all = (count + step - 1) / step;
    uint size = step * ((all + (1u << piece_bits) - 1) >> piece_bits);
    uint begin = min(piece * size, count);
    return uvec2(begin, min(begin + size, count));
}
