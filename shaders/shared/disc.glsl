// A source seen wide, as an ellipse of even radiance about the direction of its light and above the
// horizon, of which only the vector f is known (its dot product with a normal is the form factor to
// a facet with that normal): points of the ellipse, with f's share of each. src/reference/disc.rs
// is the same in f64.

struct Disc {
    vec3 axis;
    vec3 up;           // towards the normal
    vec3 side;
    float strength;    // of a point
    float rise;        // half axes of the ellipse's projection along the axis
    float width;
    uint points;
};

// Seen within less than 6° of its middle a source is a point.
const float WIDE = 0.01;
// Wider than 18°: twice as many points.
const float WIDEST = 0.1;

// No points where f is 0.
Disc disc_of(vec3 f) {
    float size = length(f);
    uint points = size == 0.0 ? 0 : size < WIDE ? 1 : size < WIDEST ? 8 : 16;
    vec3 axis = size == 0.0 ? vec3(0.0, 0.0, 1.0) : f / size;
    float flat_part = length(axis.xy);
    vec2 away = flat_part > 1e-6 ? axis.xy / flat_part : vec2(1.0, 0.0);
    // Projected, a cone of half angle θ has the area π sin² θ = π |f|, and it ends at the horizon.
    float rise = min(sqrt(size), axis.z);
    float width = min(size / max(rise, 1e-6), 1.0);
    vec3 up = vec3(-axis.z * away, flat_part);
    return Disc(axis, up, vec3(-away.y, away.x, 0.0), size / float(max(points, 1)), rise, width, points);
}

// Points lie in pairs on either side of the axis, so that their sum is f.
vec3 disc_point(Disc disc, uint j) {
    if (disc.points == 1) {
        return disc.strength * disc.axis;
    }
    float r = sqrt((float(j / 2) + 0.5) / float(disc.points / 2));
    float angle = 2.39996323 * float(j / 2);
    vec2 p = ((j & 1) == 0 ? r : -r) * vec2(disc.width * cos(angle), disc.rise * sin(angle));
    float along = sqrt(max(1.0 - dot(p, p), 1e-4));
    // Of even shares of the projection: a point's light counts by its cosine to the axis.
    return disc.strength * (disc.axis + (p.x * disc.side + p.y * disc.up) / along);
}
