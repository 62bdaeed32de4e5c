// Lists all light that was shot by the sources whose form factors are kept, for elements with a relief to take it in by direction;
// from now on sources with a relief send by direction, and first of all what of this light should have gone elsewhere. One
// invocation a source.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.glsl"

layout(local_size_x = GROUP) in;

layout(scalar, binding = 0) readonly buffer Sources { Source sources[]; };
layout(scalar, binding = 1) readonly buffer KeptRows { KeptRow kept_rows[]; };
layout(scalar, binding = 2) buffer Shot { vec4 shot[]; };
// [source]
layout(scalar, binding = 3) writeonly buffer Recalled { Slot recalled[]; };
// Reflected light that each source has been given to send so far, [relief source][direction].
layout(scalar, binding = 4) writeonly buffer ShotExits { vec3 shot_exits[]; };

layout(push_constant, scalar) uniform Parameters {
    uint source_count;
    uint first_relief_source;
    uint relief_source_count;
    uint directions;
};

void main() {
    uint s = gl_GlobalInvocationID.x;
    if (s >= source_count) {
        return;
    }
    vec4 sent = shot[s];
    KeptRow row = kept_rows[s];
    bool kept = row.chunk != NONE;
    vec3 emitted = kept && sent.w != SHOT_NOTHING ? sources[s].emitted : vec3(0.0);
    recalled[s] = Slot(emitted, s, kept ? sent.rgb : vec3(0.0), row.scale);
    uint of_relief = s - first_relief_source;
    if (of_relief < relief_source_count) {
        for (uint k = 0; k < directions; k++) {
            shot_exits[of_relief * directions + k] = sent.rgb;
        }
        if (sent.w != SHOT_NOTHING) {
            shot[s].w = SHOT_EVENLY;
        }
    }
}
