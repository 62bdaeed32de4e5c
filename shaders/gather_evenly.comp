// As gather.comp, for elements with a relief as long as all sources send evenly: their moments follow once that light is solved.
#version 460
#extension GL_GOOGLE_include_directive : require
#define RELIEF_EVENLY
#include "shared/gather.glsl"
