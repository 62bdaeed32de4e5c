// What an element with a relief receives, by direction. Including files have the bindings `moments`
// and `albedos`, and `cells` of the directions' square.

// Keeps light of which meso element i sees the share f. What leaves of it again, of a response to
// light with the tile's mean reflectance.
vec3 receive_by_direction(uint i, uint response, vec3 f, vec3 light) {
    uint directions = cells.x * cells.y;
    vec3 reflected = vec3(0.0);
    // A near source fills many slots: it is spread over the disc that sends the same light.
    Disc disc = disc_of(f);
    for (uint j = 0; j < disc.points; j++) {
        vec3 point = disc_point(disc, j);
        uint k = direction_of(point * inversesqrt(dot(point, point)), cells);
        uint at = 3 * (i * directions + k);
        uint albedo = 3 * (response * directions + k);
        for (uint c = 0; c < 3; c++) {
            moments[at + c] += light[c] * point;
            reflected[c] += dot(fetch(albedos, albedo + c).xyz, point) * light[c];
        }
    }
    return reflected;
}
