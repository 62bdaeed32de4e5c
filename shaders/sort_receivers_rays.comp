// As sort_receivers.comp; shadow rays say what is seen.
#version 460
#extension GL_GOOGLE_include_directive : require
#define SHADOW_RAYS
#include "shared/sort_receivers.glsl"
