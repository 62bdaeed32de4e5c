// Points that light comes straight from: those of emitters, which samples take turns at, then point
// lights. Including files have shared/types.glsl, the buffers `LightPoint light_points[]` and
// `float webs[]`, shares of the intensity of beams, and `light_count` and `emitter_points`.

// Ends of ways lie so much of their distance from the eye above what they start and end on:
// coordinates and their interpolation round by a few 2^-24 of it.
const float ABOVE = 3.8e-6;

// Of one sample.
uint light_samples() {
    return emitter_points / (LIGHT_SETS * LIGHT_TURNS) + (light_count - emitter_points);
}

LightPoint light_of_sample(uint i) {
    uint emitters = emitter_points / (LIGHT_SETS * LIGHT_TURNS);
    if (i >= emitters) {
        return light_points[emitter_points + i - emitters];
    }
    uvec2 at = uvec2(gl_FragCoord.xy);
    uvec2 turn = at % 4;
    uvec2 pixel_at = at / 4 % 4;
    return light_points[(pixel_at.y * 4 + pixel_at.x) * LIGHT_POINTS + i * LIGHT_TURNS + turn.y * 4 + turn.x];
}

// Share of a beam's intensity in a direction from it, linear in both angles.
float share_of(LightPoint light, vec3 way) {
    vec3 across = cross(light.normal, light.zero);
    vec2 flat_part = vec2(dot(way, light.zero), dot(way, across));
    float theta = atan(length(flat_part), dot(way, light.normal)) / 3.14159265358979;
    float turn = atan(flat_part.y, flat_part.x) / 6.28318530717959;
    float row = clamp(theta, 0.0, 1.0) * float(light.rows - 1);
    float column = clamp(turn < 0.0 ? turn + 1.0 : turn, 0.0, 1.0) * float(light.columns - 1);
    uint above = uint(min(floor(row), float(light.rows - 2)));
    uint before = light.columns == 1 ? 0 : uint(min(floor(column), float(light.columns - 2)));
    uint upper = light.first_share + above * light.columns + before;
    uint right = min(light.columns - 1, 1);
    float left = column - float(before);
    float of_upper = mix(webs[upper], webs[upper + right], left);
    float of_lower = mix(webs[upper + light.columns], webs[upper + light.columns + right], left);
    return mix(of_upper, of_lower, row - float(above));
}

// What arrives per area of a surface that shows it a cosine, for a unit of strength, at the square
// of a distance.
float arriving(LightPoint light, vec3 towards, float cosine, float square) {
    if (light.kind != KIND_SURFACE) {
        float share = 1.0;
        // A loop that mostly takes no turn: a software device works through both sides of a branch.
        for (uint turns = light.kind == KIND_BEAM ? 1 : 0; turns > 0; turns--) {
            share = share_of(light, -towards);
        }
        return share * cosine / square;
    }
    // Near by, no part of an emitter can give more than a whole sky of its radiance does, π Le.
    float whole = cosine * max(-dot(light.normal, towards), 0.0) / square;
    return float(LIGHT_TURNS) * min(whole, 3.14159265358979 / light.area);
}

// Where the way to a light point ends.
vec3 end_of_way(LightPoint light) {
    vec3 size = abs(light.position);
    return light.position + light.normal * (ABOVE * max(max(size.x, size.y), size.z));
}
