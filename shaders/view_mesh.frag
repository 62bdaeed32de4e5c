// A surface in a window by the light of its corners. As few values as can be lead from corners to
// fragments: a software driver sets each up for every triangle.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#include "shared/view_mesh.glsl"
