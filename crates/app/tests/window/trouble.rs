//! Tests of failures at the start of the editor.

use std::process::{Command, Stdio};

use crate::{EMPTY, EditorProcess, screen::until};

#[test]
fn an_unreadable_file_is_reported_and_not_the_window() {
    let Some(editor) = EditorProcess::new(EMPTY) else { return };
    let output = editor.command(&editor.folder.path().join("none.ron")).output().expect("it runs");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(message.contains("there is no file") && !message.contains("window"), "{message}");
}

#[test]
fn without_vulkan_the_editor_shows_maps_or_reports_what_it_needs() {
    let Some(editor) = EditorProcess::new(EMPTY) else { return };
    let mut command = editor.command(&editor.file());
    // There is no Vulkan driver, but there may be one for OpenGL.
    command.env("VK_DRIVER_FILES", "/dev/null").env("VK_ICD_FILENAMES", "/dev/null");
    let mut child = command.stderr(Stdio::piped()).spawn().expect("it starts");
    let ended = until("a window, or an end", || match child.try_wait().expect("is a child") {
        Some(status) => Some(Some(status)),
        None => editor.screen.window("graph.ron").map(|_| None),
    });
    let _ = child.kill();
    let output = child.wait_with_output().expect("is a child");
    let message = String::from_utf8_lossy(&output.stderr);
    if let Some(status) = ended {
        assert_eq!(status.code(), Some(2), "{message}");
        assert!(message.contains("the editor needs a display and a graphics driver"), "{message}");
    }
}

/// A driver that finds a device but cannot create it: the editor ends with a message, or shows maps with another driver.
#[test]
fn a_driver_that_cannot_create_its_device_is_reported() {
    let Some(editor) = EditorProcess::new(EMPTY) else { return };
    let mut command = editor.command(&editor.file());
    let Some(command) = crate::refusing::make_driver_refuse(&mut command, editor.folder.path()) else { return };
    let output = command.stderr(Stdio::piped()).spawn().expect("it starts").wait_with_output().expect("is a child");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("the editor needs a display and a graphics driver"), "{message}");
    assert!(!message.contains("panicked") && !message.contains(".rs"), "{message}");
}

#[test]
fn without_a_display_the_message_names_no_source_file() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_orograph"));
    for variable in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(variable);
    }
    let output = command.arg("edit").stdin(Stdio::null()).output().expect("it runs");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("DISPLAY") && message.contains("the editor needs a display"), "{message}");
    assert!(!message.contains(".rs") && !message.contains(".cargo"), "{message}");
}
