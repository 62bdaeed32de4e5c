//! Lines over doubling sizes as an SVG picture; both axes are logarithmic.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};

/// One line: what the legend says, its colour, and its points (x, y), all above 0.
pub struct Line {
    pub label: String,
    pub colour: RGBColor,
    pub points: Vec<(f64, f64)>,
}

/// A chart of lines that share their axes.
pub struct Lines<'a> {
    pub caption: &'a str,
    pub x: &'a str,
    pub y: &'a str,
    pub lines: Vec<Line>,
}

impl Lines<'_> {
    /// Writes the chart as SVG.
    ///
    /// # Errors
    /// A file that cannot be written; a chart that cannot be drawn.
    pub fn write(&self, path: &Path) -> Result<()> {
        write_svg(path, (820, 540), |root| self.draw(root))
    }

    /// The chart as SVG.
    ///
    /// # Errors
    /// A chart that cannot be drawn.
    pub fn svg(&self) -> std::result::Result<String, Box<dyn std::error::Error>> {
        svg((820, 540), |root| self.draw(root))
    }

    fn draw(&self, root: &Canvas<'_>) -> Drawn {
        let points = || self.lines.iter().flat_map(|l| l.points.iter().copied());
        let ends = |values: &mut dyn Iterator<Item = f64>| {
            let (low, high) = values.fold((f64::INFINITY, 0.0), |(l, h), v| (v.min(l), v.max(h)));
            // Without a point any axis will do.
            match low <= high {
                true => 0.7 * low..1.4 * high,
                false => 1.0..10.0,
            }
        };
        let x = ends(&mut points().map(|p| p.0));
        let y = ends(&mut points().map(|p| p.1));
        let mut chart = ChartBuilder::on(root)
            .caption(self.caption, ("sans-serif", 22))
            .margin(14)
            .x_label_area_size(44)
            .y_label_area_size(64)
            .build_cartesian_2d(x.log_scale(), y.log_scale())?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .x_desc(self.x)
            .y_desc(self.y)
            .x_label_formatter(&number)
            .y_label_formatter(&number)
            .draw()?;
        for line in &self.lines {
            let colour = line.colour;
            chart
                .draw_series(std::iter::once(PathElement::new(
                    line.points.clone(),
                    colour.stroke_width(2),
                )))?
                .label(&line.label)
                .legend(move |(x, y)| {
                    PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2))
                });
            chart.draw_series(
                line.points
                    .iter()
                    .map(|&p| Circle::new(p, 3, colour.filled())),
            )?;
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.3))
            .draw()?;
        Ok(())
    }
}

/// What a chart is drawn on.
pub(super) type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;

pub(super) type Drawn = std::result::Result<(), Box<dyn std::error::Error>>;

/// Writes what is drawn on a white ground of so many pixels as SVG.
///
/// # Errors
/// A file that cannot be written; a chart that cannot be drawn.
pub(super) fn write_svg(
    path: &Path,
    size: (u32, u32),
    draw: impl FnOnce(&Canvas<'_>) -> Drawn,
) -> Result<()> {
    let svg = svg(size, draw).map_err(|e| Error::file(path, format!("cannot be drawn: {e}")))?;
    write_atomically(path, |out| out.write_all(svg.as_bytes()))
}

/// The same as text.
///
/// # Errors
/// A chart that cannot be drawn.
pub(super) fn svg(
    size: (u32, u32),
    draw: impl FnOnce(&Canvas<'_>) -> Drawn,
) -> std::result::Result<String, Box<dyn std::error::Error>> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        draw(&root)?;
        root.present()?;
    }
    Ok(svg)
}

/// A label: thousands as k, millions as M.
fn number(value: &f64) -> String {
    match *value {
        v if v >= 1e6 => format!("{}M", round(v / 1e6)),
        v if v >= 1e3 => format!("{}k", round(v / 1e3)),
        v => round(v),
    }
}

/// Three digits at most, without zeros at the end.
fn round(value: f64) -> String {
    let text = format!("{value:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
