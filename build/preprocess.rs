//! As much of the GLSL preprocessor as decides which bindings and push constants a shader declares:
//! includes, macros without parameters, and conditions on whether a macro is defined.

use std::collections::BTreeMap;

use crate::Files;

struct Preprocessor<'a> {
    shared: &'a Files,
    /// Macros without parameters.
    macros: BTreeMap<String, String>,
    text: String,
}

/// A condition that is open.
struct Condition {
    /// Whether the lines of the present branch count.
    taken: bool,
    /// Whether any branch has been taken so far.
    any: bool,
}

/// The text of a shader with its includes, without comments, directives, and the branches that do
/// not count; macros without parameters are replaced.
pub fn preprocess(name: &str, source: &str, shared: &Files) -> Result<String, String> {
    let mut preprocessor = Preprocessor {
        shared,
        macros: BTreeMap::new(),
        text: String::new(),
    };
    preprocessor.file(name, source, 0)?;
    Ok(preprocessor.text)
}

impl Preprocessor<'_> {
    fn file(&mut self, name: &str, source: &str, depth: usize) -> Result<(), String> {
        const DEEPEST: usize = 16;
        if depth > DEEPEST {
            return Err(format!("shaders/{name} includes itself"));
        }
        let mut conditions: Vec<Condition> = Vec::new();
        let joined = without_comments(source).replace("\\\n", " ");
        for line in joined.lines() {
            let counts = conditions.iter().all(|c| c.taken);
            let at = |e: String| format!("shaders/{name}: `{line}`: {e}");
            match line.trim_start().strip_prefix('#') {
                Some(directive) => {
                    let (word, rest) = split_word(directive.trim());
                    if self.condition(&mut conditions, word, rest).map_err(at)? || !counts {
                        continue;
                    }
                    self.directive(word, rest, depth).map_err(at)?;
                }
                None if counts => self.replace_macros(line),
                None => {}
            }
        }
        match conditions.is_empty() {
            true => Ok(()),
            false => Err(format!("shaders/{name}: an #if without its #endif")),
        }
    }

    /// Whether the directive is one of the conditions.
    fn condition(
        &self,
        conditions: &mut Vec<Condition>,
        word: &str,
        rest: &str,
    ) -> Result<bool, String> {
        let open = |conditions: &mut Vec<Condition>, taken| {
            conditions.push(Condition { taken, any: taken });
        };
        let last = |conditions: &mut Vec<Condition>| conditions.pop().ok_or("no #if is open");
        match word {
            "ifdef" => open(conditions, self.macros.contains_key(rest)),
            "ifndef" => open(conditions, !self.macros.contains_key(rest)),
            "if" => open(conditions, self.is_defined(rest)?),
            "elif" | "else" => {
                let before = last(conditions)?;
                let holds = word == "else" || self.is_defined(rest)?;
                conditions.push(Condition {
                    taken: holds && !before.any,
                    any: holds || before.any,
                });
            }
            "endif" => {
                last(conditions)?;
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// The value of `defined(NAME)`.
    fn is_defined(&self, condition: &str) -> Result<bool, String> {
        let name = (condition.trim().strip_prefix("defined("))
            .and_then(|rest| rest.strip_suffix(')'))
            .ok_or("only conditions of the form defined(NAME) are understood")?;
        Ok(self.macros.contains_key(name.trim()))
    }

    fn directive(&mut self, word: &str, rest: &str, depth: usize) -> Result<(), String> {
        match word {
            "include" => {
                let wanted = rest.trim_matches('"');
                let file = wanted.strip_prefix("shared/").unwrap_or(wanted);
                let text = self.shared.get(file);
                let text = text.ok_or_else(|| format!("no shaders/{wanted}"))?;
                self.file(wanted, text, depth + 1)
            }
            "define" => {
                let (name, value) = split_word(rest);
                // Macros with parameters stand in code only.
                if !name.contains('(') {
                    self.macros.insert(name.to_owned(), value.to_owned());
                }
                Ok(())
            }
            "version" | "extension" => Ok(()),
            other => Err(format!("#{other} is not understood")),
        }
    }

    fn replace_macros(&mut self, line: &str) {
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        let mut rest = line;
        while let Some(first) = rest.chars().next() {
            let in_word = is_word(first);
            let end = rest.find(|c| is_word(c) != in_word).unwrap_or(rest.len());
            let (part, after) = rest.split_at(end);
            self.text
                .push_str(self.macros.get(part).map_or(part, |value| value));
            rest = after;
        }
        self.text.push('\n');
    }
}

/// The first word and what follows it.
fn split_word(text: &str) -> (&str, &str) {
    let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    (word, rest.trim())
}

fn without_comments(source: &str) -> String {
    let mut text = String::with_capacity(source.len());
    let mut rest = source;
    while let Some(start) = rest.find('/') {
        text.push_str(&rest[..start]);
        rest = &rest[start..];
        let end = match rest.as_bytes().get(1) {
            Some(b'/') => rest.find('\n'),
            Some(b'*') => rest.find("*/").map(|end| end + 2),
            _ => {
                text.push('/');
                Some(1)
            }
        };
        rest = &rest[end.unwrap_or(rest.len())..];
    }
    text.push_str(rest);
    text
}
