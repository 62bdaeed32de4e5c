// Irradiance of every element from the sources of a batch, in scenes without relief.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/gather_even.glsl"
