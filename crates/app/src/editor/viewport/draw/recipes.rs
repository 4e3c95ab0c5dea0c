//! Nodes with a line under names of their own, with the parameters that they need.

use orograph_graph::Node;

use super::New;

/// A node under another name.
struct Recipe {
    name: &'static str,
    kind: &'static str,
    /// What it makes.
    what: &'static str,
    values: &'static [(&'static str, &'static str)],
}

/// The recipes that [`New`] adds beside the kinds of nodes.
const RECIPES: [Recipe; 1] = [Recipe {
    name: "Road",
    kind: "Carve",
    what: "A level roadway, nowhere steeper than its grade, with cuts and fills.",
    values: &[
        ("mode", "grade"),
        ("course", "graded"),
        ("profile", "flat"),
        ("depth", "0"),
        ("wander", "0"),
        ("widening", "0"),
        ("raggedness", "0"),
        ("detail", "0"),
    ],
}];

/// Those of a kind of node, and what each makes.
pub(super) fn of(kind: &'static Node) -> impl Iterator<Item = (New, &'static str)> {
    let own = RECIPES.iter().filter(|recipe| recipe.kind == kind.id);
    own.map(move |recipe| (New { kind, name: recipe.name, values: recipe.values }, recipe.what))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_recipe_is_listed_and_sets_parameters_of_its_kind() {
        let registry = orograph_nodes::registry();
        let listed: usize = registry.listed().map(|kind| of(kind).count()).sum();
        assert_eq!(listed, RECIPES.len());
        for recipe in &RECIPES {
            let kind = registry.listed().find(|kind| kind.id == recipe.kind).expect("a kind");
            let specs = kind.specs();
            for (param, text) in recipe.values {
                let spec = specs.iter().find(|spec| spec.name == *param).expect("a parameter");
                assert_ne!(spec.kind.default_value().to_string(), *text, "{param} has its default");
            }
        }
    }
}
