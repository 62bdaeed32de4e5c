// Points that light comes straight from: those of emitters, which samples take turns at, then point
// lights. Including files have shared/types.glsl, shared/texels.glsl, a `usamplerBuffer
// light_points`, a buffer `float webs[]`, shares of the intensity of beams, `light_count`,
// `emitter_points`, `corner`, the sample in the top left corner of the tile that is drawn, and
// BEAMS, 1 where there are beams.

// Ends of ways lie so much of their distance from the eye above what they start and end on:
// coordinates and their interpolation round by a few 2^-24 of it.
const float ABOVE = 3.8e-6;

// Of one sample: points of emitters, and all.
uint emitter_samples() {
    return emitter_points / (LIGHT_SETS * LIGHT_TURNS);
}

uint light_samples() {
    return emitter_samples() + (light_count - emitter_points);
}

// Well mixed (Wellons 2018, "lowbias32").
uint mixed(uint x) {
    x = (x ^ (x >> 16)) * 0x21f0aaadu;
    x = (x ^ (x >> 15)) * 0xd35a2d97u;
    return x ^ (x >> 15);
}

// Texels of struct LightPoint, of which the last two are a beam's alone.
const uint LIGHT_TEXELS = 5;

LightPoint load_light(uint i) {
    uint first = LIGHT_TEXELS * i;
    uvec4 position = fetch_words(light_points, first);
    vec4 normal = fetch(light_points, first + 1);
    uvec4 strength = fetch_words(light_points, first + 2);
    LightPoint light;
    light.position = uintBitsToFloat(position.xyz);
    light.kind = position.w;
    light.normal = normal.xyz;
    light.area = normal.w;
    light.strength = uintBitsToFloat(strength.xyz);
    light.first_share = strength.w;
    if (BEAMS == 1 && light.kind == KIND_BEAM) {
        uvec4 zero = fetch_words(light_points, first + 3);
        light.zero = uintBitsToFloat(zero.xyz);
        light.rows = zero.w;
        light.columns = fetch_words(light_points, first + 4).x;
    }
    return light;
}

LightPoint light_of_sample(uint i) {
    uvec2 at = uvec2(gl_FragCoord.xy) + corner;
    // Points LIGHT_TURNS apart are close together on an emitter: those of a sample are taken from
    // other quarters of it, so that each sample sees of all of it.
    uint turn = (at.y % 4 * 4 + at.x % 4) ^ i;
    // Any set for a pixel: in turns, they would show as a lattice.
    uint set = mixed(mixed(at.x / 4) + at.y / 4) % LIGHT_SETS;
    uint of_emitter = set * LIGHT_POINTS + i * LIGHT_TURNS + turn;
    return load_light(i < emitter_samples() ? of_emitter : emitter_points + i - emitter_samples());
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
        if (BEAMS == 1 && light.kind == KIND_BEAM) {
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
