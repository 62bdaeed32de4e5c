//! What an IES file holds, and its web.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::super::Web;
use super::curve::Curve;

/// The system of angles. Of C the vertical one is θ, from the nadir, and the horizontal one φ. The
/// axis of B and A is at (0, 0); V is up, H to the right. B turns by V about the axis to the right
/// and A by H about the axis that points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    C,
    B,
    A,
}

pub(super) struct Photometry {
    pub kind: Kind,
    /// Degrees.
    pub verticals: Vec<f64>,
    pub horizontals: Vec<f64>,
    /// `[horizontal][vertical]`
    pub candelas: Vec<f64>,
    /// Whether the light depends on the lamp's tilt.
    pub tilts: bool,
    /// Whether it is a web of Mesolux' own, whose values are shares at even angles.
    pub is_web: bool,
}

/// Degrees between the rows of a web, a quarter of the least step of the file, and between its
/// columns, half of that; within these.
const ROW_STEPS: std::ops::RangeInclusive<f64> = 0.1..=1.0;
const COLUMN_STEPS: std::ops::RangeInclusive<f64> = 0.5..=2.0;

/// Angles of the file that are these but for rounding.
const NEAR: f64 = 1e-6;

impl Photometry {
    /// What makes it unusable, one clause.
    pub fn problem(&self) -> Option<String> {
        if self.verticals.len() < 2 {
            return Some("there must be two vertical angles or more".into());
        }
        let within = |angles: &[f64], low: f64, high: f64| {
            let (first, last) = (angles.first(), angles.last());
            first.is_some_and(|&a| a >= low - NEAR) && last.is_some_and(|&a| a <= high + NEAR)
        };
        if self.kind != Kind::C {
            let are_within = within(&self.verticals, -90.0, 90.0)
                && within(&self.horizontals, -90.0, 90.0)
                && self.horizontals.len() > 1;
            return (!are_within).then(|| {
                "angles of types A and B must lie in −90..=90, with two horizontal ones or more"
                    .into()
            });
        }
        if !within(&self.verticals, 0.0, 180.0) {
            return Some("vertical angles of type C must lie in 0..=180".into());
        }
        if self.all_around().is_none() {
            return Some(
                "horizontal angles of type C must be one, or run from 0 to 90, 180 or 360, or from \
                 90 to 270"
                    .into(),
            );
        }
        None
    }

    /// The horizontal angles of a whole circle, ascending, with the places of their values; the
    /// last is the first plus 360. One without a dependence on φ. None where they make no circle.
    fn all_around(&self) -> Option<Vec<(f64, usize)>> {
        let angles = || self.horizontals.iter().copied().zip(0..);
        let (first, last) = (*self.horizontals.first()?, *self.horizontals.last()?);
        let is = |angle: f64, wanted: f64| (angle - wanted).abs() < NEAR;
        if self.horizontals.len() == 1 {
            return Some(vec![(0.0, 0)]);
        }
        let mut all: Vec<(f64, usize)> = if is(first, 90.0) && is(last, 270.0) {
            // The other half mirrors this one: φ is like 180 − φ.
            angles()
                .map(|(a, i)| (180.0 - a, i))
                .chain(angles())
                .collect()
        } else if !is(first, 0.0) {
            return None;
        } else if is(last, 90.0) {
            let half = angles().chain(angles().map(|(a, i)| (180.0 - a, i)));
            let half: Vec<_> = half.collect();
            let other = half.iter().map(|&(a, i)| (360.0 - a, i));
            half.iter().copied().chain(other).collect()
        } else if is(last, 180.0) {
            angles()
                .chain(angles().map(|(a, i)| (360.0 - a, i)))
                .collect()
        } else if is(last, 360.0) {
            angles().collect()
        } else {
            // Some leave out 360, which is 0 again.
            let step = last - self.horizontals[self.horizontals.len() - 2];
            if !is(last + step, 360.0) {
                return None;
            }
            angles().chain([(360.0, 0)]).collect()
        };
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all.dedup_by(|a, b| is(a.0, b.0));
        Some(all)
    }

