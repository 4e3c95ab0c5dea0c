//! The cases of one driver, one after the other, in this process.
#![expect(clippy::disallowed_methods, reason = "the time of a case is what is measured")]

use std::{
    fs::File,
    panic,
    path::Path,
    process::ExitCode,
    sync::{
        Mutex,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use serde::{Deserialize, Serialize};

use crate::{
    MEMORY,
    dice::Dice,
    drivers::{Attack, Driver},
};

/// Longest time of a case; more counts as a hang.
const LONGEST: Duration = Duration::from_secs(1);
/// How often a case that took longer is run again; the least time counts.
const TRIES: usize = 4;
/// Time after which the process ends itself.
const DEADLINE: Duration = Duration::from_secs(30);
/// Memory that any case may use, in bytes.
pub const MOST: usize = 64 << 20;
/// Bytes for each cell of the world that a case builds.
const PER_CELL: usize = 16;
/// Number of failures that are noted in full.
const NOTED: usize = 20;

/// The results of some cases.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tally {
    /// Number of cases.
    pub cases: u64,
    /// How many were accepted as valid input.
    pub accepted: u64,
    /// How many panicked, or ended the process.
    pub panics: u64,
    /// How many took longer than a second.
    pub hangs: u64,
    /// How many used too much memory.
    pub hogs: u64,
    /// How many gave a wrong result.
    pub wrong: u64,
    /// The longest time, in milliseconds, and its case.
    pub slowest: (u64, u64),
    /// The largest peak of memory in bytes, and its case.
    pub largest: (u64, u64),
    /// The first failures: the case, and what happened.
    pub failures: Vec<(u64, String)>,
}

impl Tally {
    /// Notes a failure.
    pub fn fail(&mut self, case: u64, what: String) {
        if self.failures.len() < NOTED {
            self.failures.push((case, what));
        }
    }

    /// Adds the results of other cases.
    pub fn add(&mut self, other: Self) {
        self.cases += other.cases;
        self.accepted += other.accepted;
        self.panics += other.panics;
        self.hangs += other.hangs;
        self.hogs += other.hogs;
        self.wrong += other.wrong;
        self.slowest = self.slowest.max(other.slowest);
        self.largest = self.largest.max(other.largest);
        other.failures.into_iter().for_each(|(case, what)| self.fail(case, what));
    }
}

/// Where the last panic was, and what it said.
static PANIC: Mutex<String> = Mutex::new(String::new());

/// Runs cases and prints their tally as JSON. The number of the present case is in the file `note`.
pub fn run(driver: &Driver, first: u64, cases: u64, note: &Path) -> ExitCode {
    let Ok(note) = File::create(note) else { return ExitCode::FAILURE };
    let attack = (driver.prepare)();
    panic::set_hook(Box::new(|info| {
        if let Ok(mut said) = PANIC.lock() {
            *said = info.to_string();
        }
    }));
    let present = AtomicU64::new(first);
    let is_over = AtomicU64::new(0);
    let tally = std::thread::scope(|scope| {
        scope.spawn(|| watch(&present, &is_over));
        let tally = all(driver, attack, first..first + cases, &note, &present);
        is_over.store(1, Ordering::Relaxed);
        tally
    });
    println!("{}", serde_json::to_string(&tally).unwrap_or_default());
    ExitCode::SUCCESS
}

/// Ends the process when a case takes too long.
fn watch(present: &AtomicU64, is_over: &AtomicU64) {
    let mut since = (present.load(Ordering::Relaxed), Instant::now());
    while is_over.load(Ordering::Relaxed) == 0 {
        std::thread::sleep(Duration::from_millis(50));
        let case = present.load(Ordering::Relaxed);
        if case != since.0 {
            since = (case, Instant::now());
        } else if since.1.elapsed() > DEADLINE {
            std::process::abort();
        }
    }
}

fn all(
    driver: &Driver,
    mut attack: Box<dyn Attack>,
    cases: std::ops::Range<u64>,
    note: &File,
    present: &AtomicU64,
) -> Tally {
    let mut tally = Tally::default();
    for case in cases {
        note_case(note, case);
        present.store(case, Ordering::Relaxed);
        let mut once = || {
            let start = Instant::now();
            let tried = || panic::catch_unwind(panic::AssertUnwindSafe(|| attack.case(&mut Dice::new(case))));
            let (result, peak) = MEMORY.peak_of(tried);
            (result, peak, start.elapsed())
        };
        let (result, peak, mut took) = once();
        for _ in 0..TRIES {
            if took > LONGEST {
                // Perhaps the machine was busy.
                took = took.min(once().2);
            }
        }
        tally.cases += 1;
        tally.slowest = tally.slowest.max((took.as_millis() as u64, case));
        tally.largest = tally.largest.max((peak as u64, case));
        match result {
            Ok(Ok(taken)) => {
                tally.accepted += u64::from(taken.accepted);
                if peak > MOST + PER_CELL * taken.cells {
                    tally.hogs += 1;
                    tally.fail(case, format!("{} of memory", orograph_graph::bytes(peak as u64)));
                }
            }
            Ok(Err(what)) => {
                tally.wrong += 1;
                tally.fail(case, what);
            }
            Err(_) => {
                tally.panics += 1;
                tally.fail(case, PANIC.lock().map(|said| said.clone()).unwrap_or_default());
                // What panicked may be in any state.
                attack = (driver.prepare)();
            }
        }
        if took > LONGEST {
            tally.hangs += 1;
            tally.fail(case, format!("{:.1} s", took.as_secs_f64()));
        }
    }
    tally
}

#[cfg(unix)]
fn note_case(note: &File, case: u64) {
    // Without the note, only a sudden end of the process cannot be told.
    let _ = std::os::unix::fs::FileExt::write_all_at(note, &case.to_le_bytes(), 0);
}

#[cfg(not(unix))]
fn note_case(mut note: &File, case: u64) {
    let rewound = std::io::Seek::rewind(&mut note);
    let _ = rewound.and_then(|()| std::io::Write::write_all(&mut note, &case.to_le_bytes()));
}
