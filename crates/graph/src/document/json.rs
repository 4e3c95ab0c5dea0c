//! The file as JSON, for other programs: the form that `orograph schema` describes.
//!
//! Records and maps become objects, tuples and lists arrays; words and texts become strings, `true` and `false` become
//! booleans. A node becomes an object with one member, `{"Perlin": {"octaves": 6}}`. Infinity is the string `"inf"`.
//! Comments are left out.

use serde_json::{Map, Number, Value, json};

use super::{
    Document,
    syntax::{
        Expr, ExprKind, Group,
        lex::Bracket,
        literal::{Literal, number_text},
    },
};

impl Document {
    /// The file as JSON. Returns None when the text is not a graph file or has a syntax error.
    #[must_use]
    pub fn to_json(&self) -> Option<Value> {
        let root = self.read.parsed.tree.root.as_ref()?;
        if self.problems().iter().any(|problem| problem.code == "syntax") {
            return None;
        }
        let group = root.as_group().filter(|group| group.name.is_none() && group.bracket == Bracket::Round)?;
        let source = self.source();
        let fields = group.items.iter().filter_map(|item| {
            let key = item.key.as_ref()?;
            let nodes = item.value.as_group().filter(|_| key.text == "nodes");
            let value = nodes.map_or_else(|| value(&item.value, source), |nodes| of_nodes(nodes, source));
            Some((key.text.clone(), value))
        });
        Some(Value::Object(fields.collect()))
    }
}

/// The nodes of a file; a kind without brackets has empty ones.
fn of_nodes(group: &Group, source: &str) -> Value {
    let nodes = group.items.iter().filter_map(|item| {
        let node = match &item.value.kind {
            ExprKind::Word => json!({ source[item.value.span.clone()].to_owned(): {} }),
            _ => value(&item.value, source),
        };
        Some((item.key.as_ref()?.text.clone(), node))
    });
    Value::Object(nodes.collect())
}

fn value(expr: &Expr, source: &str) -> Value {
    match &expr.kind {
        ExprKind::Group(group) => {
            let inner = items(group, source);
            match &group.name {
                // the fields of a kind are an object even if there are none
                Some(name) if group.items.is_empty() => json!({ source[name.clone()].to_owned(): {} }),
                Some(name) => json!({ source[name.clone()].to_owned(): inner }),
                None => inner,
            }
        }
        _ => match Literal::read(expr, source) {
            Literal::Number(_, Some(whole)) => json!(whole),
            Literal::Number(value, None) => {
                Number::from_f64(value).map_or_else(|| json!(number_text(value)), Value::Number)
            }
            Literal::Word(word) if word == "true" || word == "false" => json!(word == "true"),
            Literal::Word(text) | Literal::Text(text) | Literal::NotANumber(text) => json!(text),
            Literal::Tuple(_) | Literal::List(_) | Literal::Record(_) | Literal::Other | Literal::Bad => Value::Null,
        },
    }
}

fn items(group: &Group, source: &str) -> Value {
    let named = group.items.iter().any(|item| item.key.is_some()) || group.bracket == Bracket::Curly;
    if named {
        let item = |item: &super::syntax::Item| Some((item.key.as_ref()?.text.clone(), value(&item.value, source)));
        return Value::Object(group.items.iter().filter_map(item).collect::<Map<_, _>>());
    }
    Value::Array(group.items.iter().map(|item| value(&item.value, source)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry::Registry;

    #[test]
    fn a_file_becomes_json() {
        let source = r##"
            // about
            (
                format: 1,
                world: (size: ("2 km", 1_000), seed: 0x1F, boundary: inland),
                nodes: { "a": Plain, "b": Mix(a: "a", at: [(0, -1.5)], on: true, mode: smooth), "c": Plain() },
                muted: ["a"],
                expect: { "relief": ("2 km", inf) },
            )"##;
        let found = Document::parse(source, &Registry::new([])).to_json();
        let expected = json!({
            "format": 1,
            "world": { "size": ["2 km", 1000], "seed": 31, "boundary": "inland" },
            "nodes": {
                "a": { "Plain": {} },
                "b": { "Mix": { "a": "a", "at": [[0, -1.5]], "on": true, "mode": "smooth" } },
                "c": { "Plain": {} },
            },
            "muted": ["a"],
            "expect": { "relief": ["2 km", "inf"] },
        });
        assert_eq!(found, Some(expected));
        for source in ["", "[1]", "(nodes: {", "Kind(nodes: {})"] {
            assert_eq!(Document::parse(source, &Registry::new([])).to_json(), None, "{source}");
        }
    }
}