    /// Rows and columns of a web.
    fn size(&self) -> (u32, u32) {
        let least =
            |angles: &[f64]| (angles.windows(2).map(|w| w[1] - w[0])).fold(f64::INFINITY, f64::min);
        let (mut down, mut around) = (least(&self.verticals), least(&self.horizontals));
        if self.kind != Kind::C {
            // Each crosses both.
            down = down.min(around);
            around = down;
        }
        let row = (down / 4.0).clamp(*ROW_STEPS.start(), *ROW_STEPS.end());
        let column = (around / 2.0).clamp(*COLUMN_STEPS.start(), *COLUMN_STEPS.end());
        (
            (180.0 / row).ceil() as u32 + 1,
            (360.0 / column).ceil() as u32 + 1,
        )
    }

    /// The values of one horizontal angle as a curve over the vertical ones.
    fn column(&self, horizontal: usize) -> Curve {
        let count = self.verticals.len();
        let values = self.candelas[horizontal * count..][..count].to_vec();
        Curve::new(self.verticals.clone(), values)
    }

    /// Rows, columns and candelas of a web.
    pub fn web(&self) -> (u32, u32, Vec<f64>) {
        let (rows, columns) = self.size();
        match (self.kind, self.all_around()) {
            (Kind::C, Some(angles)) => self.web_of_c(&angles, rows, columns),
            _ => {
                let grid = Even::new(self, 180.0 / f64::from(rows - 1));
                let candela = |row: u32, column: u32| {
                    let theta = PI * f64::from(row) / f64::from(rows - 1);
                    let phi = TAU * f64::from(column) / f64::from(columns - 1);
                    // Right, up and along the axis.
                    let (x, y) = (theta.sin() * phi.cos(), -theta.sin() * phi.sin());
                    let z = theta.cos();
                    let (v, h) = match self.kind {
                        Kind::A => (y.clamp(-1.0, 1.0).asin(), f64::atan2(x, z)),
                        _ => (f64::atan2(y, z), x.clamp(-1.0, 1.0).asin()),
                    };
                    // Beyond a right angle lies nothing.
                    match z < -1e-12 || v.abs().max(h.abs()) > FRAC_PI_2 + 1e-9 {
                        true => 0.0,
                        false => grid.at(v.to_degrees(), h.to_degrees()),
                    }
                };
                let of_row = |row: u32| (0..columns).map(move |column| (row, column));
                let all = (0..rows).flat_map(of_row);
                (rows, columns, all.map(|(r, c)| candela(r, c)).collect())
            }
        }
    }

    fn web_of_c(&self, angles: &[(f64, usize)], rows: u32, columns: u32) -> (u32, u32, Vec<f64>) {
        let curves: Vec<Curve> = angles.iter().map(|&(_, i)| self.column(i)).collect();
        let theta = |row: u32| 180.0 * f64::from(row) / f64::from(rows - 1);
        let of_row = |row: u32| -> Vec<f64> {
            let at = theta(row);
            curves
                .iter()
                .map(|curve| curve.at(at).unwrap_or(0.0))
                .collect()
        };
        if let [curve] = curves.as_slice() {
            let values = (0..rows).map(|row| curve.at(theta(row)).unwrap_or(0.0));
            return (rows, 1, values.collect());
        }
        // The circle closes: two angles more on either side, the last of the own is the first
        // again.
        let own = angles.len() as isize - 1;
        let wrapped = |i: isize| {
            let (turns, index) = (i.div_euclid(own), i.rem_euclid(own) as usize);
            (360.0 * turns as f64 + angles[index].0, index)
        };
        let places: Vec<(f64, usize)> = (-2..=own + 2).map(wrapped).collect();
        let mut web = Vec::with_capacity(rows as usize * columns as usize);
        for row in 0..rows {
            let values = of_row(row);
            let (places, values) = places.iter().map(|&(a, i)| (a, values[i])).unzip();
            let curve = Curve::new(places, values);
            let phi = |column: u32| {
                let turn = f64::from(column % (columns - 1)) / f64::from(columns - 1);
                angles[0].0 + (360.0 * turn - angles[0].0).rem_euclid(360.0)
            };
            web.extend((0..columns).map(|column| curve.at(phi(column)).unwrap_or(0.0)));
        }
        (rows, columns, web)
    }

