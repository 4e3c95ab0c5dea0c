//! What the editor cannot be started with.

use std::process::Stdio;

use crate::{Desk, EMPTY, screen::until};

#[test]
fn a_file_that_cannot_be_read_is_named_and_not_the_window() {
    let Some(desk) = Desk::new(EMPTY) else { return };
    let output = desk.command(&desk.folder.path().join("none.ron")).output().expect("it runs");
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(told.contains("there is no file") && !told.contains("window"), "{told}");
}

#[test]
fn without_vulkan_it_shows_maps_or_says_what_it_needs() {
    let Some(desk) = Desk::new(EMPTY) else { return };
    let mut command = desk.command(&desk.file());
    // No driver; one of OpenGL may be there in its place.
    command.env("VK_DRIVER_FILES", "/dev/null").env("VK_ICD_FILENAMES", "/dev/null");
    let mut child = command.stderr(Stdio::piped()).spawn().expect("it starts");
    let ended = until("a window, or an end", || match child.try_wait().expect("is a child") {
        Some(status) => Some(Some(status)),
        None => desk.screen.window("graph.ron").map(|_| None),
    });
    let _ = child.kill();
    let output = child.wait_with_output().expect("is a child");
    let told = String::from_utf8_lossy(&output.stderr);
    if let Some(status) = ended {
        assert_eq!(status.code(), Some(2), "{told}");
        assert!(told.contains("the editor needs a display and a graphics driver"), "{told}");
    }
}
