//! `fmt`, and each save of the editor: a graph file is the earlier text or the new one.

use std::fs;

use orograph::{Failure, remedy};
use orograph_graph::{
    Document,
    files::{self, faults::Fault},
    format_source,
};

use crate::{at_each_step, hidden};

const CROOKED: &str = "( nodes:{\"land\":Perlin()},outputs:{\"height\":\"land\"})";

#[test]
fn a_graph_file_is_the_earlier_text_or_the_new_one() {
    let registry = orograph_nodes::registry();
    let canonical = format_source(CROOKED).expect("a graph");
    for fault in Fault::ALL {
        at_each_step(
            fault,
            &|folder| fs::write(folder.join("g.ron"), CROOKED).expect("written"),
            &|folder| {
                let file = folder.join("g.ron");
                let saved = Document::parse_at(canonical.clone(), &file, &registry).save(&file);
                saved.map_err(|error| Failure::unable(error.to_string()).hint(remedy(&error)))
            },
            &|folder, at, ended| {
                let found = fs::read_to_string(folder.join("g.ron")).expect("there");
                assert!(found == canonical || ended.is_err() && found == CROOKED, "{at}: {found}");
                files::settle(folder);
                assert_eq!(hidden(folder), [""; 0], "{at}");
            },
        );
    }
}
