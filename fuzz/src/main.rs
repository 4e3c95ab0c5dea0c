//! `fuzz`: gives damaged input to everything that reads what others wrote, and counts what goes wrong.
//!
//! Case N of a driver always gets the same input, so runs with other first cases add up, and a failure is repeated with
//! its number. Each driver runs in a process of its own, which may end in any way.

mod child;
mod dice;
mod drivers;
mod parent;

use std::process::ExitCode;

use clap::Parser;
use orograph_tests::Counting;

#[global_allocator]
static MEMORY: Counting = Counting::new();

/// Gives damaged input to everything that reads what others wrote
///
/// Prints the cases, panics, hangs and peak memory of each driver, and exits with 1 if any case failed.
#[derive(Debug, Parser)]
struct Args {
    /// Only this driver; can be given several times
    #[arg(long, value_name = "NAME", value_parser = drivers::find)]
    driver: Vec<&'static drivers::Driver>,
    /// Number of the first case
    #[arg(long, value_name = "N", default_value_t = 0)]
    first: u64,
    /// Number of cases of each driver
    #[arg(long, value_name = "N", default_value_t = 200_000)]
    cases: u64,
    /// Run one driver in this process, and note each case in this file
    #[arg(long, value_name = "FILE", hide = true)]
    note: Option<std::path::PathBuf>,
}

fn main() -> ExitCode {
    let args = Args::parse();
    if let (Some(note), [driver]) = (&args.note, &args.driver[..]) {
        return child::run(driver, args.first, args.cases, note);
    }
    let all: Vec<_> = drivers::ALL.iter().collect();
    let drivers = if args.driver.is_empty() { all } else { args.driver };
    let tallies = parent::run(&drivers, args.first, args.cases);
    parent::print(&tallies);
    if tallies.iter().all(|(_, tally)| tally.failures.is_empty()) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
