// A corner of a prism that encloses a triangle's relief: reversed infinite depth, as in shade.vert.

layout(location = 0) in vec3 position;     // from the eye, internal units
layout(location = 1) in uint prism;

layout(location = 0) out vec3 corner_position;
layout(location = 1) flat out uint corner_prism;

layout(push_constant, scalar) uniform Parameters {
    vec3 x;
    vec3 y;
    vec3 w;
    float near;
};

void main() {
    corner_position = position;
    corner_prism = prism;
    gl_Position = vec4(dot(position, x), dot(position, y), near, dot(position, w));
}
