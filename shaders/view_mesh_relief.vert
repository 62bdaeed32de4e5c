// A corner of a triangle with relief in a window.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#define RELIEF
#include "shared/view_corner.glsl"
