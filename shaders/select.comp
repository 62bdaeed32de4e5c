// Chooses the sources of a batch: those to be drawn with the most unshot power (Southwell), ties to the lower index, and of
// those whose form factors are kept all that come near the strongest in power, in the order of their indices, or none while they wait
// for emission to be drawn. One workgroup.
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
layout(scalar, binding = 5) readonly buffer KeptRows { KeptRow kept_rows[]; };
// Of the passes over elements, without and with relief, for slots that are drawn, and for light that is emitted.
layout(scalar, binding = 6) buffer DrawnCommands { ReceiverList drawn_commands[2]; };
layout(scalar, binding = 7) buffer EmittingCommands { ReceiverList emitting_commands[2]; };

layout(push_constant, scalar) uniform Parameters {
    uint source_count;
    uint fresh_slots;    // for sources that are drawn; those for kept ones follow
    uint replay_slots;
    uint shot_limit;
    float stop_power;    // stops when all emission is shot and no more reflected power than this is unshot
    float least_emitted; // above 0: chooses only sources whose emission is unshot and has this power, and replays none
};

shared float best_power[SELECT_GROUP];
shared uint best_source[SELECT_GROUP];
// Unshot power: emitted, of it what is to be drawn; reflected; and all that kept sources have to send.
shared vec4 sums[SELECT_GROUP];
shared float best_kept[SELECT_GROUP];
shared uint replays_before[SELECT_GROUP];
shared uint emitting;

bool is_kept(uint s) {
    return kept_rows[s].chunk != NONE;
}

// Whether a source that has something to send is to be drawn.
bool may_draw(uint s) {
    Source source = sources[s];
    float emitted = (source.emitted.r + source.emitted.g + source.emitted.b) * (source.kind == KIND_POINT ? 6.28318531 : source.area);
    return !is_kept(s) && (least_emitted == 0.0 || shot[s].w == SHOT_NOTHING && emitted >= least_emitted);
}

// This invocation's own best of the sources that it looks after and that need drawing.
void scan(uint lane) {
    float power = 0.0;
    uint source = NONE;
    for (uint s = lane; s < source_count; s += SELECT_GROUP) {
        if (unshot[s].w > power && may_draw(s)) {
            power = unshot[s].w;
            source = s;
        }
    }
    best_power[lane] = power;
    best_source[lane] = source;
}

// Gives a slot all that a source has left.
void shoot(uint slot, uint source) {
    bool emission_left = shot[source].w == SHOT_NOTHING;
    vec3 of_reflected = unshot[source].rgb;
    if (emission_left && sources[source].emitted != vec3(0.0)) {
        atomicOr(emitting, 1);
    }
    slots[slot] = Slot(emission_left ? sources[source].emitted : vec3(0.0), source, of_reflected, is_kept(source) ? kept_rows[source].scale : 1.0);
    shot[source] = vec4(shot[source].rgb + of_reflected, SHOT_EMISSION);
    unshot[source].w = 0.0;
}

