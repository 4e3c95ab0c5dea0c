//! Journals of the editor: damaged lines, and damaged entries with correct sums.

use orograph_graph::{Document, Edit, JournalEntry, JournalWriter, Registry, recover};

use super::{Attack, PIECES, Taken, graphs};
use crate::dice::Dice;

struct Journals {
    registry: Registry,
    /// The lines of sound journals.
    sources: Vec<Vec<String>>,
}

pub(super) fn prepare() -> Box<dyn Attack> {
    let registry = orograph_nodes::registry();
    let mut graphs = graphs();
    graphs.sort_by_key(String::len);
    let sources = graphs.iter().take(6).map(|text| journal(text, &registry)).collect();
    Box::new(Journals { registry, sources })
}

/// The journal of some work on a graph.
fn journal(text: &str, registry: &Registry) -> Vec<String> {
    let mut document = Document::parse(text, registry);
    let mut entries = vec![document.start_entry(Some("(format: 1)"))];
    for (at, kind) in ["Perlin", "Blur", "Ridged"].into_iter().enumerate() {
        let edit = Edit::AddNode { name: format!("added{at}"), kind: kind.to_owned(), at: Some([0.0, 1.0]) };
        if document.apply(&edit).is_ok() {
            entries.extend(document.last_edit().map(JournalEntry::Made));
        }
    }
    entries.extend([JournalEntry::Undone, JournalEntry::Redone, document.file_entry(None), JournalEntry::Dropped]);
    let mut writer = JournalWriter::default();
    entries.iter().map(|entry| writer.line(entry).trim_end().to_owned()).collect()
}

impl Attack for Journals {
    fn case(&mut self, dice: &mut Dice) -> Result<Taken, String> {
        let mut lines = dice.pick(&self.sources).clone();
        let keeps_sums = dice.one_in(2);
        if dice.one_in(4) {
            let (a, b) = (dice.number(..lines.len()), dice.number(..lines.len()));
            lines.swap(a, b);
        }
        let at = dice.number(..lines.len());
        lines[at] = dice.damaged_text(&lines[at], &PIECES);
        let journal = if keeps_sums { summed(&lines) } else { lines.join("\n") + "\n" };
        let Ok(recovered) = recover(journal.as_bytes()) else { return Ok(Taken::default()) };
        let mut document = recovered.document(None, &self.registry);
        let text = document.source().to_owned();
        while document.undo() {}
        while document.redo() {}
        if recovered.history.steps() == document.steps() && recovered.text != text {
            return Err("the document has another text than its journal".to_owned());
        }
        Ok(Taken::text(!recovered.torn))
    }
}

/// Lines with the sums of their contents.
fn summed(lines: &[String]) -> String {
    let mut before = blake3::hash(b"orograph journal");
    let mut journal = String::new();
    for line in lines {
        let json = line.split_once(' ').map_or(&line[..], |(_, json)| json);
        before = blake3::Hasher::new().update(before.as_bytes()).update(json.as_bytes()).finalize();
        journal += &format!("{} {json}\n", &before.to_hex()[..16]);
    }
    journal
}
