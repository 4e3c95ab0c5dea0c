//! Hostile archives: each is refused, or unpacked into its folder; nothing is written elsewhere.

use std::{
    fs,
    io::Write as _,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use flate2::{Compression, write::GzEncoder};
use tar::Header;

use super::{fault_of, unpack};

/// One entry of an archive, as raw bytes.
struct Entry<'a> {
    /// At most 100 bytes.
    name: &'a [u8],
    kind: u8,
    /// The size that the header announces; that of the content if it is `None`.
    size: Option<u64>,
    content: &'a [u8],
    gnu: bool,
}

const GRAPH: Entry<'_> = file(b"g.ron", b"()");

const fn file<'a>(name: &'a [u8], content: &'a [u8]) -> Entry<'a> {
    Entry { name, kind: b'0', size: None, content, gnu: false }
}

fn header(entry: &Entry<'_>) -> Header {
    let mut header = if entry.gnu { Header::new_gnu() } else { Header::new_ustar() };
    header.as_mut_bytes()[..entry.name.len()].copy_from_slice(entry.name);
    header.set_size(entry.size.unwrap_or(entry.content.len() as u64));
    header.as_mut_bytes()[156] = entry.kind;
    header.as_mut_bytes()[157..168].copy_from_slice(b"/etc/passwd");
    header.set_cksum();
    header
}

/// The bytes of a tar file.
fn tar(entries: &[Entry<'_>]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for entry in entries {
        bytes.extend(header(entry).as_bytes());
        bytes.extend(entry.content);
        bytes.resize(bytes.len().next_multiple_of(512), 0);
    }
    bytes.resize(bytes.len() + 1024, 0);
    bytes
}

fn compressed(bytes: &[u8]) -> Vec<u8> {
    let mut gz = GzEncoder::new(Vec::new(), Compression::fast());
    gz.write_all(bytes).expect("written");
    gz.finish().expect("written")
}

/// Much longer than a refusal takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

#[expect(clippy::disallowed_methods, reason = "measures the time")]
fn now() -> Instant {
    Instant::now()
}

/// All files below a folder, relative to it.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("readable").path();
        match fs::symlink_metadata(&path).expect("there").is_dir() {
            true => found.extend(files(&path)),
            false => found.push(path),
        }
    }
    found
}

/// Unpacks the bytes of an archive; returns the reason of a refusal, or None when it was unpacked. Checks that nothing
/// is outside the folder, and that everything in it is allowed.
#[track_caller]
fn attack(archive: &[u8], what: &str) -> Option<String> {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, inside) = (folder.path().join("a.orograph"), folder.path().join("above/in"));
    fs::write(&path, archive).expect("written");
    let start = now();
    let result = unpack(&path, &inside);
    assert!(start.elapsed() < PATIENCE, "{what}: {:?}", start.elapsed());
    let outside: Vec<PathBuf> = files(folder.path()).into_iter().filter(|file| !file.starts_with(&inside)).collect();
    assert_eq!(outside, [path], "{what}");
    match result {
        Ok(_) => {
            for file in files(&inside) {
                let name = file.strip_prefix(&inside).expect("inside").to_str().expect("text");
                assert_eq!(fault_of(name), None, "{what}: {name:?}");
                assert!(fs::symlink_metadata(&file).expect("there").is_file(), "{what}: {name:?}");
            }
            None
        }
        Err(failure) => {
            assert!(!inside.exists(), "{what}: a refused archive leaves nothing");
            Some(failure.message)
        }
    }
}

#[test]
fn every_kind_of_entry_but_a_plain_file_is_refused() {
    for kind in 0..=u8::MAX {
        let entry = Entry { kind, gnu: kind % 3 == 0, ..file(b"l", b"1 path=/tmp/x") };
        let said = attack(&compressed(&tar(&[GRAPH, entry])), "kind");
        match kind {
            0 | b'0' => assert_eq!(said, None, "{kind}"),
            _ => assert!(said.is_some_and(|said| said.contains("not a plain file")), "{kind}"),
        }
    }
}

#[test]
fn names_that_lead_elsewhere_or_deceive_are_refused() {
    let names = [
        "../evil",
        "..",
        ".",
        "a/../../evil",
        "/tmp/evil",
        "//evil",
        "a//b",
        "a/",
        "a/.",
        "./a",
        "C:/evil",
        "C:evil",
        "..\\evil",
        "a\\..\\evil",
        "\\\\server\\evil",
        "con",
        "a/NUL.txt",
        "com1.ron",
        "a/lpt9",
        "aux .x",
        "a.",
        "a ",
        "a./b",
        "a*",
        "a?",
        "a\"b",
        "a<b",
        "a>b",
        "a|b",
        "a\nb",
        "a\u{7f}",
        "a\u{85}",
        "\u{1b}[2J",
        ".git/config",
        "a/.hidden",
        ".bashrc",
        "...",
        "a\u{202e}nor.b",
        "\u{200f}a",
        "a/\u{2066}b",
        "\u{61c}",
        "a:stream",
        "",
        " ",
    ];
    for name in names {
        let said = attack(&compressed(&tar(&[GRAPH, file(name.as_bytes(), b"evil")])), name);
        assert!(said.is_some(), "{name:?} was unpacked");
    }
    for name in [&b"a\xff"[..], b"\xc0\xae\xc0\xae/evil", b"\xed\xa0\x80"] {
        assert!(attack(&compressed(&tar(&[GRAPH, file(name, b"evil")])), "bytes").is_some(), "{name:?}");
    }
    for pair in [["a", "A"], ["a", "a/b"], ["a/b", "a"], ["a/b", "A"], ["g.ron", "x"], ["É", "é"]] {
        let [one, two] = pair.map(|name| file(name.as_bytes(), b"1"));
        assert!(attack(&compressed(&tar(&[GRAPH, one, two])), "pair").is_some(), "{pair:?}");
    }
}

