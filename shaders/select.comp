// Chooses the sources of a batch: those with the most unshot power (Southwell), ties to the lower index. One workgroup.
// When the stop rule holds it chooses none, so that batches already submitted do nothing.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/types.glsl"

layout(local_size_x = SELECT_GROUP) in;

layout(scalar, binding = 0) readonly buffer Sources { Source sources[]; };
layout(scalar, binding = 1) buffer Shot { vec4 shot[]; };
layout(scalar, binding = 2) buffer Unshot { vec4 unshot[]; };
layout(scalar, binding = 3) writeonly buffer Slots { Slot slots[]; };
layout(scalar, binding = 4) buffer State { Progress progress; };

layout(push_constant, scalar) uniform Parameters {
    uint source_count;
    uint slot_count;
    uint shot_limit;
    float stop_power;    // stops when all emission is shot and no more reflected power than this is unshot
};

shared float best_power[SELECT_GROUP];
shared uint best_source[SELECT_GROUP];
shared float sum_emitted[SELECT_GROUP];
shared float sum_reflected[SELECT_GROUP];

// This invocation's own best of the sources that it looks after.
void scan(uint lane) {
    float power = 0.0;
    uint source = NONE;
    for (uint s = lane; s < source_count; s += SELECT_GROUP) {
        if (unshot[s].w > power) {
            power = unshot[s].w;
            source = s;
        }
    }
    best_power[lane] = power;
    best_source[lane] = source;
}

void main() {
    uint lane = gl_LocalInvocationID.x;
    float emitted = 0.0;
    float reflected = 0.0;
    for (uint s = lane; s < source_count; s += SELECT_GROUP) {
        vec3 rgb = unshot[s].rgb;
        float of_reflected = sources[s].kind == KIND_POINT ? 0.0 : sources[s].area * (rgb.r + rgb.g + rgb.b);
        reflected += of_reflected;
        emitted += shot[s].w == 0.0 ? max(unshot[s].w - of_reflected, 0.0) : 0.0;
    }
    sum_emitted[lane] = emitted;
    sum_reflected[lane] = reflected;
    scan(lane);
    barrier();
    for (uint half_count = SELECT_GROUP / 2; half_count > 0; half_count /= 2) {
        if (lane < half_count) {
            sum_emitted[lane] += sum_emitted[lane + half_count];
            sum_reflected[lane] += sum_reflected[lane + half_count];
        }
        barrier();
    }
    float unshot_emitted = sum_emitted[0];
    float unshot_reflected = sum_reflected[0];
    uint shots = progress.shots;
    barrier();
    bool stop = unshot_emitted == 0.0 && unshot_reflected <= stop_power;
    uint wanted = stop ? 0 : min(slot_count, shot_limit - min(shots, shot_limit));

    uint chosen = 0;
    for (uint slot = 0; slot < slot_count; slot++) {
        // Every invocation walks the same list of the lanes' bests: a tournament in which the lower index wins a tie.
        uint winner = NONE;
        if (slot < wanted) {
            float power = 0.0;
            for (uint l = 0; l < SELECT_GROUP; l++) {
                if (best_power[l] > power || (best_power[l] == power && best_source[l] < winner)) {
                    power = best_power[l];
                    winner = best_source[l];
                }
            }
        }
        barrier();
        if (winner == NONE) {
            if (lane == 0) {
                slots[slot] = Slot(vec3(0.0), NONE, vec3(0.0));
            }
            continue;
        }
        chosen++;
        if (winner % SELECT_GROUP == lane) {
            bool emission_left = shot[winner].w == 0.0;
            vec3 of_reflected = unshot[winner].rgb;
            slots[slot] = Slot(emission_left ? sources[winner].emitted : vec3(0.0), winner, of_reflected);
            shot[winner] = vec4(shot[winner].rgb + of_reflected, 1.0);
            unshot[winner].w = 0.0;
            scan(lane);
        }
        barrier();
    }
    if (lane == 0) {
        progress = Progress(unshot_emitted, unshot_reflected, shots + chosen, chosen);
    }
}
