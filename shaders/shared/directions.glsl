// Directions of the hemisphere about z in cells of equal solid angle, columns × rows of the
// concentric map's square: src/math/directions.rs is the same in f64.

// From the hemisphere to the square −1..1; a direction below the horizon is taken to the nearest on
// it.
vec2 to_square(vec3 direction) {
    const float QUARTER = 1.57079633;
    float r = sqrt(1.0 - clamp(direction.z, 0.0, 1.0));
    float angle = atan(direction.y, direction.x);
    float turned = angle < -0.5 * QUARTER ? angle + 4.0 * QUARTER : angle;
    float quarter = clamp(floor((turned + 0.5 * QUARTER) / QUARTER), 0.0, 3.0);
    float across = (turned - quarter * QUARTER) / (0.5 * QUARTER) * r;
    switch (int(quarter)) {
    case 0: return vec2(r, across);
    case 1: return vec2(-across, r);
    case 2: return vec2(-r, -across);
    default: return vec2(across, -r);
    }
}

vec3 from_square(vec2 square) {
    const float EIGHTH = 0.785398163;
    if (square == vec2(0.0)) {
        return vec3(0.0, 0.0, 1.0);
    }
    bool by_x = abs(square.x) > abs(square.y);
    float r = by_x ? square.x : square.y;
    float angle = by_x ? EIGHTH * (square.y / square.x) : 2.0 * EIGHTH - EIGHTH * (square.x / square.y);
    float flat_part = r * sqrt(max(2.0 - r * r, 0.0));
    return vec3(flat_part * cos(angle), flat_part * sin(angle), 1.0 - r * r);
}

// The cell that holds a place of the square.
uint cell_of(vec2 square, uvec2 cells) {
    uvec2 cell = min(uvec2((square * 0.5 + 0.5) * vec2(cells)), cells - 1);
    return cell.y * cells.x + cell.x;
}

// The middle of a direction's cell.
vec3 direction_centre(uint k, uvec2 cells) {
    return from_square((2.0 * vec2(k % cells.x, k / cells.x) + 1.0) / vec2(cells) - 1.0);
}

// The four directions about one, bilinear between the middles of the cells and held at the square's
// border.
struct Look {
    uvec4 k;
    vec4 weight;
};

// For a place of the square.
Look look_at(vec2 square, uvec2 cells) {
    vec2 at = clamp((square * 0.5 + 0.5) * vec2(cells) - 0.5, vec2(0.0), vec2(cells - 1));
    uvec2 low = min(uvec2(at), cells - 2);
    vec2 f = at - vec2(low);
    uint first = low.y * cells.x + low.x;
    return Look(uvec4(first, first + 1, first + cells.x, first + cells.x + 1),
                vec4((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y));
}

Look look(vec3 direction, uvec2 cells) {
    return look_at(to_square(direction), cells);
}