void main() {
    uint lane = gl_LocalInvocationID.x;
    float emitted = 0.0;
    float to_draw = 0.0;
    float reflected = 0.0;
    float of_kept = 0.0;
    float kept = 0.0;
    for (uint s = lane; s < source_count; s += SELECT_GROUP) {
        vec3 rgb = abs(unshot[s].rgb);
        bool emission_left = shot[s].w == SHOT_NOTHING;
        float of_reflected = sources[s].kind == KIND_POINT ? 0.0 : sources[s].area * (rgb.r + rgb.g + rgb.b);
        reflected += emission_left ? of_reflected : unshot[s].w;
        float of_emitted = emission_left && sources[s].emitted != vec3(0.0) ? max(unshot[s].w - of_reflected, 0.0) : 0.0;
        emitted += of_emitted;
        to_draw += is_kept(s) ? 0.0 : of_emitted;
        of_kept += is_kept(s) ? unshot[s].w : 0.0;
        kept = is_kept(s) && least_emitted == 0.0 ? max(kept, unshot[s].w) : kept;
    }
    best_kept[lane] = kept;
    sums[lane] = vec4(emitted, to_draw, reflected, of_kept);
    emitting = 0;
    scan(lane);
    barrier();
    for (uint half_count = SELECT_GROUP / 2; half_count > 0; half_count /= 2) {
        if (lane < half_count) {
            sums[lane] += sums[lane + half_count];
            best_kept[lane] = max(best_kept[lane], best_kept[lane + half_count]);
        }
        barrier();
    }
    float unshot_emitted = sums[0].x;
    float emission_to_draw = sums[0].y;
    float unshot_reflected = sums[0].z;
    // All emission is drawn in the end. While kept sources have less to send than that, or too little to go on for, they wait: else all
    // would be replayed after every few weak emitters.
    bool replays_wait = emission_to_draw > 0.0 && sums[0].w <= max(emission_to_draw, stop_power);
    float kept_power = replays_wait ? 0.0 : best_kept[0];
    uint shots = progress.shots;
    barrier();
    bool stop = unshot_emitted == 0.0 && unshot_reflected <= stop_power;
    uint shots_left = stop ? 0 : shot_limit - min(shots, shot_limit);
    uint wanted = min(fresh_slots, shots_left);

    // Draw: a tournament.
    float top = kept_power;
    uint chosen = 0;
    for (uint slot = 0; slot < fresh_slots; slot++) {
        // Every invocation walks the same list of the lanes' bests, in which the lower index wins a tie.
        uint winner = NONE;
        if (slot < wanted) {
            float power = 0.0;
            for (uint l = 0; l < SELECT_GROUP; l++) {
                if (best_power[l] > power || (best_power[l] == power && best_source[l] < winner)) {
                    power = best_power[l];
                    winner = best_source[l];
                }
            }
            top = max(top, power);
            // Replaying costs next to nothing: as long as a kept source has more to send and need not wait, nothing is drawn.
            if (power < kept_power) {
                winner = NONE;
                wanted = slot;
            }
        }
        barrier();
        if (winner == NONE) {
            if (lane == 0) {
                slots[slot].source = NONE;
            }
            continue;
        }
        chosen++;
        if (winner % SELECT_GROUP == lane) {
            shoot(slot, winner);
            scan(lane);
        }
        barrier();
    }

    // Replay: each invocation looks after a range of sources, and its slots follow those of the invocations before it.
    uint most = replays_wait ? 0 : min(replay_slots, shots_left - chosen);
    float least = top / float(REPLAY_SHARE);
    uint share = (source_count + SELECT_GROUP - 1) / SELECT_GROUP;
    uint begin = min(lane * share, source_count);
    uint end = min(begin + share, source_count);
    uint mine = 0;
    for (uint s = begin; s < end && most > 0; s++) {
        mine += is_kept(s) && unshot[s].w > 0.0 && unshot[s].w >= least ? 1 : 0;
    }
    replays_before[lane] = mine;
    barrier();
    uint before = 0;
    uint all = 0;
    for (uint l = 0; l < SELECT_GROUP; l++) {
        before += l < lane ? replays_before[l] : 0;
        all += replays_before[l];
    }
    uint replayed = min(all, most);
    for (uint s = begin; s < end && before < most && mine > 0; s++) {
        if (is_kept(s) && unshot[s].w > 0.0 && unshot[s].w >= least) {
            shoot(fresh_slots + before, s);
            before++;
            mine--;
        }
    }
    for (uint slot = replayed + lane; slot < replay_slots; slot += SELECT_GROUP) {
        slots[fresh_slots + slot].source = NONE;
    }
    barrier();
    if (lane == 0) {
        for (uint i = 0; i < 2; i++) {
            drawn_commands[i].groups_y = min(chosen, 1);
            emitting_commands[i].groups_y = emitting;
        }
        progress = Progress(unshot_emitted, unshot_reflected, shots + chosen + replayed, chosen, replayed);
    }
}
