// As gather.comp, for elements without relief in a scene where some sources have one: those send by
// direction.
#version 460
#extension GL_GOOGLE_include_directive : require
#define FROM_RELIEF
#include "shared/gather_even.glsl"
