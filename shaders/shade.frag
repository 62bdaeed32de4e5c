// Radiance of a diffuse surface, L = ρ(u, v) · E / π + Le; alpha says whether an exposure meter looks at it.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(location = 0) in vec3 corner_irradiance;
layout(location = 1) in vec2 corner_uv;

layout(location = 0) out vec4 radiance;

layout(binding = 0) uniform sampler2D albedo;

layout(push_constant, scalar) uniform Parameters {
    vec3 x;
    vec3 y;
    vec3 w;
    float near;
    vec3 reflectance;
    vec3 emitted;      // Le, W·m⁻²·sr⁻¹
    float metered;
};

const float PI = 3.14159265358979;

void main() {
    vec3 rho = reflectance * texture(albedo, corner_uv).rgb;
    radiance = vec4(rho * corner_irradiance / PI + emitted, metered);
}
