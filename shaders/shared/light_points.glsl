// Points that light comes straight from: those of emitters, which samples take turns at, then point
// lights. Including files have shared/types.glsl, the buffer `LightPoint light_points[]`, and
// `light_count` and `emitter_points` of it.

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

// What arrives per area of a surface that shows it a cosine, for a unit of strength, at the square
// of a distance.
float arriving(LightPoint light, vec3 towards, float cosine, float square) {
    if (light.kind == KIND_POINT) {
        return cosine / square;
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
