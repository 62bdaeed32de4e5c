//! Webs written as IES files.

use std::fmt::Write;

use super::super::Web;

/// The keyword of a file that holds shares at even angles, between which they are linear.
pub(super) const IS_WEB: &str = "[_MESOLUX] web";

/// A web as an IES file of type C whose candelas are its shares; [`super::Luminaire::read`] gives
/// the same bits.
pub fn web_text(web: &Web) -> String {
    let mut text = format!("IESNA:LM-63-2002\n[TEST] none\n{IS_WEB}\nTILT=NONE\n");
    let angles = |count: u32, whole: f64| {
        let of = move |i: u32| whole * f64::from(i) / f64::from((count - 1).max(1));
        (0..count).map(of)
    };
    let (rows, columns) = (web.rows, web.columns);
    // Writing to a string does not fail.
    let _ = writeln!(text, "1 -1 1 {rows} {columns} 1 2 0 0 0\n1 1 0");
    lines(&mut text, angles(rows, 180.0));
    lines(&mut text, angles(columns, 360.0));
    for column in 0..columns as usize {
        let of_column = web.shares.iter().skip(column).step_by(columns as usize);
        lines(&mut text, of_column);
    }
    text
}

/// Ten numbers a line: a line of the format has 256 characters at most.
fn lines<T: std::fmt::Display>(text: &mut String, numbers: impl Iterator<Item = T>) {
    for (i, number) in numbers.enumerate() {
        let gap = match i {
            0 => "",
            _ if i % 10 == 0 => "\n",
            _ => " ",
        };
        let _ = write!(text, "{gap}{number}");
    }
    text.push('\n');
}
