//! Twin of the receiver estimator: form factors and visibility of one source for every element, in
//! f64.

use std::f64::consts::PI;

use glam::DVec3;

use crate::constants::{KIND_POINT, NONE};
use crate::math::form_factor::{sample_points, to_polygon};
use crate::math::hemicube::{Pixel, direction_of, pixel_of, texel_of};
use crate::mesh::elements::Elements;
use crate::mesh::sources::{Part, Source};

/// Rounding of a plane's height at a point, as in the shader.
const HEIGHT_EPSILON: f64 = 1e-6;
/// Largest distance between two points of one surface, in footprints of a pixel, as in the shader.
const REACH: f64 = 1.5;
/// Sine of the angle up to which two surfaces that meet are one smooth surface, as in the shader.
const SMOOTH: f64 = 0.35;

/// Mean over an element of form factor times visibility: irradiance from a unit of the source's
/// radiosity. `seen` says whether the source sees a place. What sees much of a curved source
/// receives it part by part instead, so that the centroid stands for an element beside one.
pub fn gather(
    elements: &Elements,
    source: &Source,
    element: usize,
    seen: impl Fn(DVec3) -> bool,
) -> f64 {
    let triangle = elements.triangle(element);
    let centroid = elements.centroid[element];
    let size = elements.radius(element);
    let gap = gap_to(source, centroid);
    if gap > 4.0 * size && lies_in_plane(centroid, elements.normal[element], source) {
        return 0.0;
    }
    let plane = source.kind == KIND_POINT || source.cone == 0.0;
    let points = sample_points(plane && gap <= 4.0 * size, plane && gap <= size);
    points
        .iter()
        .map(|&[u, v, weight]| {
            let p = triangle[0] + u * (triangle[1] - triangle[0]) + v * (triangle[2] - triangle[0]);
            let p = before_plane(p, elements.normal[element], source);
            let f = form_factor(elements, source, p, element);
            if f > 0.0 && seen(p) { weight * f } else { 0.0 }
        })
        .sum()
}

/// Whether an element is so near a source that several of its places are looked at one by one, as
/// in the shader.
pub fn is_near(elements: &Elements, source: &Source, element: usize) -> bool {
    gap_to(source, elements.centroid[element]) <= 4.0 * elements.radius(element)
}

/// As in the shader: the least distance at which a place may lie from a source.
fn gap_to(source: &Source, p: DVec3) -> f64 {
    let d = p - source.centroid;
    let height = match source.kind != KIND_POINT && source.cone == 0.0 {
        true => d.dot(source.normal).abs(),
        false => 0.0,
    };
    (d.length() - source.radius).max(height)
}

/// Cosine of the largest angle between surfaces that count as parallel, as in the shader.
const LEVEL: f64 = 0.99;

/// As in the shader: whether a place lies in the plane of a plane source and its surface is
/// parallel to it.
fn lies_in_plane(p: DVec3, normal: DVec3, source: &Source) -> bool {
    let level = normal.dot(source.normal).abs() >= LEVEL;
    let plane = source.kind != KIND_POINT && source.cone == 0.0;
    plane && level && (p - source.centroid).dot(source.normal) <= HEIGHT_EPSILON
}

/// As in the shader: moves a place that lies in the plane of a source, on a surface not parallel to
/// it, slightly in front of the plane.
fn before_plane(p: DVec3, normal: DVec3, source: &Source) -> DVec3 {
    let height = (p - source.centroid).dot(source.normal);
    let plane = source.kind != KIND_POINT && source.cone == 0.0;
    if plane && height.abs() <= HEIGHT_EPSILON && normal.dot(source.normal).abs() < LEVEL {
        p + (2.0 * HEIGHT_EPSILON - height) * source.normal
    } else {
        p
    }
}

/// Form factor from a point of an element to the source, without occlusion.
fn form_factor(elements: &Elements, source: &Source, p: DVec3, element: usize) -> f64 {
    let normal = elements.normal[element];
    if source.kind == KIND_POINT {
        let d = source.eye - p;
        let side = d.dot(source.normal);
        let mine = if source.cone == 0.0 {
            side <= 0.0
        } else {
            side < 0.0
        };
        return if mine {
            d.dot(normal).max(0.0) / d.length().powi(3)
        } else {
            0.0
        };
    }
    if source.cone == 0.0 {
        if (p - source.centroid).dot(source.normal) <= HEIGHT_EPSILON * source.radius {
            return 0.0;
        }
        return source
            .contour
            .iter()
            .map(|c| to_polygon(p, normal, c))
            .sum::<f64>()
            .max(0.0);
    }
    // A curved source: the sum over the members whose fronts face the point.
    let of_member = |m: usize| {
        let faces = (p - elements.centroid[m]).dot(elements.normal[m]) > 0.0;
        match faces && m != element {
            true => to_polygon(p, normal, &elements.triangle(m)).max(0.0),
            false => 0.0,
        }
    };
    if shows_whole_front(p, source) {
        return source.members().map(of_member).sum();
    }
    // Where some turn away, parts that are far off count as points.
    let of_part = |part: &Part| {
        let way = part.centroid - p;
        let square = way.length_squared();
        if square <= (PART_POINT_DISTANCE * part.radius).powi(2) {
            return part.members.iter().map(|&m| of_member(m as usize)).sum();
        }
        let facing = (-part.vector_area.dot(way)).max(0.0);
        way.dot(normal).max(0.0) * facing / (PI * square * square)
    };
    source.parts.iter().map(of_part).sum()
}

