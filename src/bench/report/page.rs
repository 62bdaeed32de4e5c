//! A report as a page of its own, without a script and without a network, and as Markdown.

use std::fmt::Write as _;

use super::charts::chart;
use super::model::{Form, OfDevice, Report};
use super::tables::tables;

const STYLE: &str = "
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, sans-serif; color: #222; background: #fff; margin: 2rem auto;
  max-width: 70rem; padding: 0 1.5rem; }
h1 { font-size: 1.6rem; margin-bottom: .2rem; }
h2 { font-size: 1.25rem; margin-top: 2.5rem; padding-bottom: .2rem;
  border-bottom: 2px solid #084594; }
h3 { font-size: 1.05rem; margin: 2rem 0 .3rem; }
p { margin: .3rem 0 .8rem; max-width: 48rem; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .1rem 1.2rem; margin: 1rem 0; }
dt { color: #666; } dd { margin: 0; }
figure { margin: 1rem 0; overflow-x: auto; } figure svg { max-width: 100%; height: auto; }
table { border-collapse: collapse; margin: .5rem 0 1rem; font-variant-numeric: tabular-nums; }
th { text-align: left; color: #666; font-weight: 600; border-bottom: 1px solid #999; }
th, td { padding: .15rem .9rem .15rem 0; white-space: nowrap; }
td.number, th.number { text-align: right; }
tr.first td { border-top: 1px solid #ddd; }
.warning { color: #a00; font-weight: 600; }
";

/// Columns of text; the others hold numbers.
const TEXT: [&str; 3] = ["what", "quantity", "unit"];

/// # Errors
/// A chart that cannot be drawn.
pub fn html(
    report: &Report,
    against: Option<&Report>,
) -> std::result::Result<String, Box<dyn std::error::Error>> {
    let mut out = String::new();
    writeln!(
        out,
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n\
         <title>Mesolux benchmark</title>\n<style>{STYLE}</style>\n</head>\n<body>\n\
         <h1>Mesolux benchmark</h1>\n<p>What precomputed global illumination costs on this \
         machine, and how exact it is. All figures are in \
         <a href=\"report.json\">report.json</a>.</p>"
    )?;
    writeln!(out, "<dl>")?;
    for (name, value) in provenance(report) {
        writeln!(out, "<dt>{name}</dt><dd>{}</dd>", escaped(&value))?;
    }
    if let Some(other) = against {
        let value = other_report(other);
        writeln!(out, "<dt>Beside</dt><dd>{}</dd>", escaped(&value))?;
    }
    writeln!(out, "</dl>")?;
    if !report.provenance.whole {
        writeln!(out, "<p class=\"warning\">Not all was measured.</p>")?;
    }
    for device in &report.devices {
        writeln!(out, "<h2>{}</h2>", escaped(&title(device)))?;
        if let Some(failed) = &device.failed {
            writeln!(
                out,
                "<p class=\"warning\">Given up: {}</p>",
                escaped(failed)
            )?;
        }
        for table in tables(device, against) {
            writeln!(out, "<h3>{}</h3>\n<p>{}</p>", table.title, table.about)?;
            if let Some(svg) = chart(table.section, device)? {
                writeln!(out, "<figure>{svg}</figure>")?;
            }
            writeln!(out, "<table>\n<tr>")?;
            let is_number: Vec<bool> = table.header.iter().map(|h| !TEXT.contains(h)).collect();
            let class = |i: usize| {
                if is_number[i] {
                    " class=\"number\""
                } else {
                    ""
                }
            };
            for (i, name) in table.header.iter().enumerate() {
                write!(out, "<th{}>{name}</th>", class(i))?;
            }
            writeln!(out, "</tr>")?;
            let mut before = "";
            for row in &table.rows {
                let is_first = row[0] != before;
                write!(
                    out,
                    "<tr{}>",
                    if is_first { " class=\"first\"" } else { "" }
                )?;
                for (i, cell) in row.iter().enumerate() {
                    // What repeats is left out.
                    let cell = if i == 0 && !is_first { "" } else { cell };
                    write!(out, "<td{}>{}</td>", class(i), escaped(cell))?;
                }
                writeln!(out, "</tr>")?;
                before = &row[0];
            }
            writeln!(out, "</table>")?;
            for remark in &table.remarks {
                writeln!(out, "<p>{}</p>", escaped(remark))?;
            }
        }
    }
    writeln!(out, "</body>\n</html>")?;
    Ok(out)
}

pub fn markdown(report: &Report, against: Option<&Report>) -> String {
    let mut out = String::new();
    let mut line = |text: &str| {
        out.push_str(text);
        out.push('\n');
    };
    line("# Mesolux benchmark\n");
    for (name, value) in provenance(report) {
        line(&format!("* {name}: {value}"));
    }
    if let Some(other) = against {
        line(&format!("* Beside: {}", other_report(other)));
    }
    if !report.provenance.whole {
        line("\n**Not all was measured.**");
    }
    for device in &report.devices {
        line(&format!("\n## {}", title(device)));
        if let Some(failed) = &device.failed {
            line(&format!("\n**Given up: {failed}**"));
        }
        for table in tables(device, against) {
            line(&format!("\n### {}\n\n{}\n", table.title, table.about));
            let row = |cells: &[String]| format!("| {} |", cells.join(" | "));
            let header: Vec<String> = table.header.iter().map(ToString::to_string).collect();
            line(&row(&header));
            line(&row(&vec!["---".to_owned(); header.len()]));
            for cells in &table.rows {
                line(&row(cells));
            }
            for remark in &table.remarks {
                line(&format!("\n{remark}"));
            }
        }
    }
    out
}

fn provenance(report: &Report) -> Vec<(&'static str, String)> {
    let p = &report.provenance;
    let form = match p.form {
        Form::Short => "short",
        Form::Full => "full",
    };
    vec![
        ("Program", format!("{}, commit {}", p.program, p.commit)),
        ("Date", p.date.clone()),
        ("System", format!("{}, {} threads", p.system, p.threads)),
        (
            "Form",
            format!(
                "{form}: {} bakes of each preset, {} places of {} paths; {:.0} s in all",
                p.plan.runs, p.plan.places, p.plan.paths, p.seconds
            ),
        ),
    ]
}

fn other_report(other: &Report) -> String {
    let p = &other.provenance;
    let devices: Vec<&str> = other.devices.iter().map(|d| d.name.as_str()).collect();
    format!("commit {}, {}, {}", p.commit, p.date, devices.join(", "))
}

fn title(device: &OfDevice) -> String {
    format!(
        "{} ({}, Vulkan {})",
        device.name, device.driver, device.vulkan
    )
}

/// Text within HTML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
