// As view_mesh.frag, but what pictures drawn before show there comes first. A shader of its own:
// drivers that mask branches would do its work for every surface.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#define LAID
#include "shared/view_mesh.glsl"
