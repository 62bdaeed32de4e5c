// What a source with a relief sends towards `local`, a unit vector in its hemicube's frame: the slot's own light, by direction.
// Including files have the binding exits, [slot][emitted, reflected][direction], and `cells` of the directions' square.

void send_by_direction(uint slot, vec3 local, inout vec3 emitted, inout vec3 reflected) {
    Look at = look(local, cells);
    uint count = cells.x * cells.y;
    uint first = 2 * slot * count;
    bool emits = emitted != vec3(0.0);
    emitted = vec3(0.0);
    reflected = vec3(0.0);
    for (uint i = 0; i < 4; i++) {
        if (emits) {
            emitted += at.weight[i] * exits[first + at.k[i]];
        }
        reflected += at.weight[i] * exits[first + count + at.k[i]];
    }
}
