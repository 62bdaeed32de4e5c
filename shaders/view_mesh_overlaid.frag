// As view_mesh_laid.frag; over it, outlines of elements, colours of sources, and the element that
// is marked.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
#define LAID
#define OVERLAID
#include "shared/view_mesh.glsl"
