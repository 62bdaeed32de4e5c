// The hemicube about a source: src/hemicube.rs is the same in f64.
//
// A slot's faces lie in a column of N texels by 3 N: the top (N × N), then the upper halves of +x,
// −x, +y, −y (N × N/2 each). Columns stand side by side.

// The face that `local` (in the source's frame) points into, with its texel coordinates within the
// column.
vec2 hemicube_texel(vec3 local, uint n) {
    vec3 a = abs(local);
    float z = max(local.z, 0.0);
    float size = float(n);
    if (z >= max(a.x, a.y)) {
        return (local.xy / z * 0.5 + 0.5) * size;
    }
    bool along_x = a.x >= a.y;
    float w = along_x ? a.x : a.y;
    float u = (along_x ? local.y : local.x) / w;
    float first_row = along_x ? (local.x > 0.0 ? 1.0 : 1.5) : (local.y > 0.0 ? 2.0 : 2.5);
    return vec2((u * 0.5 + 0.5) * size, (first_row + 0.5 * z / w) * size);
}

// The texel that a coordinate falls in, kept within the face that it belongs to.
ivec2 hemicube_pixel(vec2 texel, uint n) {
    ivec2 pixel = ivec2(texel);
    return clamp(pixel, ivec2(0), ivec2(n - 1u, 3u * n - 1u));
}

// The first of the four texels of a face whose centres lie about a coordinate.
ivec2 hemicube_corner(vec2 texel, uint n) {
    int side = int(n);
    int row = clamp(int(texel.y), 0, 3 * side - 1);
    int first_row = row < side ? 0 : row / (side / 2) * (side / 2);
    int rows = row < side ? side : side / 2;
    ivec2 corner = ivec2(floor(texel - 0.5));
    return clamp(corner, ivec2(0, first_row), ivec2(side - 2, first_row + rows - 2));
}

// The direction, in the source's frame, through the centre of a texel of the column.
vec3 hemicube_direction(ivec2 pixel, uint n) {
    vec2 at = (vec2(pixel) + 0.5) / float(n);
    float u = 2.0 * at.x - 1.0;
    if (at.y < 1.0) {
        return vec3(u, 2.0 * at.y - 1.0, 1.0);
    }
    float half_rows = 2.0 * (at.y - 1.0);
    float z = fract(half_rows);
    switch (int(half_rows)) {
    case 0: return vec3(1.0, u, z);
    case 1: return vec3(-1.0, u, z);
    case 2: return vec3(u, 1.0, z);
    default: return vec3(u, -1.0, z);
    }
}
