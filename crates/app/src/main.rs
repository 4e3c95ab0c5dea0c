//! The program `orograph`.

#[global_allocator]
static MEMORY: orograph::memory::Memory = orograph::memory::Memory;

fn main() -> std::process::ExitCode {
    orograph::run(std::env::args_os())
}
