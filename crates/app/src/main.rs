//! The program `orograph`.

#[global_allocator]
static MEMORY: orograph_nodes::memory::LargePages = orograph_nodes::memory::LargePages;

fn main() -> std::process::ExitCode {
    orograph::run(std::env::args_os())
}
