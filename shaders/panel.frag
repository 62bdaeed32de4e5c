// A panel's triangle. Colours are multiplied and laid over one another as sRGB codes, as egui
// expects.
#version 460

layout(location = 0) in vec2 corner_uv;
layout(location = 1) in vec4 corner_colour;

layout(location = 0) out vec4 code;

layout(binding = 0) uniform sampler2D image;

void main() {
    code = corner_colour * texture(image, corner_uv);
}
