// As form_factors.comp, with shadow rays for whether the source is seen.
#version 460
#extension GL_GOOGLE_include_directive : require
#define SHADOW_RAYS
#include "shared/form_factors.glsl"
