// Lists of elements in pieces, a dispatch each.

// Where a piece of a list begins and ends, of so many pieces; `step`: elements of a workgroup.
uvec2 piece_of(uint count, uint step, uint piece, uint pieces) {
    uint size = step * ((count + step * pieces - 1) / (step * pieces));
    uint begin = min(piece * size, count);
    return uvec2(begin, min(begin + size, count));
}
