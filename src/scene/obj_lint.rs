//! Checks the text of an OBJ file line by line before tobj reads it.
//!
//! tobj silently accepts `nan`, `inf` and faces of one or two corners, reads a polyline as a face,
//! invents texture coordinates in a mesh where only some faces have them, and reports no lines.

use std::collections::HashSet;
use std::fmt::Write as _;
use std::path::Path;

use super::meshes::Part;
use crate::error::{Error, Result};

/// The text for tobj, and what tobj would not report.
#[derive(Debug, Default)]
pub(super) struct Checked {
    /// `v`, `vt`, `f` with absolute indices, and `usemtl`; nothing else.
    pub text: String,
    /// What follows each `mtllib`, with its line.
    pub libraries: Vec<(usize, String)>,
    /// The materials that `usemtl` names, each once, with the first line that does.
    pub used: Vec<(usize, String)>,
    used_names: HashSet<String>,
    /// For each triangle of the fans, in order, whether its face has texture coordinates.
    pub has_uv: Vec<bool>,
    /// Objects, and groups, by their first triangle.
    pub objects: Vec<Part>,
    pub groups: Vec<Part>,
    /// Number of lines that are ignored, and the first of them.
    pub unknown: usize,
    pub first_unknown: Option<(usize, String)>,
    counts: Counts,
}

#[derive(Debug, Default)]
struct Counts {
    vertices: usize,
    uvs: usize,
    normals: usize,
}

/// Statements of the format that say nothing about diffuse triangles.
const PASSED_OVER: [&str; 32] = [
    "s",
    "l",
    "p",
    "vp",
    "mg",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
    "cstype",
    "deg",
    "bmat",
    "step",
    "curv",
    "curv2",
    "surf",
    "parm",
    "trim",
    "hole",
    "scrv",
    "sp",
    "end",
    "con",
    "maplib",
    "usemap",
    "call",
    "csh",
    "vc",
];

/// Checks `text`, the content of `path`.
///
/// # Errors
/// The first line that is wrong, with its number.
pub(super) fn check(path: &Path, text: &str) -> Result<Checked> {
    let mut checked = Checked::default();
    for (line, statement) in statements(text) {
        checked
            .statement(line, &statement)
            .map_err(|what| Error::line(path, line, what))?;
    }
    Ok(checked)
}

/// Statements with the line they begin on, counted from 1; a backslash at the end of a line
/// continues it.
pub(super) fn statements(text: &str) -> impl Iterator<Item = (usize, String)> {
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        let (index, first) = lines.next()?;
        let mut statement = first.to_owned();
        while statement.ends_with('\\') {
            statement.pop();
            statement.push(' ');
            match lines.next() {
                Some((_, more)) => statement.push_str(more),
                None => break,
            }
        }
        Some((index + 1, statement))
    })
}

/// A number as OBJ and MTL files write it; finite also as f32 where it is stored as such.
pub(super) fn finite(word: &str) -> Result<f64, String> {
    match word.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        Ok(_) => Err(format!("\"{}\" is not a finite number", brief(word))),
        Err(_) => Err(format!("\"{}\" is not a number", brief(word))),
    }
}

/// A piece of a file, made fit for a one-line message.
pub(super) fn brief(text: &str) -> String {
    const MOST: usize = 40;
    let mut brief: String = text
        .chars()
        .take(MOST)
        .flat_map(char::escape_debug)
        .collect();
    if text.chars().nth(MOST).is_some() {
        brief.push('…');
    }
    brief
}

impl Checked {
    fn statement(&mut self, line: usize, statement: &str) -> Result<(), String> {
        let statement = statement.trim();
        let (keyword, rest) = statement
            .split_once(char::is_whitespace)
            .unwrap_or((statement, ""));
        match keyword {
            "v" => self.vertex(&words(rest)),
            "vt" => self.texture_vertex(&words(rest)),
            "vn" => {
                self.counts.normals += 1;
                Ok(())
            }
            "f" | "fo" => self.face(&words(rest)),
            "usemtl" => self.use_material(line, rest.trim()),
            "o" | "g" => {
                let part = Part {
                    name: rest.trim().to_owned(),
                    first: self.has_uv.len(),
                };
                match keyword {
                    "o" => self.objects.push(part),
                    _ => self.groups.push(part),
                }
                Ok(())
            }
            "mtllib" => self.library(line, rest.trim()),
            _ => {
                let known = keyword.is_empty()
                    || keyword.starts_with('#')
                    || PASSED_OVER.contains(&keyword);
                if !known {
                    self.unknown += 1;
                    self.first_unknown
                        .get_or_insert_with(|| (line, brief(keyword)));
                }
                Ok(())
            }
        }
    }

