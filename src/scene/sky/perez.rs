//! The all-weather sky of R. Perez, R. Seals and J. Michalsky, "All-weather model for sky luminance
//! distribution — preliminary configuration and validation", Solar Energy 50 (1993).

/// The sky of a moment, by what is measured of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Perez {
    /// Irradiance by the sun of a surface that faces it, W·m⁻².
    pub direct_normal: f64,
    /// Irradiance by the sky of the open ground, W·m⁻².
    pub diffuse_horizontal: f64,
    /// Height of the sun above the horizon, degrees in 0..=90.
    pub sun_height: f64,
}

/// Irradiance beyond the atmosphere, W·m⁻², as the authors take it.
const EXTRATERRESTRIAL: f64 = 1367.0;

/// The brightness of skies that were measured; beyond it the coefficients run away.
const BRIGHTNESS: std::ops::RangeInclusive<f64> = 0.01..=0.6;

/// Upper ends of the classes of clearness but for the last, which is open.
const CLASSES: [f64; 7] = [1.065, 1.23, 1.5, 1.95, 2.8, 4.5, 6.2];

/// x₁ to x₄ of each of a, b, c, d and e, by class: x = x₁ + x₂ Z + Δ (x₃ + x₄ Z).
const TABLE: [[[f64; 4]; 5]; 8] = [
    [
        [1.3525, -0.2576, -0.2690, -1.4366],
        [-0.7670, 0.0007, 1.2734, -0.1233],
        [2.8000, 0.6004, 1.2375, 1.0000],
        [1.8734, 0.6297, 0.9738, 0.2809],
        [0.0356, -0.1246, -0.5718, 0.9938],
    ],
    [
        [-1.2219, -0.7730, 1.4148, 1.1016],
        [-0.2054, 0.0367, -3.9128, 0.9156],
        [6.9750, 0.1774, 6.4477, -0.1239],
        [-1.5798, -0.5081, -1.7812, 0.1080],
        [0.2624, 0.0672, -0.2190, -0.4285],
    ],
    [
        [-1.1000, -0.2515, 0.8952, 0.0156],
        [0.2782, -0.1812, -4.5000, 1.1766],
        [24.7219, -13.0812, -37.7000, 34.8438],
        [-5.0000, 1.5218, 3.9229, -2.6204],
        [-0.0156, 0.1597, 0.4199, -0.5562],
    ],
    [
        [-0.5484, -0.6654, -0.2672, 0.7117],
        [0.7234, -0.6219, -5.6812, 2.6297],
        [33.3389, -18.3000, -62.2500, 52.0781],
        [-3.5000, 0.0016, 1.1477, 0.1062],
        [0.4659, -0.3296, -0.0876, -0.0329],
    ],
    [
        [-0.6000, -0.3566, -2.5000, 2.3250],
        [0.2937, 0.0496, -5.6812, 1.8415],
        [21.0000, -4.7656, -21.5906, 7.2492],
        [-3.5000, -0.1554, 1.4062, 0.3988],
        [0.0032, 0.0766, -0.0656, -0.1294],
    ],
    [
        [-1.0156, -0.3670, 1.0078, 1.4051],
        [0.2875, -0.5328, -3.8500, 3.3750],
        [14.0000, -0.9999, -7.1406, 7.5469],
        [-3.4000, -0.1078, -1.0750, 1.5702],
        [-0.0672, 0.4016, 0.3017, -0.4844],
    ],
    [
        [-1.0000, 0.0211, 0.5025, -0.5119],
        [-0.3000, 0.1922, 0.7023, -1.6317],
        [19.0000, -5.0000, 1.2438, -1.9094],
        [-4.0000, 0.0250, 0.3844, 0.2656],
        [1.0468, -0.3788, -2.4517, 1.4656],
    ],
    [
        [-1.0500, 0.0289, 0.4260, 0.3590],
        [-0.3250, 0.1156, 0.7781, 0.0025],
        [31.0625, -14.5000, -46.1148, 55.3750],
        [-7.2312, 0.4050, 13.3500, 0.6234],
        [1.5000, -0.6426, 1.8564, 0.5636],
    ],
];

impl Perez {
    /// ε: 1 for an overcast sky, some 6 and more for a clear one.
    pub fn clearness(&self) -> f64 {
        let of_sun = 1.041 * self.zenith_angle().powi(3);
        let ratio = 1.0 + self.direct_normal / self.diffuse_horizontal;
        (ratio + of_sun) / (1.0 + of_sun)
    }

    /// Δ.
    pub fn brightness(&self) -> f64 {
        let height = self.sun_height;
        // The mass of air on the way, by Kasten (1966).
        let mass = 1.0 / (height.to_radians().sin() + 0.15 * (height + 3.885).powf(-1.253));
        mass * self.diffuse_horizontal / EXTRATERRESTRIAL
    }

    /// a, b, c, d and e of [`super::Form::Perez`].
    pub fn coefficients(&self) -> [f64; 5] {
        let (epsilon, z) = (self.clearness(), self.zenith_angle());
        let class = CLASSES.partition_point(|&end| end <= epsilon);
        // In the middle classes b rises above 0 where the sky is darker than those measured, and
        // the horizon would be endlessly bright.
        let delta = self
            .brightness()
            .clamp(*BRIGHTNESS.start(), *BRIGHTNESS.end());
        let delta = match class {
            1..=4 => delta.max(0.2),
            _ => delta,
        };
        let rows = TABLE[class];
        let [a, b, mut c, mut d, e] =
            rows.map(|[x1, x2, x3, x4]| x1 + x2 * z + delta * (x3 + x4 * z));
        if class == 0 {
            let ([c1, c2, c3, c4], [d1, d2, d3, d4]) = (rows[2], rows[3]);
            c = (delta * (c1 + c2 * z)).max(0.0).powf(c3).exp() - c4;
            d = -(delta * (d1 + d2 * z)).exp() + d3 + delta * d4;
        }
        [a, b.min(0.0), c, d, e]
    }

    /// Radians.
    fn zenith_angle(&self) -> f64 {
        (90.0 - self.sun_height).to_radians()
    }
}
