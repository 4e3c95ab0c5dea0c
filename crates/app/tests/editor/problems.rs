//! Tests of the Problems pane: a broken file opens as far as possible, and each problem links to its node.

use egui_kittest::kittest::Queryable as _;

use crate::{scratch, window};

#[test]
fn a_broken_file_opens_and_its_problems_link_to_their_nodes() {
    let file = scratch(
        "(\n  world: (cells: 64),\n  nodes: {\n    \"land\": Ridged(wavelength: 900, octaves: 99),\n    \"odd\": Perlni(),\n  },\n  \
         outputs: { \"h\": \"land\" },\n)\n",
    );
    let mut window = window(Some(file.path().join("graph.ron")));
    window.run_steps(3);
    window.get_by_label("Problems (2)").click();
    window.run_steps(3);
    assert!(window.query_by_label("unknown node `Perlni`").is_some());
    assert!(window.query_by_label("did you mean `Perlin`?").is_some());
    window.get_by_label("line 4, go to land").click();
    window.run_steps(3);
    assert_eq!(window.state().session().selected(), Some("land"));
    window.get_by_label("odd: Perlni").click();
    window.run_steps(3);
    assert_eq!(window.state().session().selected(), Some("odd"));
    // the inspector shows the information that is known about it, and can remove it
    window.get_by_label("Inspector").click();
    window.run_steps(3);
    assert!(window.query_by_label("Perlni cannot be used").is_some());
    window.get_by_label("Remove it").click();
    window.run_steps(3);
    assert!(!window.state().session().document().source().contains("Perlni"));
}
