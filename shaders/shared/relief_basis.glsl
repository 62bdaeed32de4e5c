// The functions u_r of the direction of incoming light in which a response is a short sum:
// src/meso/basis.rs. An element's coefficients are Σ E u_r(ω). Including files have the binding
// `bases`, [response][fine cell][rank].

// The functions at some direction, or a sum over directions.
const uint RANK_TEXELS = RELIEF_RANK / 4;
struct Functions {
    vec4 u[RANK_TEXELS];
};

Functions no_functions() {
    Functions functions;
    for (uint t = 0; t < RANK_TEXELS; t++) {
        functions.u[t] = vec4(0.0);
    }
    return functions;
}

// Adds those of the direction at a place of the square.
void add_functions(inout Functions functions, uint response, vec2 square, float weight) {
    Look at = look_at(square, uvec2(FINE_DIRECTIONS));
    uint first = response * FINE_DIRECTIONS * FINE_DIRECTIONS;
    for (uint n = 0; n < 4; n++) {
        uint row = RANK_TEXELS * (first + at.k[n]);
        float share = weight * at.weight[n];
        for (uint t = 0; t < RANK_TEXELS; t++) {
            functions.u[t] += share * fetch(bases, row + t);
        }
    }
}

void add_light(inout vec3 coefficients[RELIEF_RANK], Functions functions, vec3 light) {
    for (uint t = 0; t < RANK_TEXELS; t++) {
        for (uint n = 0; n < 4; n++) {
            coefficients[4 * t + n] += functions.u[t][n] * light;
        }
    }
}
