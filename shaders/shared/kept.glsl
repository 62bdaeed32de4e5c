// Form factors as they are kept: in 16 bits, so that replaying them takes little memory. Fresh ones
// are rounded in the same way, so that a factor is the same to the bit whether it was kept or not.
// src/math/kept.rs is the same.

// Exponents of 2^-43 to 2^20 in 6 bits, 10 bits behind the leading one: off by 1/2048 at most. Less
// than 2^-43 is nothing.
const uint KEPT_ZERO = (127 - 43) << 10;
const uint KEPT_SHIFT = 13;

uint factor_code(float f) {
    uint rounded = (floatBitsToUint(max(f, 0.0)) + (1u << (KEPT_SHIFT - 1))) >> KEPT_SHIFT;
    return min(max(rounded, KEPT_ZERO) - KEPT_ZERO, 0xffff);
}

float kept_factor(uint code) {
    return code == 0 ? 0.0 : uintBitsToFloat((code + KEPT_ZERO) << KEPT_SHIFT);
}

float as_kept(float f) {
    return kept_factor(factor_code(f));
}

// A direction of the upper hemisphere, unit length, on an octahedron's upper half turned into a
// square of 2^16 steps a side.
uint direction_code(vec3 d) {
    vec2 p = d.xy / (abs(d.x) + abs(d.y) + max(d.z, 0.0));
    return packUnorm2x16(0.5 + 0.5 * vec2(p.x + p.y, p.x - p.y));
}

vec3 kept_direction(uint code) {
    vec2 q = 2.0 * unpackUnorm2x16(code) - 1.0;
    vec2 p = 0.5 * vec2(q.x + q.y, q.x - q.y);
    return normalize(vec3(p, max(1.0 - abs(p.x) - abs(p.y), 0.0)));
}
