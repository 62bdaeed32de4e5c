// The ID of the element seen. It comes with the triangle's corners: the number of the primitive is
// not known to devices without geometry shaders.
#version 460

layout(location = 0) flat in uint drawn_item;
layout(location = 0) out uint item;

void main() {
    item = drawn_item;
}
