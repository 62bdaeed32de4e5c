// As form_factors_relief.comp, with shadow rays for whether the source is seen.
#version 460
#extension GL_GOOGLE_include_directive : require
#define SHADOW_RAYS
#define VECTOR_FLUX
#include "shared/form_factors.glsl"
