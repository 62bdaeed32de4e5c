// A corner of a triangle, with barycentric coordinates for its fragments.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#define OVERLAY
#include "shared/view_corner.glsl"
