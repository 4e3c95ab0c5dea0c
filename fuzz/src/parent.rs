//! Runs each driver in a process of its own, as many at once as there are processors.

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
};

use crate::{child::Tally, drivers::Driver};

/// How often a driver is started again after its process ended early.
const RESTARTS: usize = 10;

/// The tallies of all drivers.
pub fn run(drivers: &[&'static Driver], first: u64, cases: u64) -> Vec<(&'static Driver, Tally)> {
    let tallies = Mutex::new(Vec::new());
    let next = AtomicUsize::new(0);
    let work = || {
        while let Some(driver) = drivers.get(next.fetch_add(1, Ordering::Relaxed)) {
            let tally = tally(driver, first, cases);
            if let Ok(mut tallies) = tallies.lock() {
                tallies.push((*driver, tally));
            }
        }
    };
    let workers = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    std::thread::scope(|scope| (0..workers).for_each(|_| drop(scope.spawn(work))));
    let mut tallies = tallies.into_inner().unwrap_or_default();
    tallies.sort_by_key(|(driver, _)| drivers.iter().position(|other| other.name == driver.name));
    tallies
}

fn tally(driver: &Driver, first: u64, cases: u64) -> Tally {
    let mut tally = Tally::default();
    let (mut from, end) = (first / driver.files, (first + cases).div_ceil(driver.files));
    for _ in 0..=RESTARTS {
        if from >= end {
            break;
        }
        match child(driver, from, end - from) {
            Ok(part) => {
                tally.add(part);
                break;
            }
            Err(Some(case)) => {
                tally.cases += case + 1 - from;
                tally.panics += 1;
                tally.fail(case, "ended the process".to_owned());
                from = case + 1;
            }
            Err(None) => {
                tally.fail(from, "the process cannot be started".to_owned());
                break;
            }
        }
    }
    tally.cases *= driver.files;
    tally.accepted *= driver.files;
    tally
}

/// Runs a driver in a process. When it ends early, the error is the case in which it did.
fn child(driver: &Driver, first: u64, cases: u64) -> Result<Tally, Option<u64>> {
    // In memory where there is such a folder: cases write many small files.
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    let folder = folder.map_err(|_| None)?;
    let note = folder.path().join("case");
    let program = std::env::current_exe().map_err(|_| None)?;
    let mut command = Command::new(program);
    command.args(["--driver", driver.name, "--first", &first.to_string(), "--cases", &cases.to_string(), "--note"]);
    // Everything that the driver writes is removed with the folder, however its process ends.
    command.arg(&note).env("TMPDIR", folder.path()).stdout(Stdio::piped()).stderr(Stdio::inherit());
    let output = command.output().map_err(|_| None)?;
    let tally = output.status.success().then(|| serde_json::from_slice(&output.stdout).ok()).flatten();
    tally.ok_or_else(|| last_case(&note))
}

fn last_case(note: &Path) -> Option<u64> {
    Some(u64::from_le_bytes(fs::read(note).ok()?.try_into().ok()?))
}

/// Prints a table of the drivers, and the failures.
pub fn print(tallies: &[(&'static Driver, Tally)]) {
    println!("driver     cases      accepted   panics  hangs  hogs  wrong  slowest   peak        what");
    for (driver, tally) in tallies {
        let Tally { cases, accepted, panics, hangs, hogs, wrong, slowest, largest, .. } = tally;
        let peak = orograph_graph::bytes(largest.0);
        println!(
            "{:<9}  {cases:<9}  {accepted:<9}  {panics:<6}  {hangs:<5}  {hogs:<4}  {wrong:<5}  {:<5} ms  {peak:<10}  {}",
            driver.name, slowest.0, driver.about
        );
    }
    for (driver, tally) in tallies {
        for (case, what) in &tally.failures {
            println!("--driver {} --first {} --cases 1: {what}", driver.name, case * driver.files);
        }
    }
}
