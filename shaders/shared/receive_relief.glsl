// What an element with a relief receives, by direction. Including files have the binding `moments`,
// and `kept_cells`: of the square of the slots that are kept.

#include "shared/relief_basis.glsl"

// Keeps light of which meso element i sees the share f, in the slots of its directions; its part of
// the coefficients of `response` is added.
void receive_by_direction(uint i, uint response, vec3 f, vec3 light, inout vec3 coefficients[RELIEF_RANK]) {
    uint slots_kept = kept_cells.x * kept_cells.y;
    // A near source fills many slots: it is spread over the disc that sends the same light.
    Disc disc = disc_of(f);
    Functions functions = no_functions();
    for (uint j = 0; j < disc.points; j++) {
        vec3 point = disc_point(disc, j);
        vec2 square = to_square(point * inversesqrt(dot(point, point)));
        uint at = 3 * (i * slots_kept + cell_of(square, kept_cells));
        for (uint c = 0; c < 3; c++) {
            moments[at + c] += light[c] * point;
        }
        add_functions(functions, response, square, point.z);
    }
    add_light(coefficients, functions, light);
}
