// A corner of a panel's triangle.
#version 460

layout(location = 0) in vec2 position;     // points from the left top
layout(location = 1) in vec2 uv;
layout(location = 2) in vec4 colour;       // sRGB codes, multiplied by alpha

layout(location = 0) out vec2 corner_uv;
layout(location = 1) out vec4 corner_colour;

layout(push_constant) uniform Parameters {
    vec2 size;                             // of the window, points
};

void main() {
    corner_uv = uv;
    corner_colour = colour;
    gl_Position = vec4(2.0 * position / size - 1.0, 0.0, 1.0);
}
