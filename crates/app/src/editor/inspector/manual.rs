//! The manual page of a node, from the Markdown of its declaration.

use egui::{Label, RichText, Ui, text::LayoutJob};
use orograph_graph::Node;

/// Shows the description of a node type, and its sources.
pub(super) fn show(ui: &mut Ui, node: &Node) {
    for block in node.doc.split("\n\n").filter(|block| !block.trim().is_empty()) {
        if let Some(heading) = block.trim_start().strip_prefix('#') {
            ui.strong(heading.trim_start_matches('#').trim());
        } else if block.lines().all(|line| line.starts_with("    ")) || block.starts_with("```") {
            let code: Vec<&str> = block.lines().filter(|line| !line.starts_with("```")).map(str::trim_end).collect();
            let code = code.iter().map(|line| line.strip_prefix("    ").unwrap_or(line)).collect::<Vec<_>>().join("\n");
            ui.add(Label::new(RichText::new(code).monospace()).wrap());
        } else if block.trim_start().starts_with('|') {
            // tables are most readable unformatted
            ui.add(Label::new(RichText::new(block).monospace().small()).extend());
        } else {
            ui.add(Label::new(paragraph(ui, block)).wrap());
        }
        ui.add_space(4.0);
    }
    if !node.sources.is_empty() {
        ui.label(RichText::new("Sources").small().strong());
        for source in node.sources {
            ui.add(Label::new(RichText::new(*source).small()).wrap());
        }
    }
}

/// The style of a piece of a paragraph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Face {
    Plain,
    Strong,
    Code,
}

/// The pieces of a paragraph: `**strong**` and `` `code` `` are styled; lines are joined, except the items of a list.
fn pieces(block: &str) -> Vec<(Face, String)> {
    let mut text = String::new();
    for line in block.lines().map(str::trim_end) {
        let item = line.trim_start();
        let begins = item.starts_with("- ") || item.starts_with("* ");
        if !text.is_empty() {
            text.push(if begins { '\n' } else { ' ' });
        }
        text.push_str(&if begins { format!("• {}", &item[2..]) } else { item.to_owned() });
    }
    let mut pieces = Vec::new();
    for (at, part) in text.split('`').enumerate() {
        if at % 2 == 1 {
            pieces.push((Face::Code, part.to_owned()));
            continue;
        }
        for (at, part) in part.split("**").enumerate() {
            pieces.push((if at % 2 == 1 { Face::Strong } else { Face::Plain }, part.to_owned()));
        }
    }
    pieces.retain(|(_, text)| !text.is_empty());
    pieces
}

fn paragraph(ui: &Ui, block: &str) -> LayoutJob {
    let mut job = LayoutJob::default();
    for (face, text) in pieces(block) {
        let text = RichText::new(text);
        let text = match face {
            Face::Plain => text,
            Face::Strong => text.strong(),
            Face::Code => text.monospace().color(ui.visuals().strong_text_color()),
        };
        text.append_to(&mut job, ui.style(), egui::FontSelection::Default, egui::Align::Center);
    }
    job
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paragraphs_have_three_styles() {
        let found = pieces("**Points** are\npairs of `a` and b.\n- one\n- two");
        let expected = [
            (Face::Strong, "Points"),
            (Face::Plain, " are pairs of "),
            (Face::Code, "a"),
            (Face::Plain, " and b.\n• one\n• two"),
        ];
        assert_eq!(found, expected.map(|(face, text)| (face, text.to_owned())));
    }
}
