//! The command line: one file per command.

mod asked;
mod cache;
mod check;
mod diff;
mod edit;
mod fmt;
mod metrics;
mod nodes;
mod pack;
mod perspective;
mod render;
mod run;
mod sea;
mod sweep;
mod watch;

use std::{ffi::OsString, process::ExitCode};

use clap::{Parser, Subcommand};
pub use nodes::manual;

use crate::{
    failure::{Exit, Failure},
    terminal,
};

/// Terrain from a graph of nodes. Without a command the editor opens.
///
/// A graph file names nodes (noise, uplift, rivers, scree, measures), wires them and says what is to be built. The same
/// file gives the same bytes on every machine, and the same land at every resolution.
#[derive(Debug, Parser)]
#[command(name = "orograph", version, after_help = AFTER)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

const AFTER: &str = "\
Exit codes: 0 everything asked for was done, 1 the file or the request is wrong, 2 it could not be done (disk, memory), \
130 stopped with Ctrl-C.";

#[derive(Debug, Subcommand)]
enum Command {
    Edit(edit::Args),
    Run(Box<run::Args>),
    Check(check::Args),
    Fmt(fmt::Args),
    Diff(diff::Args),
    Metrics(metrics::Args),
    Render(Box<render::Args>),
    Watch(Box<watch::Args>),
    Pack(pack::PackArgs),
    Unpack(pack::UnpackArgs),
    Nodes(nodes::Args),
    Cache(cache::Args),
}

impl Command {
    fn run(self) -> Result<(), Failure> {
        match self {
            Self::Edit(args) => args.run(),
            Self::Run(args) => args.run(),
            Self::Check(args) => args.run(),
            Self::Fmt(args) => args.run(),
            Self::Diff(args) => args.run(),
            Self::Metrics(args) => args.run(),
            Self::Render(args) => args.run(),
            Self::Watch(args) => args.run(),
            Self::Pack(args) => args.run(),
            Self::Unpack(args) => args.run(),
            Self::Nodes(args) => args.run(),
            Self::Cache(args) => args.run(),
        }
    }
}

/// Runs the program on its arguments, the first of which is its own name.
pub fn run(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(error) => {
            // Nothing can be told when the terminal is closed.
            let _ = error.print();
            return if error.use_stderr() { Exit::Wrong.into() } else { Exit::Done.into() };
        }
    };
    match cli.command.unwrap_or_else(|| Command::Edit(edit::Args::default())).run() {
        Ok(()) => Exit::Done.into(),
        Err(failure) => {
            terminal::complain(&failure);
            failure.exit.into()
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;

    #[test]
    fn the_command_line_is_sound() {
        Cli::command().debug_assert();
    }
}
