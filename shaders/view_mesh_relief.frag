// A surface with relief in a window: as view_mesh.frag, on the normals of the relief.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#define RELIEF
#include "shared/view_mesh.glsl"
