//! `orograph completions` and `orograph man`: what shells and `man` read about the commands, made from their
//! declarations.

use clap_complete::Shell;
use clap_mangen::Man;

use crate::report::{failure::Failure, terminal};

const PROGRAM: &str = "orograph";

/// Prints the completions of commands and options for a shell
///
/// For bash: `orograph completions bash > ~/.local/share/bash-completion/completions/orograph`. For zsh, save them as
/// `_orograph` in a folder of `$fpath`; for fish, as `~/.config/fish/completions/orograph.fish`.
#[derive(Debug, clap::Args)]
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

impl CompletionsArgs {
    pub(super) fn run(&self) -> Result<(), Failure> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut super::declaration(), PROGRAM, &mut script);
        terminal::print(&String::from_utf8_lossy(&script))
    }
}

/// Prints a page for `man`
///
/// `orograph man run > orograph-run.1` saves the page of `run`, and `man ./orograph-run.1` shows it.
#[derive(Debug, clap::Args)]
pub struct ManArgs {
    /// The command [default: the program]
    #[arg(value_name = "COMMAND", value_parser = command)]
    command: Option<clap::Command>,
}

impl ManArgs {
    pub(super) fn run(self) -> Result<(), Failure> {
        let mut page = Vec::new();
        let page_of = Man::new(self.command.unwrap_or_else(built));
        page_of.render(&mut page).map_err(|error| terminal::unprinted(&error))?;
        terminal::print(&String::from_utf8_lossy(&page))
    }
}

/// The declaration of the program, with the names of pages such as `orograph-run`.
fn built() -> clap::Command {
    let mut program = super::declaration();
    program.build();
    program
}

fn command(name: &str) -> Result<clap::Command, String> {
    let program = built();
    let names = program.get_subcommands().map(clap::Command::get_name).collect::<Vec<_>>().join(", ");
    program.find_subcommand(name).cloned().ok_or_else(|| format!("the commands are {names}"))
}
