//! Graph files made from selected nodes, and a `Subgraph` replaced by the nodes of its file.

use std::{collections::BTreeMap, path::Path};

use orograph_graph::{Edit, Extract, files, fresh_name};

use super::Session;
use crate::report::failure::reason;

impl Session {
    /// A name for the graph file of the selected nodes that no file in the folder has, without its ending: after the
    /// selected node that comes last.
    #[must_use]
    pub fn subgraph_name(&self) -> String {
        let graph = self.document.graph();
        let last = graph.topological().into_iter().rev().map(|node| &graph.instance(node).name);
        let stem = last.into_iter().find(|name| self.is_selected(name)).map_or("part", String::as_str);
        fresh_name(stem, |name| self.document.folder().join(format!("{name}.ron")).exists())
    }

    /// Moves the selected nodes into a new graph file in the folder of the document, and puts a `Subgraph` in their
    /// place, as one undo step. `before` are edits that belong to the same step; `places` are the positions of the
    /// nodes, and `at` is that of the `Subgraph`. Returns its name.
    ///
    /// # Errors
    /// The reason, when there is such a file already, it cannot be written, or the nodes cannot be moved.
    pub fn make_subgraph(
        &mut self,
        name: &str,
        before: Vec<Edit>,
        places: BTreeMap<String, [f64; 2]>,
        at: [f64; 2],
    ) -> Result<String, String> {
        let name = name.trim();
        let is_graph = Path::new(name).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("ron"));
        let stem = if is_graph { &name[..name.len() - ".ron".len()] } else { name };
        let plain = Path::new(stem).file_name().is_some_and(|file| file == stem) && !stem.contains(['/', '\\']);
        if !plain {
            return Err(format!("`{name}` is not the name of a file"));
        }
        let node = self.free_name(stem);
        let nodes = self.selection.clone();
        let what = Extract { nodes, file: format!("{stem}.ron"), name: node.clone(), at: Some(at), places };
        let made = self.document.extract(&what).map_err(|error| error.to_string())?;
        let path = made.file.path().map(Path::to_owned).unwrap_or_default();
        if path.symlink_metadata().is_ok() {
            return Err(format!("`{}` already exists; choose another name", what.file));
        }
        made.file.save(&path).map_err(|error| format!("`{}` was not written: {}", path.display(), reason(&error)))?;
        let edit = Edit::All(before.into_iter().chain([made.edit]).collect());
        if let Err(reason) = self.attempt(&edit) {
            // The file is not used, and a leftover does no harm.
            let _ = files::remove_file(&path);
            return Err(reason);
        }
        self.select_only(&node);
        Ok(node)
    }

    /// Replaces a `Subgraph` with the nodes of its file, as one undo step, and selects them. `before` are edits that
    /// belong to the same step; `places` are the positions of the nodes, by their names in the file.
    ///
    /// # Errors
    /// The reason, when it cannot be replaced.
    pub fn inline_subgraph(
        &mut self,
        node: &str,
        before: Vec<Edit>,
        places: &BTreeMap<String, [f64; 2]>,
    ) -> Result<(), String> {
        let inlined = self.document.inline(node, places).map_err(|error| error.to_string())?;
        self.attempt(&Edit::All(before.into_iter().chain([inlined.edit]).collect()))?;
        self.select(inlined.names);
        Ok(())
    }

    /// An unused name of a node that resembles the name of a file.
    fn free_name(&self, stem: &str) -> String {
        let fits = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '_' | '-') { c } else { '_' };
        let mut name: String = stem.chars().map(fits).collect();
        if !name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
            name.insert(0, '_');
        }
        fresh_name(&name, |name| self.has_node(name))
    }
}