    /// The values as they are, where the angles are even.
    pub fn even_web(&self) -> Option<Web> {
        let (rows, columns) = (self.verticals.len(), self.horizontals.len());
        let are_even = |angles: &[f64], whole: f64| {
            let step = whole / (angles.len() as f64 - 1.0);
            let mut each = angles.iter().zip(0..);
            each.all(|(a, i)| (a - step * f64::from(i)).abs() < NEAR)
        };
        let is_even = self.kind == Kind::C
            && are_even(&self.verticals, 180.0)
            && (columns == 1 || are_even(&self.horizontals, 360.0));
        let share = |row: usize, column: usize| self.candelas[column * rows + row] as f32;
        let of_row = |row: usize| (0..columns).map(move |column| share(row, column));
        is_even.then(|| Web {
            rows: rows as u32,
            columns: columns as u32,
            shares: (0..rows).flat_map(of_row).collect(),
        })
    }
}

/// The values of types A and B on an even grid, bilinear.
struct Even {
    /// First and last place and the number of places, degrees: horizontal, vertical.
    spans: [Span; 2],
    /// `[horizontal][vertical]`
    values: Vec<f64>,
}

#[derive(Clone, Copy)]
struct Span {
    first: f64,
    last: f64,
    count: usize,
}

impl Span {
    fn new(first: f64, last: f64, step: f64) -> Self {
        let count = ((last - first) / step).ceil().max(1.0) as usize + 1;
        Self { first, last, count }
    }

    fn place(self, i: usize) -> f64 {
        self.first + (self.last - self.first) * i as f64 / (self.count - 1) as f64
    }

    /// The place before an angle, and how far it is to the next; None outside.
    fn find(self, angle: f64) -> Option<(usize, f64)> {
        let at = (angle - self.first) / (self.last - self.first);
        if !(-1e-9..=1.0 + 1e-9).contains(&at) {
            return None;
        }
        let at = at.clamp(0.0, 1.0) * (self.count - 1) as f64;
        let before = (at as usize).min(self.count - 2);
        Some((before, at - before as f64))
    }
}

impl Even {
    fn new(file: &Photometry, step: f64) -> Self {
        let mut columns: Vec<(f64, usize)> = file.horizontals.iter().copied().zip(0..).collect();
        if file.horizontals[0].abs() < NEAR {
            // The left is the right again.
            let mirrored: Vec<_> = columns[1..].iter().map(|&(h, i)| (-h, i)).collect();
            columns.splice(0..0, mirrored.into_iter().rev());
        }
        let across = Span::new(columns[0].0, columns[columns.len() - 1].0, step);
        let up = Span::new(
            file.verticals[0],
            file.verticals[file.verticals.len() - 1],
            step,
        );
        let curves: Vec<Curve> = columns.iter().map(|&(_, i)| file.column(i)).collect();
        let places: Vec<f64> = columns.iter().map(|&(h, _)| h).collect();
        let mut values = vec![0.0; across.count * up.count];
        for v in 0..up.count {
            let at = up.place(v);
            let of_columns = curves
                .iter()
                .map(|curve| curve.at(at).unwrap_or(0.0))
                .collect();
            let curve = Curve::new(places.clone(), of_columns);
            for h in 0..across.count {
                values[h * up.count + v] = curve.at(across.place(h)).unwrap_or(0.0);
            }
        }
        Self {
            spans: [across, up],
            values,
        }
    }

    fn at(&self, v: f64, h: f64) -> f64 {
        let [across, up] = self.spans;
        let (Some((h, right)), Some((v, above))) = (across.find(h), up.find(v)) else {
            return 0.0;
        };
        let value = |h: usize, v: usize| self.values[h * up.count + v];
        let of_column = |h: usize| value(h, v) + above * (value(h, v + 1) - value(h, v));
        of_column(h) + right * (of_column(h + 1) - of_column(h))
    }
}
