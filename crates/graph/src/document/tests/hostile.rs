//! Files made to take much time or memory, or to show what is in others.

use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use super::*;

fn write(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("written");
    path
}

/// A graph file that uses others.
fn uses(files: &[String]) -> String {
    let node = |(at, file): (usize, &String)| format!("\"n{at}\": Subgraph(file: \"{file}\"), ");
    let nodes: String = files.iter().enumerate().map(node).collect();
    format!("(nodes: {{ {nodes} }}, outputs: {{ \"o\": \"n0\" }})")
}

/// The first problem of the innermost file with errors, and its hint.
fn innermost(document: &Document) -> [String; 2] {
    let mut document = Arc::new(document.clone());
    while let Some(next) =
        document.uses().iter().find_map(|used| used.document.clone().filter(|inner| inner.has_errors()))
    {
        document = next;
    }
    let problem = document.problems().first().cloned().expect("a problem");
    [problem.message, problem.hint.unwrap_or_default()]
}

/// Much longer than any of this takes on a busy machine, much shorter than the forever that it guards against.
const PATIENCE: Duration = Duration::from_secs(60);

#[expect(clippy::disallowed_methods, reason = "measures the time")]
fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed())
}

/// Fifteen files, each of which uses the next ten times: 10^14 nodes.
#[test]
fn files_that_multiply_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "14.ron", "(nodes: { \"n0\": Ridged }, outputs: { \"o\": \"n0\" })");
    for level in (0..14).rev() {
        write(folder.path(), &format!("{level}.ron"), &uses(&vec![format!("{}.ron", level + 1); 10]));
    }
    let (document, took) = timed(|| {
        let document = Document::load(folder.path().join("0.ron"), &registry()).expect("readable");
        assert_eq!(document.files().len(), 14);
        assert_eq!(document.expand().graph.indices().count(), 0);
        document
    });
    assert!(took < PATIENCE, "{took:?}");
    assert_eq!(document.statistics().files_parsed, 14);
    let [message, hint] = innermost(&document);
    let said = "with the files that it uses, the graph has 211110 nodes, but a graph can have at most 100000 nodes";
    assert_eq!(message, said);
    assert!(hint.ends_with("10.ron` has 21110 nodes and is used 10 times; use it less often"), "{hint}");

    let (document, took) = timed(|| Document::load(folder.path().join("9.ron"), &registry()).expect("readable"));
    assert_eq!(innermost(&document)[0], said);
    assert!(took < PATIENCE, "{took:?}");
    let document = Document::load(folder.path().join("10.ron"), &registry()).expect("readable");
    assert_eq!(document.problems(), []);
    let (count, took) = timed(|| document.expand().graph.indices().count());
    assert_eq!(count, 1, "equal nodes are added once");
    assert!(took < PATIENCE, "{took:?}");
}

/// A file that was read at a shallow place counts with its whole depth at a deeper one.
#[test]
fn files_that_are_nested_too_deep_by_several_ways_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "a0.ron", "(nodes: { \"n0\": Ridged }, outputs: { \"o\": \"n0\" })");
    for (chain, below) in [('a', "a0.ron"), ('b', "a12.ron")] {
        for level in 1..=12 {
            let inner = if level == 1 { below.to_owned() } else { format!("{chain}{}.ron", level - 1) };
            write(folder.path(), &format!("{chain}{level}.ron"), &uses(&[inner]));
        }
    }
    let both = write(folder.path(), "both.ron", &uses(&["a12.ron".into(), "b12.ron".into()]));
    let document = Document::load(both, &registry()).expect("readable");
    assert_eq!(innermost(&document)[0], "graph files are nested more than 16 deep");
    let one = Document::load(folder.path().join("a12.ron"), &registry()).expect("readable");
    assert_eq!(one.problems(), []);
}

/// What is not a graph is neither read into a document, whose lines would be quoted, nor waited for.
#[test]
fn other_files_are_not_read_as_graphs() {
    let folder = tempfile::tempdir().expect("a folder");
    let secret = write(folder.path(), "secret", "root:hash\n");
    write(folder.path(), "list.ron", "[1, 2]");
    write(folder.path(), "scene.ron", "(resources: {}, password: \"hash\")");
    write(folder.path(), "text.ron", "root:hash\n");
    let mut wrong = vec![
        ("secret", "is not a graph file: the name does not end with `.ron`"),
        ("list.ron", "list.ron` is not a graph file"),
        ("scene.ron", "scene.ron` is not a graph file"),
        ("text.ron", "text.ron` is not a graph file"),
        ("/dev/zero", "is not a graph file"),
    ];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&secret, folder.path().join("link.ron")).expect("linked");
        let pipe = folder.path().join("pipe.ron");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
        wrong.extend([("link.ron", "secret` is not a graph file"), ("pipe.ron", "is not a regular file but a pipe")]);
        assert!(matches!(Document::load(&pipe, &registry()), Err(LoadError::Irregular(_))));
    }
    assert!(secret.is_file());
    for (name, said) in wrong {
        let outer = write(folder.path(), "outer.ron", &uses(&[name.to_owned()]));
        let document = Document::load(outer, &registry()).expect("readable");
        let problem = &document.problems()[0];
        assert!(problem.message.contains(said), "{name}: {}", problem.message);
        assert!(document.uses()[0].document.is_none(), "{name}");
        assert!(!format!("{:?}", document.problems()).contains("hash"), "{name}");
    }
    #[cfg(unix)]
    {
        let source = "(nodes: { \"a\": Ridged(file: \"pipe.ron\") }, outputs: { \"o\": \"a\" })";
        let document = Document::parse_at(source, folder.path().join("outer.ron"), &registry());
        assert!(document.problems()[0].message.contains("but that is a pipe"), "{:?}", document.problems());
    }
}

