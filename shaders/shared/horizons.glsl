// Ways over a relief that rise above all of it need no march: bounds of src/meso/horizons.rs.
// Including files have shared/types.glsl, shared/texels.glsl and a `usamplerBuffer horizons`, a
// block a texel.

// tan(π/8).
const float MIDDLE_OF_SECTORS = 0.41421356;

// Whether a way from a place on the surface does not meet it again. `rates` are those of u, v and
// height along it.
bool rises_above(HeightTile tile, vec2 uv, vec3 rates) {
    vec2 size = vec2(float(tile.width), float(tile.height));
    uvec2 blocks = uvec2(tile.horizon_columns, tile.horizon_rows);
    vec2 place = vec2(uv.x, -uv.y) - 0.5 / size;
    uvec2 block = min(uvec2((place - floor(place)) * vec2(blocks)), blocks - 1);
    uvec4 words = fetch_words(horizons, tile.first_horizon + block.y * blocks.x + block.x);

    vec2 way = rates.xy * vec2(size.x, -size.y);
    vec2 far = abs(way);
    float greater = max(far.x, far.y);
    float lesser = min(far.x, far.y);
    bvec4 bits = bvec4(way.x < 0.0, way.y < 0.0, far.y > far.x,
                       lesser > MIDDLE_OF_SECTORS * greater);
    uvec4 powers = uvec4(bits) * uvec4(1, 2, 4, 8);
    uint sector = powers.x + powers.y + powers.z + powers.w;
    uint steps = words[sector / 4] >> 8 * (sector % 4) & 0xff;
    return steps != HORIZON_UNKNOWN && rates.z >= float(steps) * tile.horizon_step * length(way);
}
