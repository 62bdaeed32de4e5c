//! `mpirun mesolux bake`: processes of a device each, started by the MPI of the system.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

const MESOLUX: &str = env!("CARGO_BIN_EXE_mesolux");

/// Some processes of one core each, or one alone.
fn bake(processes: usize, arguments: &[&str]) -> Command {
    let mut command = match processes {
        1 => Command::new(MESOLUX),
        _ => {
            let mut mpirun = Command::new("mpirun");
            let count = processes.to_string();
            mpirun.args([
                "--oversubscribe",
                "--bind-to",
                "none",
                "-n",
                &count,
                MESOLUX,
            ]);
            mpirun
        }
    };
    command.arg("bake").args(arguments);
    environment(&mut command);
    command
}

/// Tests may run as root, in a container.
fn environment(command: &mut Command) -> &mut Command {
    command
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
        .env("OMPI_MCA_btl_vader_single_copy_mechanism", "none")
        .env("LP_NUM_THREADS", "1")
}

fn run(processes: usize, arguments: &[&str]) -> Output {
    bake(processes, arguments).output().expect("it is started")
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn check(output: &Output) {
    assert!(
        output.status.success(),
        "{}: {}",
        output.status,
        told(output)
    );
}

/// The tensors of a bake, without what its header says of the run.
fn tensors(path: &Path) -> Vec<u8> {
    let bytes = fs::read(path).expect("the bake is there");
    let header: [u8; 8] = bytes[..8].try_into().expect("eight bytes");
    bytes[8 + u64::from_le_bytes(header) as usize..].to_vec()
}

/// What `--json` has printed.
fn report(output: &Output) -> BTreeMap<String, serde_json::Value> {
    let text = String::from_utf8_lossy(&output.stdout);
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {text}: {}", told(output)))
}

fn number(report: &BTreeMap<String, serde_json::Value>, name: &str) -> u64 {
    report[name].as_u64().expect("a number")
}

fn path(folder: &Path, name: &str) -> (PathBuf, String) {
    let path = folder.join(name);
    let text = path.to_str().expect("it is text").to_owned();
    (path, text)
}

/// With relief and without, kept form factors too.
#[test]
fn processes_give_the_bytes_of_one() {
    let folder = tempfile::tempdir().expect("a folder");
    for (scene, more) in [
        ("cornell", &["--patches", "3000"][..]),
        ("brick-corner", &["--directions", "16"][..]),
    ] {
        let mut alone = None;
        for processes in 1..5 {
            let (out, out_text) = path(folder.path(), &format!("{scene}-{processes}.safetensors"));
            let common = ["--hemicube", "32", "--residual", "0.01", "--no-cache"];
            let kept = ["--keep-visibility", "--json", "-o", &out_text];
            let output = run(processes, &[&[scene], more, &common, &kept].concat());
            check(&output);
            let report = report(&output);
            let sent = number(&report, "sent_bytes") / number(&report, "shots");
            println!("{scene}, {processes}: {sent} bytes a source");
            assert_eq!(sent > 0, processes > 1);
            let others = report["other_devices"].as_array().map_or(0, Vec::len);
            assert_eq!(others, processes - 1);
            let rows = fs::read(out.with_extension("visibility")).expect("rows are kept");
            let now = (tensors(&out), rows);
            match &alone {
                None => alone = Some(now),
                Some(alone) => {
                    assert!(alone.0 == now.0, "{scene}, {processes}: other light");
                    assert!(alone.1 == now.1, "{scene}, {processes}: other form factors");
                }
            }
        }
    }
}

/// Kept rows of one process light a scene in three, without drawing it.
#[test]
fn kept_rows_of_one_are_shared_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, first) = path(folder.path(), "first.safetensors");
    let scene = [
        "cornell",
        "--patches",
        "3000",
        "--hemicube",
        "32",
        "--no-cache",
        "--json",
    ];
    check(&run(
        1,
        &[&scene[..], &["--keep-visibility", "-o", &first]].concat(),
    ));
    let lit = [1, 3].map(|processes| {
        let (out, text) = path(folder.path(), &format!("lit-{processes}.safetensors"));
        let relit = ["--relight", &first, "-o", &text];
        let output = run(processes, &[&scene[..], &relit].concat());
        check(&output);
        let drawn = number(&report(&output), "hemicubes");
        println!("{processes}: {drawn} hemicubes");
        assert_eq!(drawn, 0, "nothing is drawn again");
        tensors(&out)
    });
    assert!(lit[0] == lit[1], "other light");
}

/// Item buffers of 128 pixels a side and the parts of rows.
#[test]
fn a_source_takes_no_more_than_100_kb_on_the_wire() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, out) = path(folder.path(), "out.safetensors");
    let scene = [
        "cornell",
        "--patches",
        "40000",
        "--quality",
        "draft",
        "--hemicube",
        "128",
    ];
    let output = run(
        2,
        &[&scene[..], &["--no-cache", "--json", "-o", &out]].concat(),
    );
    check(&output);
    let report = report(&output);
    let sent = number(&report, "sent_bytes") / number(&report, "shots");
    println!("{sent} bytes a source");
    assert!(sent <= 100_000, "{sent}");
}

