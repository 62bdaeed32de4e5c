// As form_factors.comp, for elements with a relief: form factors as vectors in the element's frame,
// so that each knows where its light comes from.
#version 460
#extension GL_GOOGLE_include_directive : require
#define VECTOR_FLUX
#include "shared/form_factors.glsl"
