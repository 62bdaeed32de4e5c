// A corner of a triangle in a window: reversed infinite depth, as in the item buffer.
layout(location = 0) in vec3 position;     // from the scene's middle, internal units
layout(location = 1) in vec3 normal;       // of the triangle
layout(location = 2) in vec2 uv;

layout(location = 0) out vec3 corner_all;
layout(location = 1) out vec3 corner_direct;
layout(location = 2) out vec2 corner_uv;
layout(location = 3) out vec3 corner_share;
layout(location = 4) out vec3 corner_position;
layout(location = 5) flat out vec3 triangle_normal;
layout(location = 6) flat out uint corner_triangle;

// [corner] of the drawn triangles, W·m⁻²: all light, and what comes straight from emitters and point lights.
layout(scalar, binding = 1) readonly buffer All { vec3 all_light[]; };
layout(scalar, binding = 2) readonly buffer Direct { vec3 direct_light[]; };

layout(push_constant, scalar) uniform Parameters {
    vec4 x;
    vec4 y;
    vec4 w;
    vec3 eye;
    float near;
};

void corner() {
    corner_all = all_light[gl_VertexIndex];
    corner_direct = direct_light[gl_VertexIndex];
    corner_uv = uv;
    corner_share = vec3(equal(uvec3(gl_VertexIndex % 3), uvec3(0, 1, 2)));
    corner_position = position;
    triangle_normal = normal;
    corner_triangle = gl_VertexIndex / 3;
    vec4 p = vec4(position, 1.0);
    gl_Position = vec4(dot(p, x), dot(p, y), near, dot(p, w));
}
