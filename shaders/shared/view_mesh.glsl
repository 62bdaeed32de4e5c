// A surface in a window as sRGB codes: its radiance L = ρ(u, v) · E / π + Le by the light of the
// corners. LAID: what pictures drawn before show there comes first. OVERLAID, with LAID: outlines
// of elements, colours of sources and a marked element over it.
#include "shared/view_parameters.glsl"

layout(location = 0) in vec3 corner_light;
layout(location = 1) in vec2 corner_uv;

layout(location = 0) out vec4 code;

layout(binding = 0) uniform sampler2D albedo;

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

vec3 lit() {
    if (corner_light.r < 0.0) {
        return vec3(0.0);
    }
    vec3 rho = reflectance * texture(albedo, corner_uv).rgb;
    return srgb(neutral(exposure * (rho * corner_light / PI + emitted)));
}

#ifdef LAID
// sRGB codes of whole views, with how far along the view each pixel is: the last with all its
// pixels, and a later coarse one.
layout(binding = 4) uniform sampler2D whole;
layout(binding = 5) uniform sampler2D coarse;
layout(binding = 6) uniform sampler2D whole_distances;
layout(binding = 7) uniform sampler2D coarse_distances;

layout(location = 2) in vec3 in_whole;
layout(location = 3) in vec3 in_coarse;
layout(location = 4) flat in vec4 of_whole;
layout(location = 5) flat in vec4 of_coarse;
layout(location = 6) flat in float triangle_rise;

// Least height of a picture's eye over a surface, in distances along its view: a pixel there is as
// wide as four here.
const float LEAST_HEIGHT = 0.25;
// Half pixels by which a surface may lie before or behind what the picture's pixel shows beside it.
const float SLACK = 3.0;

// Whether a picture shows this place, and where in its image.
bool in_picture(vec3 place, vec4 view, sampler2D distances, out vec2 at) {
    float away = place.z;
    at = 0.5 * place.xy / away + 0.5;
    float height = view.x / away;
    bool within = view.y > 0.0 && away > 0.0 && height > LEAST_HEIGHT
         && all(greaterThan(at, vec2(0.0))) && all(lessThan(at, vec2(1.0)));
    at *= view.zw;
    // Relief is where its mesh is by so much; what stands before it is nearer.
    float seen = texelFetch(distances, ivec2(clamp(at, 0.0, 1.0) * vec2(textureSize(distances, 0))), 0).r;
    float slack = (triangle_rise + SLACK * view.y * away) / height;
    return within && abs(seen - away) <= slack;
}

vec3 laid() {
    vec2 at;
    if (in_picture(in_whole, of_whole, whole_distances, at)) {
        return textureLod(whole, at, 0.0).rgb;
    }
    if (in_picture(in_coarse, of_coarse, coarse_distances, at)) {
        return textureLod(coarse, at, 0.0).rgb;
    }
    return lit();
}
#endif

#ifdef OVERLAID
layout(location = 7) in vec3 corner_share;
layout(location = 8) in vec3 corner_position;
layout(location = 9) flat in uint corner_triangle;

vec3 shown() {
    if (from_picture == 1 || from_picture == 2) {
        vec4 p = vec4(corner_position, 1.0);
        vec2 at = 0.5 * vec2(dot(p, x), dot(p, y)) / dot(p, w) + 0.5;
        return from_picture == 1 ? textureLod(whole, at * of_whole.zw, 0.0).rgb : textureLod(coarse, at * of_coarse.zw, 0.0).rgb;
    }
    return from_picture == 0 ? lit() : laid();
}

// A hue for a number; neighbours differ.
vec3 hue(uint number) {
    float turn = fract(float(number) * 0.61803399);
    return clamp(abs(fract(turn + vec3(1.0, 2.0 / 3.0, 1.0 / 3.0)) * 6.0 - 3.0) - 1.0, 0.0, 1.0);
}

vec3 overlaid(vec3 colour) {
    About own = about[corner_triangle];
    if (sources > 0.0) {
        colour = mix(colour, hue(own.source), 0.45 * sources);
    }
    // Pixels to the nearest edge.
    vec3 to_edge = corner_share / max(fwidth(corner_share), vec3(1e-6));
    float edge = min(to_edge.x, min(to_edge.y, to_edge.z));
    if (elements > 0.0) {
        // Edges closer together than a few pixels fade, or the far end of a fine mesh would be
        // black.
        float widest = max(fwidth(corner_share).x, max(fwidth(corner_share).y, fwidth(corner_share).z));
        float seen = elements * clamp(1.0 - 3.0 * widest, 0.0, 1.0);
        colour = mix(colour, vec3(0.0), 0.6 * seen * clamp(1.2 - edge, 0.0, 1.0));
    }
    if (own.triangle == chosen) {
        colour = mix(colour, vec3(1.0, 0.6, 0.1), edge < 2.0 ? 1.0 : 0.25);
    }
    return colour;
}
#endif

void main() {
#if defined(OVERLAID)
    vec3 colour = overlaid(shown());
#elif defined(LAID)
    vec3 colour = laid();
#else
    vec3 colour = lit();
#endif
    code = vec4(colour, 1.0);
}