/// The batch script starts as many processes as Slurm says. Without Slurm it runs on this machine.
#[test]
fn the_batch_script_bakes() {
    let folder = tempfile::tempdir().expect("a folder");
    let (out, text) = path(folder.path(), "out.safetensors");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/bake-cluster.sh");
    let scene = [
        "cornell",
        "--patches",
        "3000",
        "--hemicube",
        "32",
        "--no-cache",
        "--json",
    ];
    let output = environment(&mut Command::new(script))
        .env("MESOLUX", MESOLUX)
        .env("SLURM_NTASKS_PER_NODE", "2")
        .env("OMPI_MCA_rmaps_base_oversubscribe", "1")
        .args(scene)
        .args(["-o", &text])
        .output()
        .expect("it is started");
    check(&output);
    let others = report(&output)["other_devices"]
        .as_array()
        .map_or(0, Vec::len);
    assert_eq!(others, 1);
    assert!(out.exists());
}

/// The process of an `mpirun` that has this rank.
fn of_rank(mpirun: &Child, rank: usize) -> Option<u32> {
    let wanted = format!("OMPI_COMM_WORLD_RANK={rank}");
    let entries = fs::read_dir("/proc").ok()?;
    entries.flatten().find_map(|entry| {
        let id: u32 = entry.file_name().to_str()?.parse().ok()?;
        let stat = fs::read_to_string(entry.path().join("stat")).ok()?;
        let parent = stat.rsplit(')').next()?.split_whitespace().nth(1)?;
        let environment = fs::read(entry.path().join("environ")).ok()?;
        let has = environment
            .split(|b| *b == 0)
            .any(|v| v == wanted.as_bytes());
        (has && parent == mpirun.id().to_string()).then_some(id)
    })
}

fn wait_for(what: &str, mut done: impl FnMut() -> bool) {
    let start = Instant::now();
    while !done() {
        assert!(start.elapsed() < Duration::from_secs(300), "{what}");
        thread::sleep(Duration::from_millis(20));
    }
}

/// All end, and the same command goes on from the last checkpoint, to the same bytes.
#[test]
fn a_process_that_is_killed_ends_all_and_loses_what_followed_the_checkpoint() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = ["cornell", "--patches", "6000", "--no-cache", "--json"];
    let (alone, alone_text) = path(folder.path(), "alone.safetensors");
    check(&run(1, &[&scene[..], &["-o", &alone_text]].concat()));
    for rank in [1, 0] {
        let (out, text) = path(folder.path(), &format!("out-{rank}.safetensors"));
        let arguments = [&scene[..], &["--checkpoint", "0.2", "-o", &text]].concat();
        let mut started = bake(3, &arguments)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it is started");
        let part = out.with_extension("checkpoint").join("0001.rows");
        wait_for("a checkpoint is written", || part.exists());
        let killed = of_rank(&started, rank).expect("the process runs");
        let signal = Command::new("kill")
            .args(["-9", &killed.to_string()])
            .status();
        assert!(signal.expect("kill runs").success());
        let start = Instant::now();
        wait_for("all end", || {
            started.try_wait().expect("it is asked").is_some()
        });
        println!(
            "rank {rank}: all ended after {:.1} s",
            start.elapsed().as_secs_f64()
        );
        let output = started.wait_with_output().expect("it has ended");
        assert!(!output.status.success() && !out.exists());
        let said = told(&output);
        assert_eq!(said.matches("exited on signal 9").count(), 1, "{said}");
        assert!(!said.contains("panicked"), "{said}");
        let output = run(3, &arguments);
        check(&output);
        assert!(
            number(&report(&output), "resumed") > 0,
            "it goes on from the checkpoint"
        );
        assert!(tensors(&out) == tensors(&alone), "rank {rank}: other light");
        assert!(!part.exists(), "the checkpoint is removed");
    }
}

/// An error of any process is printed once, and no process waits for another.
#[test]
fn errors_are_told_once_and_end_all() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, out) = path(folder.path(), "out.safetensors");
    for (arguments, line) in [
        (
            &["no-such.obj", "-o", &out][..],
            "no-such.obj: cannot be read",
        ),
        (
            &["cornell", "--estimator", "pixel", "-o", &out],
            "take one --device, not several",
        ),
        (
            &["cornell", "--device", "97", "-o", &out],
            "no device \"97\"",
        ),
    ] {
        let output = run(2, arguments);
        let said = told(&output);
        println!("{said}");
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(line) && !said.contains("panicked"), "{said}");
    }
    // Not where it is not a matter of each process.
    let output = run(2, &["no-such.obj", "-o", &out]);
    assert_eq!(told(&output).matches("cannot be read").count(), 1);
}

/// Processes of the `mpirun` of another MPI would each bake all, into the same file.
#[test]
fn processes_that_mpi_does_not_join_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let (out, text) = path(folder.path(), "out.safetensors");
    let mut alone = bake(1, &["cornell", "--patches", "500", "-o", &text]);
    let output = alone.env("PMI_SIZE", "2").output().expect("it is started");
    let said = told(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("MPI joins 1 of them"), "{said}");
    assert!(!out.exists());
}
