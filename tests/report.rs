//! The report of benchmarks: what it measures, its page, and what it is set beside.

mod common;

use std::process::Command;

use common::{assert_silent, device};
use mesolux::bench::report::{
    Form, Measure, OfDevice, Options, Plan, Report, SCHEMA, Section, run, write,
};
use serde_json::Value;

/// Every chapter of a real run: finite figures with their samples, in all three files.
#[test]
#[ignore = "long: runs by scripts/test --all"]
fn all_chapters_are_measured() {
    let folder = tempfile::tempdir().expect("a folder");
    let options = Options {
        form: Form::Short,
        plan: Plan {
            elements: 3000,
            runs: 2,
            patches: Some(8000),
            table_runs: 1,
            frames: 1,
            places: 60,
            paths: 100,
        },
        cache: None,
        against: None,
    };
    let report = run(&[device()], &options, folder.path(), || true).expect("it runs");
    assert!(report.provenance.whole && report.provenance.seconds > 0.0);
    let [of_device] = &report.devices[..] else {
        panic!("one device");
    };
    assert_eq!(of_device.failed, None);
    let count = |section| {
        let of_section = of_device.measures.iter().filter(|m| m.section == section);
        of_section.count()
    };
    // Of three presets and three scenes; preview follows rays to strong emitters alone.
    assert_eq!(count(Section::Stages), 33);
    assert!((9..=12).contains(&count(Section::Rates)));
    assert_eq!(count(Section::Error), 9);
    assert_eq!(count(Section::Relight), 1);
    assert_eq!(count(Section::Table1), 9);
    assert_eq!(count(Section::Frames), 15);
    for m in &of_device.measures {
        let values = [m.median, m.low, m.high];
        assert!(values.iter().all(|v| v.is_finite()), "{m:?}");
        assert!(!m.samples.is_empty() && m.low <= m.high, "{m:?}");
    }
    // A whole bake takes longer than its set-up.
    let stage = |quantity| {
        let found = of_device.measures.iter().find(|m| m.quantity == quantity);
        found.expect("it is measured").median
    };
    assert!(stage("whole bake") > stage("set-up"));
    let read = Report::load(&folder.path().join("report.json")).expect("it was written");
    assert_eq!(read.devices[0].measures.len(), of_device.measures.len());
    let html = std::fs::read_to_string(folder.path().join("report.html")).expect("a page");
    assert_eq!(html.matches("<svg").count(), 4);
    assert_silent();
}

/// A run that is stopped before its first figures writes nothing, and one that is stopped later
/// keeps what it has and says so.
#[test]
fn what_was_measured_is_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let options = Options {
        form: Form::Short,
        plan: Plan {
            elements: 3000,
            runs: 1,
            places: 20,
            paths: 4,
            ..Form::Short.plan()
        },
        cache: None,
        against: None,
    };
    let nothing = run(&[device()], &options, folder.path(), || false).expect("it stops");
    assert!(nothing.devices.is_empty());
    assert!(!folder.path().join("report.json").exists());
    let asked = std::cell::Cell::new(0);
    let go_on = || {
        asked.set(asked.get() + 1);
        asked.get() < 30
    };
    let part = run(&[device()], &options, folder.path(), go_on).expect("it stops");
    assert!(!part.provenance.whole);
    let markdown = std::fs::read_to_string(folder.path().join("report.md")).expect("it is kept");
    assert!(markdown.contains("Not all was measured"));
    assert_silent();
}

fn small(name: &str, seconds: f64) -> Report {
    let measure = |section, quantity: &str, unit: &str, samples| {
        Measure::new(section, "a < b, 8 elements", quantity, unit, samples)
    };
    let mut report: Report = serde_json::from_value(serde_json::json!({
        "schema": SCHEMA,
        "provenance": {
            "program": "mesolux 0", "commit": "0123", "date": "2026-01-01T00:00:00Z",
            "system": "linux", "threads": 2, "form": "short", "plan": Form::Short.plan(),
            "seconds": 1.0, "whole": true,
        },
        "devices": [],
    }))
    .expect("a report");
    report.devices = vec![
        OfDevice {
            name: name.into(),
            driver: "driver".into(),
            vulkan: "1.3.0".into(),
            measures: vec![
                measure(
                    Section::Stages,
                    "whole bake",
                    "s",
                    vec![seconds, 2.0 * seconds, 3.0],
                ),
                measure(Section::Table1, "lambert", "s", vec![1.0]),
                measure(Section::Table1, "K = 16", "s", vec![2.0]),
                measure(Section::Table1, "K = 64", "s", vec![2.5]),
            ],
            failed: None,
        },
        OfDevice {
            name: "other".into(),
            driver: String::new(),
            vulkan: String::new(),
            measures: Vec::new(),
            failed: Some("it lost <itself>".into()),
        },
    ];
    report
}

/// The page is whole without a network, names what failed, and sets the same figures side by side.
#[test]
fn pages_set_reports_side_by_side() {
    let folder = tempfile::tempdir().expect("a folder");
    let (now, before) = (small("a device", 1.0), small("a device of before", 0.5));
    write(&now, Some(&before), folder.path()).expect("they are written");
    let text = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("it is there");
    let (html, markdown) = (text("report.html"), text("report.md"));
    // The only address is that of SVG itself.
    assert_eq!(
        html.matches("http").count(),
        html.matches("http://www.w3.org/2000/svg").count()
    );
    assert!(html.contains("a &lt; b, 8 elements") && html.contains("it lost &lt;itself&gt;"));
    for page in [&html, &markdown] {
        assert!(page.contains("K = 64 takes 1.25 times as long as K = 16, and 2.50 times"));
    }
    // Median 2 of 1, 2, 3 over 1 of 0.5, 1, 3.
    assert!(markdown.contains("| whole bake | 2.00 | 1.00 to 3.00 | s | 3 | 1.00 | 2.00 |"));
    let run = |args: &[&str]| {
        let run = Command::new(env!("CARGO_BIN_EXE_mesolux"))
            .args([&["bench", "report", "-o", "again"], args].concat())
            .current_dir(folder.path())
            .output()
            .expect("the program runs");
        (
            run.status.code(),
            String::from_utf8_lossy(&run.stderr).into_owned(),
        )
    };
    let (code, error) = run(&["--from", "report.json", "--against", "report.json"]);
    assert_eq!(code, Some(0), "{error}");
    assert!(text("again/report.md").contains("| 2.00 | 1.00 |"));
    let mut other: Value = serde_json::from_str(&text("report.json")).expect("JSON");
    other["schema"] = "mesolux-report-0".into();
    std::fs::write(folder.path().join("other.json"), other.to_string()).expect("it is written");
    std::fs::write(folder.path().join("none.json"), "{}").expect("it is written");
    for (file, told) in [
        ("other.json", "schema mesolux-report-0"),
        ("none.json", "no report"),
        ("missing.json", "missing.json"),
    ] {
        let (code, error) = run(&["--from", file]);
        assert_eq!(code, Some(2), "{error}");
        assert!(error.contains(file) && error.contains(told), "{error}");
    }
}
