//! The program `orograph`.

fn main() -> std::process::ExitCode {
    orograph::run(std::env::args_os())
}