/// A file of a megabyte that is used 300 times, and a name that would be put before many others.
#[test]
fn files_whose_text_multiplies_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let comment = "x".repeat(1 << 20);
    write(
        folder.path(),
        "big.ron",
        &format!("/* {comment} */ (nodes: {{ \"a\": Ridged }}, outputs: {{ \"o\": \"a\" }})"),
    );
    let document = |uses: &str| Document::parse_at(uses, folder.path().join("g.ron"), &registry());
    let [message, hint] = innermost(&document(&uses(&vec!["big.ron".to_owned(); 300])));
    assert_eq!(
        message,
        "with the files that it uses, the graph has 300.0 MiB of text, but a graph can have at most 256.0 MiB of text"
    );
    assert!(hint.ends_with("big.ron` has 1.0 MiB of text and is used 300 times; use it less often"), "{hint}");
    assert_eq!(document(&uses(&vec!["big.ron".to_owned(); 200])).problems(), []);

    let long = "n".repeat(201);
    let named = document(&uses(&["big.ron".into()]).replace("n0", &long));
    assert_eq!(named.problems()[0].message, "the name of a node has 201 bytes, but it can have at most 200");
    assert_eq!(named.graph().indices().count(), 0);
}

#[test]
fn a_file_that_exposes_too_much_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let outputs: String = (0..=1000).map(|at| format!("\"o{at}\": \"a\", ")).collect();
    write(folder.path(), "inner.ron", &format!("(nodes: {{ \"a\": Ridged }}, outputs: {{ {outputs} }})"));
    let document = Document::parse_at(uses(&["inner.ron".into()]), folder.path().join("g.ron"), &registry());
    assert!(document.problems()[0].message.contains("has 1001 inputs, parameters and outputs"));
}

/// Texts of two sizes with as many mistakes as fit into them: the best of three times, as other programs run as well.
#[test]
fn the_time_of_a_check_grows_with_the_text() {
    let kinds: [fn(usize) -> String; 7] = [
        |at| format!("\"n{at}\":Wrong(),"),
        |at| format!("\"n{at}\":Ridged(octavse:{at}),"),
        |at| format!("\"n{at}\":StreamPower(height:\"m{at}\"),"),
        |at| format!("\"n{at}\":StreamPower(height:\"n{}\"),", at ^ 1),
        |_| "#a".to_owned(),
        |_| "\"a\":".to_owned(),
        |at| format!("\"n{at}\":Ridged(),").replace("Ridged", if at == 0 { "Ridged(x0:1" } else { "x" }),
    ];
    for (at, kind) in kinds.iter().enumerate() {
        let made = |count: usize| {
            let nodes: String = (0..count).map(kind).collect();
            format!("(nodes: {{ {nodes} }}, outputs: {{ \"o\": \"n0\" }})")
        };
        let time = |count: usize| {
            let source = made(count);
            let times = [(); 3].map(|()| {
                let (document, took) = timed(|| parse(&source));
                assert!(document.problems().len() <= 202, "{at}: {} problems", document.problems().len());
                assert!(document.has_errors(), "{at}");
                took
            });
            times.into_iter().min().expect("three")
        };
        let (small, large) = (time(2_000), time(16_000));
        println!("kind {at}: {small:?}, {large:?}");
        assert!(large < small * 32 + Duration::from_millis(100), "kind {at}: {small:?}, eight times as much {large:?}");
    }
}

#[test]
fn a_graph_of_too_many_nodes_is_refused() {
    let nodes: String = (0..100_001).map(|at| format!("\"n{at}\":W,")).collect();
    let document = parse(&format!("(nodes:{{{nodes}}},outputs:{{\"o\":\"n0\"}})"));
    let message = &document.problems()[0].message;
    assert_eq!(message, "the file has 100001 nodes, but a graph can have at most 100000");
    assert_eq!(document.nodes().len(), 100_000);
    assert_eq!(document.problems().len(), 101);
    assert_eq!(document.problems()[100].message, "99901 more problems are not listed");
}

/// With more errors than are listed, one that comes into the list does not count as new.
#[test]
fn a_file_with_many_errors_can_be_edited() {
    let nodes: String = (0..150).map(|at| format!("\"n{at}\": Wrong(), ")).collect();
    let mut document = parse(&format!("(nodes: {{ {nodes} \"a\": Ridged() }}, outputs: {{ \"o\": \"a\" }})"));
    assert_eq!(
        document.problems().last().map(|problem| problem.message.as_str()),
        Some("50 more problems are not listed")
    );
    document.apply(&Edit::RemoveNode { name: "n3".into() }).expect("removed");
    assert_eq!(
        document.problems().last().map(|problem| problem.message.as_str()),
        Some("49 more problems are not listed")
    );
    let warnings: String = (0..150).map(|at| format!("\"n{at}\": (0, 0), ")).collect();
    let document =
        parse(&format!("(nodes: {{ \"a\": Ridged }}, outputs: {{ \"o\": \"a\" }}, layout: {{ {warnings} }})"));
    assert_eq!(document.problems().len(), 101);
    assert!(!document.has_errors());
}
