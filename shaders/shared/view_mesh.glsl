// A surface in a window as sRGB codes: its radiance L = ρ(u, v) · E / π + Le by the light of the
// corners. RELIEF: E on the relief's own normal, less what the relief about it hides of an even sky.
#include "shared/view_parameters.glsl"

layout(location = 0) in vec3 corner_light;
layout(location = 1) in vec2 corner_uv;

layout(location = 0) out vec4 code;

layout(binding = 1) uniform sampler2D albedo;

#ifdef RELIEF
// Slopes of the relief along u and v, and the share of an even sky's light that arrives there.
layout(binding = 6) uniform sampler2D slopes;

layout(location = 2) in vec3 slanted_u;
layout(location = 3) in vec3 slanted_v;
layout(location = 4) in vec3 lift;
layout(location = 5) flat in vec4 stretch;

// Slope for which `lift` is; as in src/view/snapshot.rs.
const float TILT = 0.7;

vec3 irradiance(vec3 rho) {
    vec3 relief = texture(slopes, corner_uv).rgb;
    vec2 slope = relief.xy;
    float square = dot(stretch.xyz, vec3(slope.x * slope.x, slope.x * slope.y, slope.y * slope.y));
    vec3 lifted = corner_light + lift * (2.0 * square / (TILT * TILT + square));
    float cosine = inversesqrt(1.0 + square);
    vec3 open = max(lifted - slope.x * slanted_u - slope.y * slanted_v, vec3(0.0)) * cosine;
    float openness = 1.0 / (1.0 + stretch.w * (1.0 / relief.z - 1.0));
    // What is not open shows relief lit as the level is: what the horizon hides, and what lies below
    // the level before a slope. What has bounced is no direct light.
    float shut = 1.0 - openness;
    vec3 bounced = parts.x * rho * corner_light * openness / (1.0 - rho * shut);
    return openness * open + (shut + 0.5 * (1.0 - cosine)) * bounced;
}
#else
vec3 irradiance(vec3 rho) {
    return corner_light;
}
#endif

const float PI = 3.14159265358979;

// Khronos PBR Neutral, as src/picture/tone.rs.
vec3 neutral(vec3 colour) {
    const float start = 0.8 - 0.04;
    const float desaturation = 0.15;
    float least = min(colour.r, min(colour.g, colour.b));
    colour -= least < 0.08 ? least - 6.25 * least * least : 0.04;
    float peak = max(colour.r, max(colour.g, colour.b));
    if (peak < start) {
        return colour;
    }
    float rest = 1.0 - start;
    float new_peak = 1.0 - rest * rest / (peak + rest - start);
    float grey = 1.0 - 1.0 / (desaturation * (peak - new_peak) + 1.0);
    return mix(colour * (new_peak / peak), vec3(new_peak), grey);
}

// IEC 61966-2-1.
vec3 srgb(vec3 linear) {
    linear = clamp(linear, 0.0, 1.0);
    return mix(1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055, 12.92 * linear, lessThanEqual(linear, vec3(0.0031308)));
}

void main() {
    vec3 rho = reflectance * texture(albedo, corner_uv).rgb;
    code = vec4(srgb(neutral(exposure * (rho * irradiance(rho) / PI + emitted))), 1.0);
}