/// Long names, long links and extended headers, here with much behind them, are refused by their headers.
#[test]
fn headers_of_headers_are_not_read() {
    let (zeros, long) = (vec![0; 32 << 20], vec![b'a'; 4096]);
    let path = [b"4106 path=", &long[..], b"\n"].concat();
    for kind in [b'L', b'K', b'x', b'g', b'N', b'S', b'V', b'X'] {
        let much = if b"Lx".contains(&kind) { &zeros } else { &path };
        for content in [much, &long, &path] {
            let evil = Entry { kind, gnu: true, ..file(b"././@LongLink", content) };
            let said = attack(&compressed(&tar(&[evil, GRAPH])), "header").expect("refused");
            assert!(said.contains("a header"), "{said}");
        }
    }
    // a header that announces more than there is
    for size in [4096, 1 << 40, u64::MAX / 2, u64::MAX] {
        for kind in [b'0', b'x', b'L'] {
            let evil = Entry { kind, size: Some(size), gnu: true, ..file(b"a", b"") };
            assert!(attack(&compressed(&tar(&[GRAPH, evil])), "size").is_some(), "{size}");
        }
    }
}

/// As the names of a file, flat and in folders, by the headers of three programs; and the longest that a plain header
/// holds.
#[test]
fn names_of_4096_bytes_are_refused() {
    for name in [vec![b'a'; 4096], b"ab/".repeat(1366)[..4096].to_vec(), b"a/b".repeat(1366)[..4096].to_vec()] {
        let record = |key: &str| [format!("{} {key}=", 4096 + 7 + key.len()).as_bytes(), &name, b"\n"].concat();
        let long = [&name[..], b"\0"].concat();
        for (kind, content) in [(b'L', &long), (b'x', &record("path")), (b'g', &record("path"))] {
            let before = Entry { kind, gnu: kind == b'L', ..file(b"././@LongLink", content) };
            let said = attack(&compressed(&tar(&[GRAPH, before, file(b"a", b"1")])), "long name").expect("refused");
            assert!(said.contains("a header") && said.len() < 500, "{said}");
        }
    }
    let mut bytes = tar(&[GRAPH, file(&[b'n'; 100], b"1")]);
    let mut header = Header::new_old();
    header.as_mut_bytes().copy_from_slice(&bytes[1024..1536]);
    header.as_mut_bytes()[345..500].fill(b'p');
    header.set_cksum();
    bytes[1024..1536].copy_from_slice(header.as_bytes());
    let said = attack(&compressed(&bytes), "prefix").expect("refused");
    assert!(said.contains("longer than 200 bytes"), "{said}");
}

#[test]
fn archives_of_many_files_and_those_that_do_not_end_are_refused() {
    let mut bytes = tar(&[GRAPH]);
    bytes.truncate(1024);
    for number in 0..10_100 {
        bytes.extend(header(&file(format!("f{number}").as_bytes(), b"")).as_bytes());
    }
    let more = bytes[bytes.len() - 512..].repeat(100_000);
    bytes.extend(more);
    let said = attack(&compressed(&bytes), "many").expect("refused");
    assert!(said.contains("more than 10000 files"), "{said}");

    let mut bytes = tar(&[GRAPH]);
    bytes.resize(4 << 20, 0);
    let said = attack(&compressed(&bytes), "zeros").expect("refused");
    assert!(said.contains("goes on after its last file"), "{said}");
}

/// Archives with random damage, before and after compression, from a fixed seed.
#[test]
fn damaged_archives_do_no_harm() {
    let plain = tar(&[GRAPH, file(b"lib/ridge.ron", b"( nodes: {} )"), file(b"dem.tif", &[7; 700])]);
    let packed = compressed(&plain);
    let mut state = 7_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let mut refused = 0;
    for case in 0..200 {
        let mut bytes = if case % 2 == 0 { plain.clone() } else { packed.clone() };
        for _ in 0..=random(3) {
            let at = random(bytes.len());
            match random(3) {
                0 => bytes[at] ^= 1 << random(8),
                1 => bytes[at] = random(256) as u8,
                _ => bytes.truncate(at.max(1)),
            }
        }
        if case % 4 == 0 {
            // a right checksum lets a wrong header through to the checks
            for start in (0..bytes.len().saturating_sub(512)).step_by(512) {
                let mut header = Header::new_old();
                header.as_mut_bytes().copy_from_slice(&bytes[start..start + 512]);
                if bytes[start..start + 512].starts_with(b"g.ron") || bytes[start + 257..].starts_with(b"ustar") {
                    header.set_cksum();
                    bytes[start..start + 512].copy_from_slice(header.as_bytes());
                }
            }
        }
        let archive = if case % 2 == 0 { compressed(&bytes) } else { bytes };
        refused += usize::from(attack(&archive, &format!("case {case}")).is_some());
    }
    assert!(refused > 80, "{refused}");
}
