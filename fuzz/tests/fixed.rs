//! A fixed set of cases of every driver.

use std::process::Command;

/// 100,000 cases of each driver: no panic, no hang, bounded memory and no wrong result.
#[test]
fn damaged_input_does_no_harm() {
    let output =
        Command::new(env!("CARGO_BIN_EXE_fuzz")).args(["--cases", "100000"]).output().expect("the program starts");
    let said = String::from_utf8_lossy(&output.stdout);
    println!("{said}");
    assert!(output.status.success(), "{said}");
}
