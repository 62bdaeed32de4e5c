// Lambert's formula for the form factor from a point to a polygon: src/form_factor.rs is the same
// in f64.

// θ / sin θ for the angle θ of which x is the cosine, |error| < 3e-7. A polynomial serves x in
// 0..1, where the function is smooth (its pole is at −1); the other half follows from θ(−x) = π −
// θ(x).
float acute_angle_over_sine(float x) {
    float g = 1.7478988e-2;
    g = g * x - 9.7265430e-2;
    g = g * x + 2.5208697e-1;
    g = g * x - 4.2358306e-1;
    g = g * x + 5.5655622e-1;
    g = g * x - 6.6096932e-1;
    g = g * x + 7.8488100e-1;
    g = g * x - 9.9998152e-1;
    return g * x + 1.5707963;
}

// The same for all x. The caller passes 1/sin: beside an edge the sine is far below what
// 1 − x² resolves.
float angle_over_sine(float x, float over_sine) {
    float g = acute_angle_over_sine(abs(x));
    return x >= 0.0 ? g : 3.14159265 * over_sine - g;
}

// What edges sum up to: the form factor, or with VECTOR_FLUX the vector whose dot product with n is
// the form factor.
#ifdef VECTOR_FLUX
#define FLUX vec3
#else
#define FLUX float
#endif

// A vector as it counts for a receiver with normal n.
FLUX flux(vec3 v, vec3 n) {
#ifdef VECTOR_FLUX
    return v;
#else
    return dot(v, n);
#endif
}

// Nothing where the receiver would take less than nothing.
FLUX flux_above(FLUX f, vec3 n) {
#ifdef VECTOR_FLUX
    return dot(f, n) > 0.0 ? f : vec3(0.0);
#else
    return max(f, 0.0);
#endif
}

// One edge a → b seen from the origin by a receiver with normal n: its angle times the unit normal
// of its plane.
FLUX edge_term(vec3 a, vec3 b, vec3 n) {
    vec3 across = cross(a, b);
    float lengths = max(dot(a, a) * dot(b, b), 1e-38);
    float scale = inversesqrt(lengths);
    float over_sine = sqrt(lengths) * inversesqrt(max(dot(across, across), 1e-38));
    return flux(across, n) * scale * angle_over_sine(clamp(dot(a, b) * scale, -1.0, 1.0), over_sine);
}

// The crossing of a → b with the receiver's horizon, ha and hb being their heights above it.
vec3 horizon(vec3 a, vec3 b, float ha, float hb) {
    return a + (b - a) * (ha / (ha - hb));
}

const float INV_TWO_PI = 0.15915494;

// A closed contour, clipped to the horizon of n while its edges stream by (Sutherland–Hodgman).
struct Contour {
    FLUX sum;
    bool left;         // gone below the horizon at exit_point
    bool entered;      // came up at first_entry before it ever left
    vec3 exit_point;
    vec3 first_entry;
};

Contour contour_begin() {
    return Contour(FLUX(0.0), false, false, vec3(0.0), vec3(0.0));
}

// The edge p → q, seen from the receiver.
void contour_edge(inout Contour c, vec3 p, vec3 q, vec3 n) {
    float hp = dot(p, n);
    float hq = dot(q, n);
    if (hp <= 0.0 && hq <= 0.0) {
        return;
    }
    if (hp <= 0.0) {
        p = horizon(p, q, hp, hq);
        if (c.left) {
            c.sum += edge_term(c.exit_point, p, n);
            c.left = false;
        } else {
            c.first_entry = p;
            c.entered = true;
        }
    } else if (hq <= 0.0) {
        q = horizon(p, q, hp, hq);
        c.exit_point = q;
        c.left = true;
    }
    c.sum += edge_term(p, q, n);
}

// Closes one loop of the contour; another may follow.
void contour_close(inout Contour c, vec3 n) {
    if (c.left && c.entered) {
        c.sum += edge_term(c.exit_point, c.first_entry, n);
    }
    c.left = false;
    c.entered = false;
}

// Form factor from the receiver to what the contour encloses, positive for contours
// counter-clockwise from their front.
FLUX contour_form_factor(Contour c) {
    return -c.sum * INV_TWO_PI;
}
