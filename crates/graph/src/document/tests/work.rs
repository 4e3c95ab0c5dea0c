//! Muted nodes, frames, journals, and merging.

use proptest::prelude::*;

use super::*;
use crate::{JournalEntry, JournalError, JournalWriter, ParamValue, Port, Recovered, Srgb, recover};

const CHAIN: &str = r#"(
    nodes: {
        "base":   Ridged(octaves: 3),
        "rivers": StreamPower(height: "base"), // cut
        "scree":  Thermal(version: 3, height: "rivers"),
        "late":   StreamPower(height: "scree", mask: 0.5),
    },
    outputs: { "height": "late" },
    layout: { "base": (0, 0) },
)
"#;

fn mute(node: &str, muted: bool) -> Edit {
    Edit::SetMuted { node: node.into(), muted }
}

fn octaves(count: i64) -> Edit {
    Edit::SetParam { node: "base".into(), param: "octaves".into(), value: ParamValue::Int(count) }
}

/// The source of an input in the built graph.
fn into(document: &Document, node: &str, input: usize) -> Option<String> {
    let graph = document.expand().graph;
    graph.source(graph.find(node).expect("built"), input).map(|port| graph.port_name(port))
}

#[test]
fn the_text_of_every_step_is_known_wherever_the_history_stands() {
    let mut document = parse(CHAIN);
    let mut texts = vec![document.source().to_owned()];
    for count in 4..9 {
        document.apply(&octaves(count)).expect("an edit");
        texts.push(document.source().to_owned());
    }
    for undone in 0..=5 {
        let found: Vec<Option<String>> = (0..=6).map(|step| document.text_at(step)).collect();
        let expected: Vec<Option<String>> = texts.iter().cloned().map(Some).chain([None]).collect();
        assert_eq!(found, expected, "{undone} steps are undone");
        assert_eq!((document.steps(), document.all_steps()), (5 - undone, 5));
        document.undo();
    }
}

#[test]
fn a_muted_node_passes_its_wire_on() {
    let mut document = parse(CHAIN);
    document.apply(&mute("scree", true)).expect("muted");
    assert!(document.source().contains("    muted: [\"scree\"],\n)"), "{}", document.source());
    assert_eq!(document.problems(), []);
    assert_eq!(into(&document, "late", 0).as_deref(), Some("rivers.height"));
    assert!(document.expand().graph.find("scree").is_err());
    let scree = document.graph().find("scree").expect("there");
    assert!(document.is_muted(scree) && document.nodes()[2].muted);
    assert_eq!(document.passed_input(scree), Some(0));
    // The output of a muted node maps to the source of its wire.
    let port = document.expand().port(Port { node: scree, output: 0 }).expect("passed");
    assert_eq!(document.expand().graph.port_name(port), "rivers.height");

    document.apply(&mute("rivers", true)).expect("muted");
    assert!(document.source().contains("muted: [\"scree\", \"rivers\"],"));
    assert_eq!(into(&document, "late", 0).as_deref(), Some("base.height"));
    document.apply(&mute("late", true)).expect("muted");
    let expanded = document.expand();
    assert_eq!(expanded.graph.port_name(expanded.outputs[0].port), "base.height");
    for node in ["scree", "late", "rivers"] {
        document.apply(&mute(node, false)).expect("as before");
    }
    assert_eq!(document.source(), CHAIN, "nothing of it is left");
    (0..6).for_each(|_| assert!(document.undo()));
    assert_eq!(document.source(), CHAIN);
}

