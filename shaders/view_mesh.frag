// A surface in a window as sRGB codes: its radiance L = ρ(u, v) · E / π + Le by the light of the corners; over it, outlines of elements
// and colours of sources.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shared/view_mesh.glsl"

vec3 shown() {
    return lit();
}
