//! Grouped bars as an SVG picture.

use std::path::Path;

use plotters::prelude::*;

use super::lines::{Canvas, Drawn, svg, write_svg};
use crate::error::Result;

/// One bar: its group, its kind, its height, and the ends of its spread.
pub struct Bar {
    pub group: usize,
    pub kind: usize,
    pub value: f64,
    pub spread: Option<(f64, f64)>,
}

/// Share of the highest bar from which on a bar's value stands above it.
const LABELLED: f64 = 0.01;

/// A chart of bars, one group beside the other, one colour for each kind.
pub struct Bars<'a> {
    pub caption: &'a str,
    /// Of the values.
    pub unit: &'a str,
    pub groups: Vec<String>,
    pub kinds: Vec<(String, RGBColor)>,
    pub bars: Vec<Bar>,
}

impl Bars<'_> {
    pub fn write(&self, path: &Path) -> Result<()> {
        write_svg(path, self.size(), |root| self.draw(root))
    }

    /// The chart as SVG.
    ///
    /// # Errors
    /// A chart that cannot be drawn.
    pub fn svg(&self) -> std::result::Result<String, Box<dyn std::error::Error>> {
        svg(self.size(), |root| self.draw(root))
    }

    fn size(&self) -> (u32, u32) {
        (320 + 260 * self.groups.len().max(2) as u32, 480)
    }

    fn draw(&self, root: &Canvas<'_>) -> Drawn {
        let highest = self
            .bars
            .iter()
            .map(|b| b.spread.map_or(b.value, |s| s.1))
            .fold(1.0, f64::max);
        let count = self.groups.len();
        // The legend stands above the bars, a twelfth of their height a line.
        let room = 1.0 + 0.08 * self.kinds.len().max(5) as f64;
        let mut chart = ChartBuilder::on(root)
            .caption(self.caption, ("sans-serif", 22))
            .margin(12)
            .x_label_area_size(34)
            .y_label_area_size(60)
            .build_cartesian_2d(0.0..count as f64, 0.0..room * highest)?;
        let name = |x: &f64| {
            let middle = (x.fract() - 0.5).abs() < 1e-6;
            let group = self.groups.get(*x as usize).filter(|_| middle);
            group.cloned().unwrap_or_default()
        };
        chart
            .configure_mesh()
            .disable_x_mesh()
            .light_line_style(WHITE)
            .x_labels(2 * count + 1)
            .x_label_formatter(&name)
            .y_desc(self.unit)
            .draw()?;
        let step = 0.8 / self.kinds.len() as f64;
        for (kind, (label, colour)) in self.kinds.iter().enumerate() {
            let colour = *colour;
            let bars = || self.bars.iter().filter(|b| b.kind == kind);
            let left = |b: &Bar| b.group as f64 + 0.1 + step * kind as f64;
            chart
                .draw_series(bars().map(|b| {
                    let x = left(b);
                    Rectangle::new([(x, 0.0), (x + 0.9 * step, b.value)], colour.filled())
                }))?
                .label(label)
                .legend(move |(x, y)| {
                    Rectangle::new([(x, y - 5), (x + 12, y + 5)], colour.filled())
                });
            chart.draw_series(bars().filter_map(|b| {
                let (low, high) = b.spread?;
                let x = left(b) + 0.45 * step;
                Some(PathElement::new([(x, low), (x, high)], BLACK))
            }))?;
            let large = |b: &&Bar| b.value >= LABELLED * highest;
            chart.draw_series(bars().filter(large).map(|b| {
                let top = b.spread.map_or(b.value, |s| s.1.max(b.value));
                let place = (left(b), top + 0.035 * highest);
                let digits = usize::from(b.value < 10.0);
                Text::new(format!("{:.digits$}", b.value), place, ("sans-serif", 13))
            }))?;
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK.mix(0.3))
            .draw()?;
        Ok(())
    }
}
