//! Notes on what changes no output.

use super::*;

#[expect(dead_code, reason = "only the declaration is looked at")]
mod channels {
    use super::*;

    crate::choice! {
        /// A criterion.
        pub enum Heads {
            /// Area.
            Area = "area",
            /// Slope.
            Slope = "slope",
        }
    }

    crate::params! {
        /// Criterion.
        heads: Heads = Heads::Area, One, ..;
        /// Threshold.
        area: f64 = 1e5, SquareMetres, 0.0..=1e15, when heads = "area";
        /// Cohesion.
        cohesion: f64 = 1.0, One, 0.0..=1e8, with mask;
        /// How far.
        wander: f64 = 1.0, One, 0.0..=1e8, unless mask;
    }

    pub(super) static NODE: Node = Node {
        id: "Channels",
        params: Params::specs,
        inputs: &[Input::needs("height", PortType::Height, "H."), Input::mask("mask", "M.")],
        outputs: &[Output::same_as("height", "height", "H."), Output::gives("wet", PortType::Mask, "W.")],
        ..Node::DEFAULT
    };
}

/// The notes on a file with these nodes and this rest, as the text that each marks and its message.
fn notes(nodes: &str, rest: &str) -> Vec<[String; 2]> {
    let source = format!("(nodes: {{ \"a\": Ridged, {nodes} }}, outputs: {{ \"height\": \"c\" }}{rest})");
    let document = Document::parse(source, &Registry::new([&nodes::ridged::NODE, &channels::NODE]));
    assert!(!document.has_errors(), "{:?}", document.problems());
    let marked = |note: &Diagnostic| [document.source()[note.span.clone()].to_owned(), note.message.clone()];
    document.without_effect().iter().map(marked).collect()
}

#[test]
fn a_parameter_that_others_switch_off_is_named() {
    let off = |node: &str| notes(node, "");
    assert!(off(r#""c": Channels(height: "a", area: 3, wander: 2)"#).is_empty());
    assert!(off(r#""c": Channels(height: "a", heads: slope)"#).is_empty(), "defaults are not written");
    let message = "`area` of `c` has no effect: it is used only if `heads` is `area`";
    assert_eq!(off(r#""c": Channels(height: "a", heads: slope, area: 3)"#), [["area", message]]);
    let message = "`cohesion` of `c` has no effect: it is used only if `mask` is wired";
    assert_eq!(off(r#""c": Channels(height: "a", cohesion: 3)"#), [["cohesion", message]]);
    let message = "`wander` of `c` has no effect: it is used only if `mask` is not wired";
    assert_eq!(
        off(r#""m": Channels(height: "a"), "c": Channels(height: "a", wander: 3, mask: "m.wet")"#),
        [["wander", message]]
    );
}

/// What a name of the file may set or wire is open.
#[test]
fn what_the_file_exposes_is_not_named() {
    let node = r#""c": Channels(height: "a", heads: slope, area: 3, cohesion: 2)"#;
    assert_eq!(notes(node, "").len(), 2);
    assert!(notes(node, r#", parameters: { "how": "c.heads" }, inputs: { "where": "c.mask" }"#).is_empty());
}

#[test]
fn the_last_of_nodes_without_an_output_is_named() {
    let needless = notes(r#""c": Ridged, "d": Channels(height: "a"), "e": Channels(height: "d")"#, "");
    assert_eq!(needless, [[r#""e": Channels"#, "no output needs `e` and 2 nodes before it"]]);
    let needless = notes(r#""c": Channels(height: "a"), "e": Channels(height: "a")"#, "");
    assert_eq!(needless, [[r#""e": Channels"#, "no output needs `e`"]]);
    assert!(notes(r#""c": Channels(height: "a")"#, "").is_empty());
}
