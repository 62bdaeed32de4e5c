//! The text of an IES file.

use std::path::Path;

use super::Photometry;
use super::fields::Kind;
use super::writing::IS_WEB;
use crate::error::{Error, Result};

/// Reads the text; intensities come in candelas, with all factors.
pub(super) fn parse(path: &Path, text: &str) -> Result<Photometry> {
    let lines: Vec<&str> = text.trim_end_matches(['\u{1a}', '\0']).lines().collect();
    let is_tilt = |line: &&str| line.trim_start().to_ascii_uppercase().starts_with("TILT");
    let Some(tilt_line) = lines.iter().position(is_tilt) else {
        let what = "there is no line TILT=: this is no IES file";
        return Err(Error::file(path, what));
    };
    let version = lines[0]
        .trim()
        .trim_start_matches('\u{feff}')
        .to_ascii_uppercase();
    let is_web = lines[..tilt_line].iter().any(|line| line.trim() == IS_WEB);
    let tilt = lines[tilt_line]
        .split_once('=')
        .map(|(_, tilt)| tilt.trim());
    let has_tilt = match tilt.map(str::to_ascii_uppercase).as_deref() {
        Some("NONE") => false,
        Some("INCLUDE") => true,
        Some(name) if !name.is_empty() => {
            let name = tilt.unwrap_or_default().escape_debug();
            let what = format!("the lamp's tilt stands in another file, {name}, which is not read");
            return Err(Error::line(path, tilt_line + 1, what));
        }
        _ => {
            let what = "TILT= must be NONE or INCLUDE";
            return Err(Error::line(path, tilt_line + 1, what));
        }
    };

    let mut numbers = Numbers::new(path, &lines, tilt_line + 1);
    let tilts = has_tilt && tilt_factors(&mut numbers)?;
    let lamps = numbers.next("the number of lamps")?;
    let lumens = numbers.next("the lumens of a lamp")?;
    let multiplier = numbers.above_0("the multiplier of candelas")?;
    let vertical = numbers.count("the number of vertical angles")?;
    let horizontal = numbers.count("the number of horizontal angles")?;
    let kind = match numbers.next("the type of photometry")? {
        1.0 => Kind::C,
        2.0 => Kind::B,
        3.0 => Kind::A,
        _ => return Err(numbers.refuse("the type of photometry must be 1, 2 or 3")),
    };
    let units = numbers.next("the unit of lengths")?;
    if lamps < 1.0 || !(lumens >= 0.0 || lumens == -1.0) || !(units == 1.0 || units == 2.0) {
        let what = "lamps must be 1 or more, their lumens −1 or 0 or more, the unit 1 or 2";
        return Err(numbers.refuse(what));
    }
    for what in ["the width", "the length", "the height"] {
        numbers.next(what)?;
    }
    let ballast = numbers.above_0("the factor of the ballast")?;
    let second = numbers.next("the factor behind that of the ballast")?;
    numbers.next("the watts")?;
    // Until 1991 it multiplies. In 1995 and 2002 it is kept for the future, and then says how the
    // file was made.
    let is_old = !version.starts_with("IES") || version.contains("91") || version.contains("86");
    let factor = multiplier * ballast * if is_old { second } else { 1.0 };
    if !(factor.is_finite() && factor > 0.0) {
        return Err(numbers.refuse("the factors of the candelas must be above 0"));
    }

    let wanted =
        (vertical.checked_mul(horizontal)).and_then(|n| n.checked_add(vertical + horizontal));
    if wanted.is_none_or(|wanted| wanted > numbers.left()) {
        return Err(numbers.refuse(&format!(
            "{vertical} vertical and {horizontal} horizontal angles need more numbers than follow"
        )));
    }
    let verticals = numbers.ascending(vertical, "vertical")?;
    let horizontals = numbers.ascending(horizontal, "horizontal")?;
    let mut candelas = Vec::with_capacity(vertical * horizontal);
    for _ in 0..vertical * horizontal {
        let candela = factor * numbers.next("an intensity")?;
        if !(candela.is_finite() && candela >= 0.0) {
            return Err(numbers.refuse("an intensity must be finite and not negative"));
        }
        candelas.push(candela);
    }
    if numbers.left() > 0 {
        return Err(numbers.refuse("more follows than the counts of angles say"));
    }
    let file = Photometry {
        kind,
        verticals,
        horizontals,
        candelas,
        tilts,
        is_web,
    };
    match file.problem() {
        Some(what) => Err(Error::file(path, what)),
        None => Ok(file),
    }
}

/// Whether the light depends on the lamp's tilt.
fn tilt_factors(numbers: &mut Numbers) -> Result<bool> {
    numbers.next("the place of the lamp in the luminaire")?;
    let count = numbers.count("the number of tilts")?;
    if count > numbers.left() / 2 {
        return Err(numbers.refuse("more tilts are announced than follow"));
    }
    numbers.ascending(count, "tilt")?;
    let mut tilts = false;
    for _ in 0..count {
        tilts |= numbers.next("a factor of a tilt")? != 1.0;
    }
    Ok(tilts)
}

/// The numbers of a file in their order, with their lines.
struct Numbers<'a> {
    path: &'a Path,
    words: Vec<(usize, &'a str)>,
    at: usize,
}

impl<'a> Numbers<'a> {
    fn new(path: &'a Path, lines: &[&'a str], first: usize) -> Self {
        let of_line = |(line, text): (usize, &'a str)| {
            let words = text.split(|c: char| c.is_whitespace() || c == ',');
            let words = words.filter(|word| !word.is_empty());
            words.map(move |word| (line + 1, word))
        };
        let lines = lines.iter().copied().enumerate().skip(first);
        Self {
            path,
            words: lines.flat_map(of_line).collect(),
            at: 0,
        }
    }

    fn left(&self) -> usize {
        self.words.len() - self.at
    }

    /// An error at the last number that was read.
    fn refuse(&self, what: &str) -> Error {
        let last = self.words.get(self.at.saturating_sub(1));
        match last {
            Some((line, _)) => Error::line(self.path, *line, what),
            None => Error::file(self.path, what),
        }
    }

    fn next(&mut self, what: &str) -> Result<f64> {
        let Some(&(line, word)) = self.words.get(self.at) else {
            return Err(self.refuse(&format!("the file ends before {what}")));
        };
        self.at += 1;
        let number = word.parse().ok().filter(|n: &f64| n.is_finite());
        number.ok_or_else(|| {
            let word: String = word.chars().take(20).collect();
            let what = format!("{what}: \"{}\" is no number", word.escape_debug());
            Error::line(self.path, line, what)
        })
    }

    fn above_0(&mut self, what: &str) -> Result<f64> {
        let number = self.next(what)?;
        match number > 0.0 {
            true => Ok(number),
            false => Err(self.refuse(&format!("{what} must be above 0"))),
        }
    }

    fn count(&mut self, what: &str) -> Result<usize> {
        let number = self.next(what)?;
        match number.fract() == 0.0 && (1.0..1e6).contains(&number) {
            true => Ok(number as usize),
            false => Err(self.refuse(&format!("{what} must be a whole number above 0"))),
        }
    }

    fn ascending(&mut self, count: usize, kind: &str) -> Result<Vec<f64>> {
        let mut angles: Vec<f64> = Vec::with_capacity(count);
        for _ in 0..count {
            let angle = self.next(&format!("a {kind} angle"))?;
            if angles.last().is_some_and(|&last| last >= angle) {
                return Err(self.refuse(&format!("the {kind} angles must ascend")));
            }
            angles.push(angle);
        }
        Ok(angles)
    }
}
