// What elements with a relief see of far lights, by a few places of each.
#version 460
#extension GL_GOOGLE_include_directive : require
#define VECTOR_FLUX
#define RAYS SURVEY_ELEMENTS
#define ONE_WAY
#include "shared/light_rows.glsl"
#include "shared/light_survey.glsl"
