// As view_mesh.vert, with where pictures drawn before show the corner: by the fragment that would
// be many loads.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#define LAID
#include "shared/view_corner.glsl"
