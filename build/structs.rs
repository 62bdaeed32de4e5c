//! Writes the structs of `shaders/shared/types.glsl` in Rust, with its comments.

use std::fmt::Write as _;

use crate::emit::rust_type;

/// Reads the text line by line: comments before a struct and after its members are documentation.
pub fn module(text: &str) -> Result<String, String> {
    let mut out = String::new();
    let mut list = String::new();
    let mut comments: Vec<&str> = Vec::new();
    // Name and members of the struct that is open.
    let mut open: Option<(&str, Vec<&str>)> = None;
    for line in text.lines() {
        let (code, comment) = match line.split_once("//") {
            Some((code, comment)) => (code.trim(), Some(comment.trim())),
            None => (line.trim(), None),
        };
        let words: Vec<&str> = code.split_whitespace().collect();
        match (&mut open, &words[..]) {
            (None, ["struct", name, "{"]) => {
                for comment in comments.drain(..) {
                    let _ = writeln!(out, "/// {comment}");
                }
                let _ = writeln!(
                    out,
                    "#[repr(C)]\n#[derive(Debug, Clone, Copy, Default, PartialEq, bytemuck::Pod, \
                     bytemuck::Zeroable)]\npub struct {name} {{"
                );
                open = Some((name, Vec::new()));
            }
            (Some((name, members)), ["};"]) => {
                let _ = writeln!(out, "}}");
                let offset = |member: &&str| format!("std::mem::offset_of!({name}, {member}),");
                let offsets: String = members.iter().map(offset).collect();
                let _ = writeln!(
                    list,
                    "Struct {{ name: {name:?}, offsets: &[{offsets}], \
                     bytes: size_of::<{name}>() }},"
                );
                open = None;
            }
            (Some((_, members)), [glsl_type, member]) if member.ends_with(';') => {
                let member = member.trim_end_matches(';');
                let (rust, _) = rust_type(glsl_type)?;
                if let Some(comment) = comment {
                    let _ = writeln!(out, "/// {comment}");
                }
                let _ = writeln!(out, "pub {member}: {rust},");
                members.push(member);
            }
            (None, []) => match comment {
                Some(comment) => comments.push(comment),
                None => comments.clear(),
            },
            (None, [directive, ..]) if directive.starts_with('#') => {}
            _ => return Err(format!("`{line}` is not understood")),
        }
    }
    let _ = writeln!(
        out,
        "/// Every struct, for tests.\npub static ALL: &[Struct] = &[\n{list}];"
    );
    Ok(out)
}
