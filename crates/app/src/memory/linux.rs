//! The end of the program with Linux system calls only, because the C library allocates to list a folder.
#![expect(unsafe_code, reason = "calls of the system")]

use std::ffi::{CStr, c_int};

use orograph_graph::memory::Left;

/// Maximum depth of folders that are emptied.
const DEEPEST: u32 = 8;

/// Number of attempts to empty a folder into which other threads may still write.
const PASSES: u32 = 4;

/// Returns true if errors go to a terminal.
pub(super) fn is_terminal() -> bool {
    // SAFETY: reads only a file descriptor number.
    unsafe { libc::isatty(libc::STDERR_FILENO) == 1 }
}

/// The stream to write to.
#[derive(Clone, Copy, Debug)]
pub(super) enum Stream {
    Output = libc::STDOUT_FILENO as isize,
    Error = libc::STDERR_FILENO as isize,
}

/// Writes as much of the text as possible.
pub(super) fn say(to: Stream, mut text: &[u8]) {
    while !text.is_empty() {
        // SAFETY: pointer and length are those of the slice.
        let written = unsafe { libc::write(to as c_int, text.as_ptr().cast(), text.len()) };
        match usize::try_from(written) {
            Ok(count @ 1..) => text = &text[count.min(text.len())..],
            _ => return,
        }
    }
}

/// Ends the program at once, without running any destructors.
pub(super) fn leave() -> ! {
    // SAFETY: does not return.
    unsafe { libc::_exit(crate::Exit::Unable as c_int) }
}

/// Removes leftover files. The path ends with a zero byte.
pub(super) fn remove(path: &[u8], left: Left) {
    let Ok(path) = CStr::from_bytes_with_nul(path) else { return };
    match left {
        Left::Temporary => remove_all(libc::AT_FDCWD, path, 0),
        Left::Around => {
            unlink(libc::AT_FDCWD, path, libc::AT_REMOVEDIR);
        }
    }
}

/// Removes an entry of an open folder: a file, or a folder with its content.
fn remove_all(folder: c_int, name: &CStr, depth: u32) {
    if unlink(folder, name, 0) || depth > DEEPEST {
        return;
    }
    // a link to a folder is not followed
    let flags = libc::O_RDONLY | libc::O_DIRECTORY | libc::O_NOFOLLOW | libc::O_CLOEXEC;
    // SAFETY: the name is a zero-terminated string.
    let opened = unsafe { libc::openat(folder, name.as_ptr(), flags) };
    if opened < 0 {
        return;
    }
    for _ in 0..PASSES {
        empty(opened, depth);
        if unlink(folder, name, libc::AT_REMOVEDIR) {
            break;
        }
    }
    // SAFETY: it was opened above.
    unsafe { libc::close(opened) };
}

/// Removes the content of an open folder.
fn empty(folder: c_int, depth: u32) {
    // records of the system: number and offset of 8 bytes each, length of 2, kind of 1, name
    #[repr(align(8))]
    struct Records([u8; 4096]);
    const LENGTH: usize = 16;
    const NAME: usize = 19;
    let mut records = Records([0; 4096]);
    // SAFETY: rewinds the folder.
    unsafe { libc::lseek(folder, 0, libc::SEEK_SET) };
    loop {
        // SAFETY: the system writes at most the length of the buffer.
        let read = unsafe { libc::syscall(libc::SYS_getdents64, folder, records.0.as_mut_ptr(), records.0.len()) };
        let Some(mut left) = usize::try_from(read).ok().and_then(|read| records.0.get(..read)) else { return };
        if left.is_empty() {
            return;
        }
        while let Some(length) = left.get(LENGTH..LENGTH + 2) {
            let length = usize::from(u16::from_ne_bytes([length[0], length[1]]));
            let (Some(record), Some(rest)) = (left.get(..length), left.get(length.max(1)..)) else { return };
            if let Some(Ok(name)) = record.get(NAME..).map(CStr::from_bytes_until_nul)
                && !matches!(name.to_bytes(), b"." | b"..")
            {
                remove_all(folder, name, depth + 1);
            }
            left = rest;
        }
    }
}

/// Removes one name. Returns true if it is gone.
fn unlink(folder: c_int, name: &CStr, flags: c_int) -> bool {
    // SAFETY: the name is a zero-terminated string.
    unsafe { libc::unlinkat(folder, name.as_ptr(), flags) == 0 }
}

#[cfg(test)]
mod tests {
    use std::{ffi::CString, fs};

    use super::*;

    #[test]
    fn a_folder_is_removed_with_its_content_only() {
        let root = tempfile::tempdir().expect("a folder");
        let [out, kept] = ["out", "kept"].map(|name| root.path().join(name));
        let staging = out.join(".staging");
        fs::create_dir_all(staging.join("deeper")).expect("made");
        fs::create_dir(&kept).expect("made");
        fs::write(kept.join("mine"), "x").expect("written");
        // more names than fit into one call
        (0..500).for_each(|k| fs::write(staging.join(format!("{k:060}")), "x").expect("written"));
        fs::write(staging.join("deeper/file"), "x").expect("written");
        std::os::unix::fs::symlink(&kept, staging.join("link")).expect("made");
        let path = |path: &std::path::Path| CString::new(path.as_os_str().as_encoded_bytes()).expect("a path");
        remove(path(&staging).as_bytes_with_nul(), Left::Temporary);
        assert!(!staging.exists() && out.exists());
        remove(path(&out).as_bytes_with_nul(), Left::Around);
        remove(path(&kept).as_bytes_with_nul(), Left::Around);
        assert!(!out.exists() && kept.join("mine").exists());
        remove(b"no end", Left::Temporary);
        remove(path(&out).as_bytes_with_nul(), Left::Temporary);
    }
}