    fn vertex(&mut self, words: &[&str]) -> Result<(), String> {
        // x y z, x y z w, x y z r g b, x y z r g b a.
        if !matches!(words.len(), 3 | 4 | 6 | 7) {
            return Err(format!(
                "a vertex needs 3 coordinates, found {}",
                words.len()
            ));
        }
        let numbers: Vec<f64> = words.iter().map(|w| finite(w)).collect::<Result<_, _>>()?;
        let kept = if numbers.len() == 4 { 4 } else { 3 };
        if kept == 4 && numbers[3] == 0.0 {
            return Err("the weight of a vertex must not be 0".into());
        }
        self.counts.vertices += 1;
        self.push("v", &words[..kept]);
        Ok(())
    }

    fn texture_vertex(&mut self, words: &[&str]) -> Result<(), String> {
        if !matches!(words.len(), 2 | 3) {
            return Err(format!(
                "a texture vertex needs 2 coordinates, found {}",
                words.len()
            ));
        }
        for word in words {
            if !(finite(word)? as f32).is_finite() {
                return Err(format!(
                    "texture coordinate \"{}\" is too large",
                    brief(word)
                ));
            }
        }
        self.counts.uvs += 1;
        self.push("vt", &words[..2]);
        Ok(())
    }

    fn face(&mut self, words: &[&str]) -> Result<(), String> {
        if words.len() < 3 {
            return Err(format!(
                "a face needs at least 3 corners, found {}",
                words.len()
            ));
        }
        let corners: Vec<(usize, Option<usize>)> = words
            .iter()
            .map(|w| self.corner(w))
            .collect::<Result<_, _>>()?;
        let with_uv = corners.iter().filter(|(_, uv)| uv.is_some()).count();
        if with_uv != 0 && with_uv != corners.len() {
            return Err(format!(
                "{with_uv} of {} corners have texture coordinates: all or none must",
                corners.len()
            ));
        }
        self.text.push('f');
        for (vertex, uv) in &corners {
            // Writing to a String cannot fail.
            let _ = match uv {
                Some(uv) => write!(self.text, " {vertex}/{uv}"),
                None => write!(self.text, " {vertex}"),
            };
        }
        self.text.push('\n');
        self.has_uv
            .extend(std::iter::repeat_n(with_uv > 0, corners.len() - 2));
        Ok(())
    }

    /// Absolute indices, from 1, of a corner: `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&self, word: &str) -> Result<(usize, Option<usize>), String> {
        let mut parts = word.split('/');
        let vertex = index(parts.next().unwrap_or(""), self.counts.vertices, "vertex")?;
        let uv = match parts.next() {
            None | Some("") => None,
            Some(part) => Some(index(part, self.counts.uvs, "texture vertex")?),
        };
        match parts.next() {
            None | Some("") => {}
            Some(part) => {
                index(part, self.counts.normals, "normal")?;
            }
        }
        match parts.next() {
            None => Ok((vertex, uv)),
            Some(_) => Err(format!(
                "corner \"{}\" has more than 3 indices",
                brief(word)
            )),
        }
    }

    fn use_material(&mut self, line: usize, name: &str) -> Result<(), String> {
        if name.is_empty() {
            return Err("usemtl names no material".into());
        }
        if self.used_names.insert(name.to_owned()) {
            self.used.push((line, name.to_owned()));
        }
        self.push("usemtl", &[name]);
        Ok(())
    }

    fn library(&mut self, line: usize, name: &str) -> Result<(), String> {
        if name.is_empty() {
            return Err("mtllib names no file".into());
        }
        if !self.libraries.iter().any(|(_, known)| known == name) {
            self.libraries.push((line, name.to_owned()));
        }
        Ok(())
    }

    fn push(&mut self, keyword: &str, words: &[&str]) {
        self.text.push_str(keyword);
        for word in words {
            self.text.push(' ');
            self.text.push_str(word);
        }
        self.text.push('\n');
    }
}

/// The words of a statement up to a comment.
fn words(rest: &str) -> Vec<&str> {
    rest.split_whitespace()
        .take_while(|w| !w.starts_with('#'))
        .collect()
}

/// An absolute index from 1; a negative one counts back from the latest of `count`.
fn index(word: &str, count: usize, what: &str) -> Result<usize, String> {
    let number: i64 = word
        .parse()
        .map_err(|_| format!("\"{}\" is not a {what} index", brief(word)))?;
    let absolute = if number < 0 {
        count as i64 + 1 + number
    } else {
        number
    };
    if number == 0 {
        Err(format!("{what} index 0: indices start at 1"))
    } else if (1..=count as i64).contains(&absolute) {
        Ok(absolute as usize)
    } else {
        Err(format!(
            "{what} index {number} is out of range: {count} so far"
        ))
    }
}
