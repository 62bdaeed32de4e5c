// A corner of an element, seen by a camera: reversed infinite depth, as in the item buffer.
#version 460
#extension GL_EXT_scalar_block_layout : require

layout(location = 0) in vec3 position;     // from the eye, internal units
layout(location = 1) in vec3 irradiance;   // W·m⁻²
layout(location = 2) in vec2 uv;

layout(location = 0) out vec3 corner_irradiance;
layout(location = 1) out vec2 corner_uv;
layout(location = 2) out vec3 corner_share;
layout(location = 3) out vec3 corner_position;
layout(location = 4) flat out uint corner_triangle;

layout(push_constant, scalar) uniform Parameters {
    vec3 x;
    vec3 y;
    vec3 w;
    float near;
    vec3 reflectance;
    vec3 emitted;
    float metered;
};

void main() {
    corner_irradiance = irradiance;
    corner_uv = uv;
    // Triangles share no vertices.
    uint corner = gl_VertexIndex % 3;
    corner_share = vec3(equal(uvec3(corner), uvec3(0, 1, 2)));
    corner_position = position;
    corner_triangle = gl_VertexIndex / 3;
    gl_Position = vec4(dot(position, x), dot(position, y), near, dot(position, w));
}
