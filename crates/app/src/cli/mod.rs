//! The command line: one file per command.

mod build_args;
mod cache;
mod check;
mod cube;
mod devices;
mod diff;
mod edit;
mod fit;
mod fmt;
mod metrics;
mod new;
mod nodes;
mod pack;
mod perspective;
mod render;
mod run;
mod schema;
mod sea;
mod shell;
pub mod sweep;
mod watch;

use std::{
    ffi::OsString,
    io::{self, Write as _},
    process::ExitCode,
};

use clap::{CommandFactory as _, Parser, Subcommand};
pub use nodes::{described, manual, nodes_json};
pub use schema::schema;

use crate::{
    report::{
        failure::{Exit, Failure},
        terminal,
    },
    stop,
};

/// Builds terrain from a graph of nodes. Without a command the editor opens.
///
/// A graph file lists nodes (noise, uplift, rivers, scree, measures), wires them and declares the outputs. The same
/// file gives the same terrain at every resolution and, computed on the CPU, the same bytes on every machine.
#[derive(Debug, Parser)]
#[command(name = "orograph", version, after_help = AFTER)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

const AFTER: &str = "\
Exit codes: 0 success, 1 the file or the request is wrong, or an expectation of the file is missed, \
2 it could not be done (disk, memory), 130 stopped with Ctrl-C.\n\
`OROGRAPH_CACHE` sets the folder of stored results, `OROGRAPH_SIMD` (`baseline`, `avx2`, `avx512`) the widest \
instruction set to use; results are the same with each.";

#[derive(Debug, Subcommand)]
enum Command {
    Edit(edit::Args),
    Run(Box<run::Args>),
    Check(check::Args),
    Fit(Box<fit::Args>),
    Fmt(fmt::Args),
    Diff(diff::Args),
    Metrics(metrics::Args),
    New(new::Args),
    Render(Box<render::Args>),
    Watch(Box<watch::Args>),
    Pack(pack::PackArgs),
    Unpack(pack::UnpackArgs),
    Nodes(nodes::Args),
    Schema(schema::Args),
    Cache(cache::Args),
    Devices(devices::Args),
    Completions(shell::CompletionsArgs),
    Man(Box<shell::ManArgs>),
}

impl Command {
    fn run(self) -> Result<(), Failure> {
        match self {
            Self::Edit(args) => args.run(),
            Self::Run(args) => args.run(),
            Self::Check(args) => args.run(),
            Self::Fit(args) => args.run(),
            Self::Fmt(args) => args.run(),
            Self::Diff(args) => args.run(),
            Self::Metrics(args) => args.run(),
            Self::New(args) => args.run(),
            Self::Render(args) => args.run(),
            Self::Watch(args) => args.run(),
            Self::Pack(args) => args.run(),
            Self::Unpack(args) => args.run(),
            Self::Nodes(args) => args.run(),
            Self::Schema(args) => args.run(),
            Self::Cache(args) => args.run(),
            Self::Devices(args) => args.run(),
            Self::Completions(args) => args.run(),
            Self::Man(args) => args.run(),
        }
    }
}

/// The declaration of all commands and options.
fn declaration() -> clap::Command {
    Cli::command()
}

/// Runs the program with its arguments; the first one is the name of the program.
pub fn run(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    stop::survive_file_limits();
    let cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(error) => {
            let printed = error.print().and_then(|()| io::stdout().flush());
            return match printed {
                // Ignored: the terminal may be closed.
                _ if error.use_stderr() => Exit::Wrong.into(),
                Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
                    let failure = terminal::unprinted(&error);
                    terminal::complain(&failure);
                    failure.exit.into()
                }
                _ => Exit::Done.into(),
            };
        }
    };
    let environment = orograph_nodes::numerics::simd::asked().map(|_| ()).map_err(Failure::wrong);
    let command = cli.command.unwrap_or_else(|| Command::Edit(edit::Args::default()));
    match environment.and_then(|()| command.run()) {
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
    fn the_command_line_is_valid() {
        Cli::command().debug_assert();
    }
}
