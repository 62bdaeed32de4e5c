//! Error against time, both axes logarithmic: points with their intervals, and the front of our
//! bakes.

use std::path::Path;

use plotters::coord::Shift;
use plotters::prelude::*;

use super::{Method, Row};
use crate::atomic_file::write_atomically;
use crate::bench::pixels::{Pixels, blank, write_png};
use crate::error::{Error, Result};

/// Width and height of the plot, pixels.
const SIZE: (u32, u32) = (1400, 960);

type Drawn = std::result::Result<(), Box<dyn std::error::Error>>;

/// Writes `pareto.svg` and `pareto.png` into `folder`. Without a measurement above 0 there is
/// nothing to draw.
pub(super) fn write(rows: &[Row], caption: &str, folder: &Path) -> Result<()> {
    let bad = |path: &Path, e: Box<dyn std::error::Error>| {
        Error::file(path, format!("cannot be drawn: {e}"))
    };
    if !rows.iter().any(|r| r.measure.centroids.rms > 0.0) {
        return Ok(());
    }
    let path = folder.join("pareto.svg");
    let mut svg = String::new();
    draw(
        SVGBackend::with_string(&mut svg, SIZE).into_drawing_area(),
        rows,
        caption,
    )
    .map_err(|e| bad(&path, e))?;
    write_atomically(&path, |out| out.write_all(svg.as_bytes()))?;
    let path = folder.join("pareto.png");
    let mut image = blank(SIZE);
    draw(Pixels(&mut image).into_drawing_area(), rows, caption).map_err(|e| bad(&path, e))?;
    write_png(&image, &path)
}

fn colour(method: Method) -> RGBColor {
    match method {
        Method::Receiver => RGBColor(8, 81, 156),
        Method::Pixel => RGBColor(230, 130, 20),
        Method::InstantRadiosity => RGBColor(35, 139, 69),
        Method::PathTracer => RGBColor(120, 120, 120),
        Method::Mitsuba => RGBColor(203, 24, 29),
        Method::Cycles => RGBColor(252, 174, 145),
        Method::CyclesOidn => RGBColor(241, 105, 19),
    }
}

/// Ends of an axis that contains the values; it begins at a power of ten, as its marks do.
fn ends(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let (low, high) = values
        .filter(|&v| v > 0.0)
        .fold((f64::INFINITY, 0.0_f64), |(low, high), v| {
            (low.min(v), high.max(v))
        });
    10_f64.powf((low / 1.1).log10().floor())..high * 1.3
}

fn draw<B: DrawingBackend>(root: DrawingArea<B, Shift>, rows: &[Row], caption: &str) -> Drawn
where
    B::ErrorType: 'static,
{
    let percent = |v: f64| 100.0 * v;
    let place = |r: &Row| (r.seconds, percent(r.measure.centroids.rms));
    let shown = || rows.iter().filter(|r| r.measure.centroids.rms > 0.0);
    let xs = ends(shown().map(|r| r.seconds));
    let ys = ends(shown().flat_map(|r| {
        [
            percent(r.measure.centroids.rms),
            percent(r.measure.centroids.rms_interval[1]),
        ]
    }));
    // An interval that reaches 0 ends at the lower edge.
    let lowest = ys.start;
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(caption, ("sans-serif", 22))
        .margin(16)
        .x_label_area_size(64)
        .y_label_area_size(90)
        .build_cartesian_2d(xs.log_scale(), ys.log_scale())?;
    chart
        .configure_mesh()
        .x_desc("seconds for every element")
        .y_desc("rms error of irradiance over its mean, %")
        .label_style(("sans-serif", 20))
        .light_line_style(RGBColor(235, 235, 235))
        .x_label_formatter(&|v| format!("{v}"))
        .y_label_formatter(&|v| format!("{v}"))
        .draw()?;
    for method in Method::ALL {
        let colour = colour(method);
        let of_method: Vec<&Row> = shown().filter(|r| r.method == method).collect();
        if of_method.is_empty() {
            continue;
        }
        // One curve for each setting over time; one for all numbers of paths.
        for curve in of_method.chunk_by(|a, b| a.same_curve(b)) {
            let points: Vec<_> = curve.iter().map(|r| place(r)).collect();
            chart.draw_series([PathElement::new(points, colour.mix(0.35))])?;
        }
        chart.draw_series(of_method.iter().map(|r| {
            let [low, high] = r
                .measure
                .centroids
                .rms_interval
                .map(|v| percent(v).max(lowest));
            PathElement::new([(r.seconds, low), (r.seconds, high)], colour.mix(0.5))
        }))?;
        chart
            .draw_series(of_method.iter().map(|r| {
                let size = if r.finished { 4 } else { 2 };
                Circle::new(
                    (r.seconds, percent(r.measure.centroids.rms)),
                    size,
                    colour.filled(),
                )
            }))?
            .label(method.title())
            .legend(move |(x, y)| Circle::new((x + 8, y), 5, colour.filled()));
    }
    let mut best: Vec<&Row> = shown().filter(|r| r.best).collect();
    best.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    let steps: Vec<_> = best.iter().map(|r| place(r)).collect();
    chart
        .draw_series([PathElement::new(steps, BLACK.stroke_width(2))])?
        .label("best of our settings")
        .legend(|(x, y)| PathElement::new([(x, y), (x + 16, y)], BLACK.stroke_width(2)));
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerLeft)
        .label_font(("sans-serif", 20))
        .draw()?;
    root.present()?;
    Ok(())
}