#[test]
fn muted_nodes_that_pass_nothing_on_are_reported() {
    let mut document = parse(CHAIN);
    let error = document.apply(&mute("base", true)).expect_err("a source").to_string();
    assert!(
        error.contains("`base` is muted and passes nothing on as `height`, which `rivers.height` needs"),
        "{error}"
    );
    let wired = CHAIN
        .replace("outputs: { \"height\": \"late\" }", "outputs: { \"height\": \"late\", \"area\": \"rivers.area\" }");
    let mut document = parse(&wired);
    let error = document.apply(&mute("rivers", true)).expect_err("an area is written").to_string();
    assert!(error.contains("passes nothing on as `area`, which the output `area` needs"), "{error}");
    // If the node already lacks its wire, that is the only problem.
    let broken = CHAIN
        .replace("Thermal(version: 3, height: \"rivers\")", "Thermal(version: 3)")
        .replace("layout", "muted: [\"scree\"], layout");
    let codes: Vec<&str> = parse(&broken).problems().iter().map(|problem| problem.code).collect();
    assert_eq!(codes, ["unwired"]);
}

#[test]
fn names_in_muted_follow_their_nodes() {
    let source = CHAIN.replace("layout", "muted: [\"scree\"], layout");
    let mut document = parse(&source);
    document.apply(&Edit::RenameNode { from: "scree".into(), to: "stones".into() }).expect("renamed");
    assert!(document.source().contains("muted: [\"stones\"]"));
    assert!(document.nodes()[2].muted);
    document.undo();
    document
        .apply(&Edit::All(vec![
            Edit::Connect { from: "rivers".into(), to: "late".into(), input: "height".into() },
            Edit::RemoveNode { name: "scree".into() },
        ]))
        .expect("removed");
    assert!(!document.source().contains("muted"), "{}", document.source());
    let problem = |muted: &str| {
        let document = parse(&CHAIN.replace("layout", &format!("muted: {muted}, layout")));
        let problem = document.problems().first().cloned().expect("a problem");
        format!("{}; {}", problem.message, problem.hint.unwrap_or_default())
    };
    assert!(problem("[\"scre\"]").contains("no such node; did you mean `scree`"), "{}", problem("[\"scre\"]"));
    assert!(problem("[\"scree\", \"scree\"]").contains("twice"));
    assert!(problem("[scree]").contains("takes a list of nodes"));
    assert!(problem("\"scree\"").contains("takes a list of nodes"));
}

#[test]
fn muting_is_listed_among_differences() {
    let (plain, muted) = (parse(CHAIN), parse(&CHAIN.replace("layout", "muted: [\"scree\"], layout")));
    assert_eq!(diff(&plain, &muted), ["node scree muted"]);
    assert_eq!(diff(&muted, &plain), ["node scree no longer muted"]);
    let formatted = format_source(muted.source()).expect("sound");
    assert!(formatted.contains("\n    muted: [\"scree\"],\n"), "{formatted}");
}