/// Radii of a part from which on it counts as a point, as in the shader.
const PART_POINT_DISTANCE: f64 = 9.0;

/// As in the shader: whether every member of a curved source shows a place its front.
fn shows_whole_front(p: DVec3, source: &Source) -> bool {
    let d = p - source.centroid;
    let height = d.dot(source.normal);
    let flat_part = (d.length_squared() - height * height).max(0.0).sqrt();
    height * source.cone.cos() - flat_part * source.cone.sin() - source.radius > 0.0
}

/// What an item buffer says of a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    Hidden,
    Seen,
    /// The pixels about it do not agree.
    Doubtful,
}

/// A source with its item buffer, `[row][column]` of a hemicube of `n` pixels a side.
#[derive(Clone, Copy)]
pub struct Drawn<'a> {
    pub elements: &'a Elements,
    pub source: &'a Source,
    pub items: &'a [u32],
    pub n: u32,
}

impl Drawn<'_> {
    fn local(&self, p: DVec3) -> DVec3 {
        let Source {
            tangent,
            bitangent,
            normal,
            eye,
            ..
        } = self.source;
        let d = p - eye;
        DVec3::new(d.dot(*tangent), d.dot(*bitangent), d.dot(*normal))
    }

    fn item(&self, pixel: Pixel) -> u32 {
        self.items[(pixel.row * self.n + pixel.column) as usize]
    }

    /// What the four pixels about a place `p` on an element show.
    pub fn sight(&self, p: DVec3, element: usize) -> Verdict {
        // In front of what they all show, a place is open whatever the pixel.
        match self.says(p, element) {
            [first, others @ ..] if others.iter().all(|&other| other == first) => first,
            _ => Verdict::Doubtful,
        }
    }

    /// Share of the four pixels about a place `p` on an element that show it.
    pub fn share(&self, p: DVec3, element: usize) -> f64 {
        let says = self.says(p, element);
        let open = says.iter().filter(|&&says| says != Verdict::Hidden);
        open.count() as f64 / says.len() as f64
    }

    fn says(&self, p: DVec3, element: usize) -> [Verdict; 4] {
        pixels_about(self.local(p), self.n).map(|pixel| match self.item(pixel) {
            NONE => Verdict::Seen,
            item if item as usize == element => Verdict::Seen,
            item => self.leaves_open(item, pixel, p, element),
        })
    }

    /// Whether a place on an element is seen where a pixel shows an item.
    fn leaves_open(&self, item: u32, pixel: Pixel, p: DVec3, element: usize) -> Verdict {
        let Self {
            elements,
            source,
            n,
            ..
        } = *self;
        let d = p - source.eye;
        let plane = elements.normal[item as usize];
        let on_plane = elements.centroid[item as usize];
        let eye_height = (source.eye - on_plane).dot(plane);
        let height = (p - on_plane).dot(plane);
        let depth = if eye_height >= 0.0 { -height } else { height };
        if depth <= HEIGHT_EPSILON {
            return Verdict::Seen;
        }
        let ray = direction_of(pixel, n);
        let ray = source.tangent * ray.x + source.bitangent * ray.y + source.normal * ray.z;
        let seen = source.eye + ray * (-eye_height / plane.dot(ray));
        let apart = p.distance(seen);
        let normal = elements.normal[element];
        let grazing = normal.dot(d).abs().min(plane.dot(d).abs()) / d.length();
        let footprint = d.length() * 2.0 / f64::from(n) / grazing.max(0.05);
        if (seen - source.eye).dot(d) > d.length() * (d.length() + REACH * footprint) {
            return Verdict::Seen;
        }
        let sine = normal.cross(plane).length();
        let open = apart <= REACH * footprint && depth <= apart * sine + HEIGHT_EPSILON;
        match open {
            false => Verdict::Hidden,
            true if sine <= SMOOTH => Verdict::Seen,
            true => Verdict::Doubtful,
        }
    }
}

/// The four pixels of a face whose centres lie about a direction.
fn pixels_about(local: DVec3, n: u32) -> [Pixel; 4] {
    let (column, row) = texel_of(local, n);
    let own = pixel_of(local, n);
    let (first_row, rows) = match own.row < n {
        true => (0, n),
        false => (own.row / (n / 2) * (n / 2), n / 2),
    };
    let low = |at: f64, first: u32, count: u32| {
        ((at - 0.5).floor().max(0.0) as u32).clamp(first, first + count - 2)
    };
    let (column, row) = (low(column, 0, n), low(row, first_row, rows));
    [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| Pixel {
        column: column + x,
        row: row + y,
    })
}
