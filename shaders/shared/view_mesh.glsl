// What the ways of drawing a surface in a window share; each defines shown(), the surface's own code.
layout(location = 0) in vec3 corner_all;
layout(location = 1) in vec3 corner_direct;
layout(location = 2) in vec2 corner_uv;
layout(location = 3) in vec3 corner_share;
layout(location = 4) in vec3 corner_position;
layout(location = 5) flat in vec3 triangle_normal;
layout(location = 6) flat in uint corner_triangle;

layout(location = 0) out vec4 code;

layout(binding = 0) uniform sampler2D albedo;
struct About {
    uint triangle;         // its place in the input
    uint source;
    float rise;            // how far relief reaches above or below it, internal units
};

// [drawn triangle]
layout(scalar, binding = 3) readonly buffer AboutTriangles { About about[]; };

layout(push_constant, scalar) uniform Parameters {
    vec4 x;
    vec4 y;
    vec4 w;
    vec3 eye;
    float near;
    vec3 reflectance;
    float exposure;        // what radiance is multiplied by
    vec3 emitted;          // Le, W·m⁻²·sr⁻¹
    vec3 ambient;          // E of light not shot yet, W·m⁻²
    vec2 parts;            // how often all light and direct light count
    float elements;        // 1: outlined
    float sources;         // 1: coloured
    uint from_picture;     // 1 and 2: the surface is what the whole or the coarse picture shows; 3: what they show from elsewhere
    uint chosen;           // element that is marked
};

const float PI = 3.14159265358979;

// Khronos PBR Neutral, as src/render/tone.rs.
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

// By the light of the corners.
vec3 lit() {
    if (dot(triangle_normal, eye - corner_position) <= 0.0) {
        return vec3(0.0);
    }
    vec3 rho = reflectance * texture(albedo, corner_uv).rgb;
    vec3 irradiance = max(parts.x * corner_all + parts.y * corner_direct, vec3(0.0)) + ambient;
    return srgb(neutral(exposure * (rho * irradiance / PI + emitted)));
}

vec3 shown();

// A hue for a number; neighbours differ.
vec3 hue(uint number) {
    float turn = fract(float(number) * 0.61803399);
    return clamp(abs(fract(turn + vec3(1.0, 2.0 / 3.0, 1.0 / 3.0)) * 6.0 - 3.0) - 1.0, 0.0, 1.0);
}

void main() {
    vec3 colour = shown();
    About own = about[corner_triangle];
    if (sources > 0.0) {
        colour = mix(colour, hue(own.source), 0.45 * sources);
    }
    // Pixels to the nearest edge.
    vec3 to_edge = corner_share / max(fwidth(corner_share), vec3(1e-6));
    float edge = min(to_edge.x, min(to_edge.y, to_edge.z));
    if (elements > 0.0) {
        // Edges closer together than a few pixels fade, or the far end of a fine mesh would be black.
        float widest = max(fwidth(corner_share).x, max(fwidth(corner_share).y, fwidth(corner_share).z));
        float seen = elements * clamp(1.0 - 3.0 * widest, 0.0, 1.0);
        colour = mix(colour, vec3(0.0), 0.6 * seen * clamp(1.2 - edge, 0.0, 1.0));
    }
    if (own.triangle == chosen) {
        colour = mix(colour, vec3(1.0, 0.6, 0.1), edge < 2.0 ? 1.0 : 0.25);
    }
    code = vec4(colour, 1.0);
}
