// What a source with a relief sends towards `local`, a unit vector in its hemicube's frame: emitted
// light for `kind` 0, reflected light for 1. Including files have the binding exits,
// [slot][emitted, reflected][direction], and `cells` of the directions' square.

vec3 sent_towards(uint slot, uint kind, vec3 local) {
    Look at = look(local, cells);
    uint first = (2 * slot + kind) * cells.x * cells.y;
    vec3 sent = vec3(0.0);
    for (uint i = 0; i < 4; i++) {
        sent += at.weight[i] * fetch(exits, first + at.k[i]).xyz;
    }
    return sent;
}