#[test]
fn frames_are_read_and_edited() {
    let frame = |note: &str, colour| Frame { at: [-20.0, 10.5], size: [400.0, 300.0], note: note.into(), colour };
    let set = |name: &str, frame| Edit::SetFrame { name: name.into(), frame };
    let mut document = parse(CHAIN);
    document.apply(&set("Old rivers", Some(frame("from the \"base\"", None)))).expect("framed");
    let line = r#"frames: {"#;
    assert!(document.source().contains(line), "{}", document.source());
    assert!(
        document.source().contains(r#""Old rivers": (at: (-20, 10.5), size: (400, 300), note: "from the \"base\"")"#)
    );
    assert_eq!(document.frames()[0].frame, frame("from the \"base\"", None));
    assert_eq!(diff(&parse(CHAIN), &document), [""; 0], "frames change nothing");
    let tint = Some(Srgb::hex(0x7a_9e_77));
    document.apply(&set("Old rivers", Some(frame("", tint)))).expect("changed");
    assert!(document.source().contains(r##"(at: (-20, 10.5), size: (400, 300), colour: "#7a9e77")"##));
    document.apply(&Edit::RenameFrame { from: "Old rivers".into(), to: "Rivers".into() }).expect("renamed");
    assert_eq!((document.frames()[0].name.as_str(), document.frames()[0].frame.colour), ("Rivers", tint));
    let wrong = document.apply(&set("x", Some(Frame { size: [0.0, 1.0], ..frame("", None) }))).expect_err("no width");
    assert!(wrong.to_string().contains("above 0"), "{wrong}");
    assert!(document.apply(&set("x", None)).is_err_and(|error| error.to_string().contains("no frame `x`")));
    document.apply(&set("Rivers", None)).expect("gone");
    assert_eq!(document.source(), CHAIN);
    for (text, said) in [
        ("(at: (0, 0))", "needs `at` and `size`"),
        ("(at: 0, size: (1, 1))", "a pair of numbers"),
        ("(at: (0, 0), size: (1, 1), tint: 1)", "no field `tint`"),
        ("(at: (0, 0), size: (1, 1), colour: \"red\")", "a colour such as"),
        ("7", "a frame such as"),
    ] {
        let document = parse(&CHAIN.replace("layout", &format!("frames: {{ \"f\": {text} }}, layout")));
        assert!(document.problems()[0].message.contains(said), "{text}: {:?}", document.problems());
    }
}

#[test]
fn notes_and_routes_of_wires_are_read_and_edited() {
    let note = |node: &str, note: &str| Edit::SetNote { node: node.into(), note: note.into() };
    let route = |node: &str, places: &[[f64; 2]]| Edit::SetReroutes {
        node: node.into(),
        input: "height".into(),
        places: places.to_vec(),
    };
    let mut document = parse(CHAIN);
    document.apply(&note("scree", "how \"loose\"?")).expect("told");
    document.apply(&route("scree", &[[120.0, 40.5], [-8.0, 1e4]])).expect("led");
    let source = document.source().to_owned();
    assert!(
        source.contains(r#"notes: { "scree": "how \"loose\"?" }"#) || source.contains(r#""scree": "how \"loose\"?""#),
        "{source}"
    );
    assert!(source.contains(r#""scree.height": [(120, 40.5), (-8, 10000)]"#), "{source}");
    assert!(document.problems().is_empty(), "{:?}", document.problems());
    let told = |document: &Document| {
        let notes = document.nodes().iter().filter(|entry| !entry.note.is_empty());
        notes.map(|entry| (entry.name.clone(), entry.note.clone())).collect::<Vec<_>>()
    };
    assert_eq!(told(&document), [("scree".to_owned(), "how \"loose\"?".to_owned())]);
    assert_eq!(document.reroutes()[0].places, [[120.0, 40.5], [-8.0, 1e4]]);
    assert_eq!(diff(&parse(CHAIN), &document), [""; 0], "they change nothing");
    let formatted = format_source(&source).expect("sound");
    assert_eq!(format_source(&formatted).as_ref(), Ok(&formatted));
    assert_eq!(parse(&formatted).reroutes(), document.reroutes());

    document.apply(&Edit::RenameNode { from: "scree".into(), to: "talus".into() }).expect("renamed");
    assert_eq!((told(&document)[0].0.as_str(), document.reroutes()[0].node.as_str()), ("talus", "talus"));
    document.apply(&Edit::Disconnect { node: "talus".into(), input: "height".into() }).expect("cut");
    assert_eq!(document.reroutes(), []);
    assert!(document.undo() && document.reroutes().len() == 1);
    document.apply(&Edit::RemoveNode { name: "talus".into() }).expect("removed");
    assert!(!document.source().contains("notes") && !document.source().contains("reroutes"), "{}", document.source());
    assert!(document.undo() && document.undo());
    assert_eq!(document.source(), source);
    document.apply(&note("scree", "")).expect("not told");
    document.apply(&route("scree", &[])).expect("straight");
    assert_eq!(document.source(), CHAIN);
    for (text, said) in [
        ("notes: { \"scre\": \"\" }", "`notes` has a note for `scre`, but there is no such node"),
        ("notes: { \"scree\": 7 }", "a text in quotes"),
        ("reroutes: { \"scre.height\": [(0, 0)] }", "there is no node `scre`"),
        ("reroutes: { \"scree.hight\": [(0, 0)] }", "`scree` has no input `hight`"),
        ("reroutes: { \"scree.height\": [] }", "a list of places"),
        ("reroutes: { \"scree.height\": [(0, NaN)] }", "a list of places"),
        ("reroutes: { \"scree.height\": (0, 0) }", "a list of places"),
    ] {
        let document = parse(&CHAIN.replace("layout", &format!("{text}, layout")));
        assert!(document.problems()[0].message.contains(said), "{text}: {:?}", document.problems());
    }
}

/// A document, and the journal of its changes.
struct Work {
    document: Document,
    saved: String,
    writer: JournalWriter,
    journal: String,
}

impl Work {
    fn new() -> Self {
        let document = parse(CHAIN);
        let mut writer = JournalWriter::default();
        let journal = writer.line(&document.start_entry(Some(CHAIN)));
        Self { document, saved: CHAIN.to_owned(), writer, journal }
    }

    fn write(&mut self, entry: &JournalEntry) {
        self.journal += &self.writer.line(entry);
    }

    /// One of several actions.
    fn step(&mut self, what: u8, number: i64) {
        let before = self.document.steps();
        match what % 6 {
            0 | 1 => {
                self.document.apply(&octaves(number)).expect("in range");
                if self.document.steps() > before {
                    self.write(&JournalEntry::Made(self.document.last_edit().expect("made")));
                }
            }
            2 if before > 0 => {
                self.document.amend(&octaves(number)).expect("in range");
                let entry = if self.document.steps() == before {
                    JournalEntry::Amended(self.document.last_edit().expect("made"))
                } else {
                    JournalEntry::Dropped
                };
                self.write(&entry);
            }
            3 if self.document.undo() => self.write(&JournalEntry::Undone),
            4 if self.document.redo() => self.write(&JournalEntry::Redone),
            5 => {
                self.saved = self.document.source().to_owned();
                self.write(&self.document.file_entry(Some(&self.saved)));
            }
            _ => {}
        }
    }
}

/// All texts reached by undo, and all reached by redo.
fn ways(document: &Document) -> [Vec<String>; 2] {
    let (mut back, mut forth) = (document.clone(), document.clone());
    let texts = |document: &mut Document, step: fn(&mut Document) -> bool| {
        let mut texts = Vec::new();
        while step(document) {
            texts.push(document.source().to_owned());
        }
        texts
    };
    [texts(&mut back, Document::undo), texts(&mut forth, Document::redo)]
}

fn same(recovered: &Recovered, work: &Work) {
    assert_eq!(recovered.text, work.document.source());
    assert_eq!(recovered.saved.as_ref(), Some(&work.saved));
    assert_eq!(ways(&recovered.document(None, &registry())), ways(&work.document));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_journal_restores_the_work_with_its_history(steps in prop::collection::vec((any::<u8>(), 1_i64..24), 0..40)) {
        let mut work = Work::new();
        let mut lengths = vec![(work.journal.len(), work.document.source().to_owned())];
        for (what, number) in steps {
            work.step(what, number);
            lengths.push((work.journal.len(), work.document.source().to_owned()));
        }
        let recovered = recover(work.journal.as_bytes()).expect("whole");
        prop_assert!(!recovered.torn);
        prop_assert_eq!(recovered.read, work.journal.len());
        prop_assert_eq!(recovered.has_work(), work.saved != work.document.source());
        same(&recovered, &work);
        // Writing continues where it ended.
        let mut more = recovered.writer;
        prop_assert_eq!(more.line(&JournalEntry::Undone), work.writer.clone().line(&JournalEntry::Undone));
        // Torn anywhere, it restores the complete entries.
        for cut in 0..work.journal.len() {
            match recover(&work.journal.as_bytes()[..cut]) {
                Ok(recovered) => {
                    let expected = lengths.iter().rev().find(|(length, _)| *length <= cut).map(|(_, text)| text);
                    prop_assert_eq!(Some(&recovered.text), expected);
                    prop_assert_eq!(recovered.torn, recovered.read < cut);
                }
                Err(error) => {
                    prop_assert_eq!(error, JournalError::Nothing);
                    prop_assert!(cut < lengths[0].0);
                }
            }
        }
    }

    #[test]
    fn a_journal_that_was_changed_is_read_up_to_there(at in any::<prop::sample::Index>(), byte in any::<u8>()) {
        let mut work = Work::new();
        (0..12).for_each(|n| work.step(n, i64::from(n) + 1));
        let mut bytes = work.journal.into_bytes();
        let at = at.index(bytes.len());
        let changed = bytes[at] != byte;
        bytes[at] = byte;
        if let Ok(recovered) = recover(&bytes) {
            prop_assert_eq!(recovered.torn, changed);
            prop_assert!(recovered.read <= at || !changed);
        }
    }

    #[test]
    fn any_bytes_are_no_journal(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        prop_assert_eq!(recover(&bytes).err(), Some(JournalError::Nothing));
    }
}

#[test]
fn entries_that_do_not_fit_are_not_replayed() {
    let entry = |json: &str| serde_json::from_str::<JournalEntry>(json).expect("an entry");
    let mut work = Work::new();
    work.step(0, 5);
    let good = (work.journal.clone(), work.writer.clone());
    for bad in [
        r#"{"made":[{"at":18446744073709551615,"removed":"x","inserted":"y"}]}"#,
        r#"{"made":[{"at":0,"removed":"","inserted":"("},{"at":0,"removed":"no","inserted":"y"}]}"#,
        r#"{"amended":[{"at":3,"removed":"no","inserted":""}]}"#,
        r#"{"file":{"other":{"at":9999999,"removed":"","inserted":"y"}}}"#,
        r#""redone""#,
    ] {
        (work.journal, work.writer) = good.clone();
        work.write(&entry(bad));
        work.write(&JournalEntry::Undone);
        let recovered = recover(work.journal.as_bytes()).expect("begins well");
        assert!(recovered.torn && recovered.read == good.0.len(), "{bad}");
        same(&recovered, &work);
    }
    let starts = |json: &str| recover(JournalWriter::default().line(&entry(json)).as_bytes()).err();
    let history = r#"{"done":[[{"at":0,"removed":"b","inserted":"x"}]],"undone":[]}"#;
    let start = |format: u32| {
        format!(r#"{{"start":{{"format":{format},"path":null,"file":"nothing","text":"abc","history":{history}}}}}"#)
    };
    assert_eq!(starts(&start(1)), Some(JournalError::Nothing), "the history is of another text");
    assert_eq!(starts(&start(2)), Some(JournalError::Newer(2)));
    assert_eq!(starts(r#""undone""#), Some(JournalError::Nothing));
}

#[test]
fn a_copy_finds_its_files_after_a_crash() {
    let folder = std::path::absolute("some/folder").expect("there is a present folder");
    let read = |document: &Document| {
        let journal = JournalWriter::default().line(&document.start_entry(None));
        recover(journal.as_bytes()).expect("whole")
    };
    let copy = Document::parse_in(CHAIN, "some/folder", &registry());
    assert_eq!(read(&copy).document(None, &registry()).folder(), folder, "wherever the program is started next");
    let file = Document::parse_at(CHAIN, "other/a.ron", &registry());
    assert_eq!(read(&file).folder, None);
    assert_eq!(read(&file).document(file.path(), &registry()).folder(), Path::new("other"));
}

fn merged(mine: &str, theirs: &str) -> Result<String, Vec<String>> {
    parse(mine).merge(CHAIN, theirs)
}

#[test]
fn changes_of_different_items_are_merged() {
    let theirs = CHAIN.replace("// cut", "// cut deep").replace("mask: 0.5", "mask: 0.7");
    let mine = CHAIN.replace("octaves: 3", "octaves: 5");
    assert_eq!(merged(&mine, &theirs), Ok(theirs.replace("octaves: 3", "octaves: 5")));
    // Several parameters of one node, too.
    let mine = CHAIN.replace("height: \"scree\", ", "height: \"scree\", duration: 2e6, ");
    assert_eq!(merged(&mine, &theirs), Ok(theirs.replace("mask: 0.7", "mask: 0.7, duration: 2e6")));
    // Nodes are added and removed together with their wires.
    let mut work = parse(CHAIN);
    work.apply(&Edit::All(vec![
        Edit::Connect { from: "rivers".into(), to: "late".into(), input: "height".into() },
        Edit::RemoveNode { name: "scree".into() },
        Edit::AddNode { name: "plain".into(), kind: "Ridged".into(), at: Some([5.0, 6.0]) },
        mute("late", true),
    ]))
    .expect("made");
    let both = work.merge(CHAIN, &theirs).expect("clean");
    let both = parse(&both);
    assert_eq!(both.problems(), []);
    assert_eq!(diff(&work, &both), ["late.mask 0.5 → 0.7"]);
    assert!(both.source().contains("// cut deep") && both.source().contains("\"plain\": (5, 6)"), "{}", both.source());
    // The same change is not a conflict, and merging nothing changes nothing.
    assert_eq!(merged(&theirs, &theirs), Ok(theirs.clone()));
    assert_eq!(merged(CHAIN, &theirs), Ok(theirs.clone()));
    assert_eq!(merged(&theirs, CHAIN), Ok(CHAIN.replace("mask: 0.5", "mask: 0.7")), "comments are theirs");
}

#[test]
fn changes_of_one_item_are_conflicts() {
    let octaves = |count: &str| CHAIN.replace("octaves: 3", &format!("octaves: {count}"));
    assert_eq!(merged(&octaves("5"), &octaves("6")), Err(vec!["base.octaves".to_owned()]));
    let kind = CHAIN.replace("Thermal(version: 3, height: \"rivers\")", "StreamPower(height: \"rivers\")");
    let talus = CHAIN.replace("height: \"rivers\")", "height: \"rivers\", talus: 40)");
    assert_eq!(merged(&kind, &talus), Err(vec!["scree".to_owned()]));
    // The position of a node is never a conflict.
    let moved = |place: &str| CHAIN.replace("(0, 0)", place);
    assert_eq!(merged(&moved("(1, 1)"), &moved("(2, 2)")), Ok(moved("(1, 1)")));
    // Changes that can be merged as text may conflict as a graph.
    let mut gone = parse(CHAIN);
    gone.apply(&Edit::All(vec![
        Edit::Connect { from: "rivers".into(), to: "late".into(), input: "height".into() },
        Edit::RemoveNode { name: "scree".into() },
    ]))
    .expect("removed");
    let reads = CHAIN.replace("\"height\": \"late\"", "\"height\": \"late\", \"stones\": \"scree\"");
    let why = gone.merge(CHAIN, &reads).expect_err("it is gone");
    assert!(why[0].contains("no node `scree`"), "{why:?}");
    assert!(merged("(nodes: {", CHAIN).expect_err("broken")[0].contains("has syntax errors"));
}

proptest! {
    #[test]
    fn any_text_is_replaced_in_one_step(old in "[ab\u{e9}\n]{0,12}", new in "[ab\u{e9}\n]{0,12}") {
        let mut document = parse(&old);
        prop_assert_eq!(document.replace(&new), old != new);
        prop_assert_eq!(document.source(), &new);
        prop_assert_eq!(document.undo(), old != new);
        prop_assert_eq!(document.source(), &old);
    }
}
