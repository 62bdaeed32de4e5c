//! Points in text: a line of numbers each.

use std::path::Path;

use crate::error::{Error, Result};
use crate::input_file::read_text;

/// A line that is not empty and does not begin with `#`.
pub(super) struct Row<'a> {
    path: &'a Path,
    number: usize,
    line: &'a str,
    pub numbers: &'a [f64],
}

impl Row<'_> {
    /// Why it is refused: its text and `what`.
    pub fn wrong(&self, what: &str) -> Error {
        Error::line(self.path, self.number, format!("\"{}\" {what}", self.line))
    }
}

/// Reads what `point` makes of each line; `columns` says in messages what a line is.
///
/// # Errors
/// A file that cannot be read or has no point; a line of what is not all finite numbers; those of
/// `point`.
pub(super) fn read_rows<T>(
    path: &Path,
    columns: &str,
    point: impl Fn(Row<'_>) -> Result<T>,
) -> Result<Vec<T>> {
    let text = read_text(path)?;
    let mut points = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let words = line.split(|c: char| c.is_whitespace() || c == ',');
        let numbers: Option<Vec<f64>> = (words.filter(|word| !word.is_empty()))
            .map(|word| word.parse().ok().filter(|n: &f64| n.is_finite()))
            .collect();
        let row = |numbers| Row {
            path,
            number,
            line,
            numbers,
        };
        let numbers = numbers.ok_or_else(|| row(&[]).wrong("is not all finite numbers"))?;
        points.push(point(row(&numbers))?);
    }
    match points.is_empty() {
        false => Ok(points),
        true => Err(Error::file(
            path,
            format!("has no point: a line is {columns}"),
        )),
    }
}
