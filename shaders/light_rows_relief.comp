// What elements with a relief see of far lights, by all places of each.
#version 460
#extension GL_GOOGLE_include_directive : require
#define VECTOR_FLUX
#define RAYS 1
#include "shared/light_rows.glsl"
#include "shared/light_lit.glsl"
