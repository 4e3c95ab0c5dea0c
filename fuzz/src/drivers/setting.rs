//! What is typed after `--set`, `--sweep`, `--cells` and `--window`.

use orograph::{
    build::request::{Cells, Part, Setting},
    cli::sweep::Sweep,
};
use orograph_graph::Document;

use super::{Attack, PIECES, Taken, project};
use crate::dice::Dice;

struct Settings {
    document: Document,
    /// Whole arguments.
    typed: Vec<String>,
    /// Arguments up to the value.
    places: Vec<String>,
}

const VALUES: [&str; 12] =
    ["2 km", "0.5", "7", "max", "true", "(1, 2)", "[(0, 1), (1, 2)]", "2 mm/yr", "30°", "-1e9", "\"x.tif\"", "#a08060"];

pub(super) fn prepare() -> Box<dyn Attack> {
    let text = std::fs::read_to_string(project().join("graphs/alps.ron")).expect("a graph of the project");
    let document = Document::parse(text, &orograph_nodes::registry());
    let typed: Vec<String> = ["height=2.6 mm/yr", "seed=1..20", "a.b=0.5..2/0.5", "x=1,2,3", "x=(1, 2),(3, 4)"]
        .iter()
        .chain(&["512", "30 m", "1 km,2 km,3 km,4 km", "0,0,16,16", "x=1..3/0.5 Myr", "x=-1e300..1e300/1e-300"])
        .map(|text| (*text).to_owned())
        .collect();
    let registry = orograph_nodes::registry();
    let params = document.nodes().iter().flat_map(|node| {
        let declared = registry.get(&node.kind).map_or_else(Vec::new, |kind| (kind.params)());
        declared.into_iter().map(|param| format!("{}.{}=", node.name, param.name))
    });
    let places = params.chain(document.parameters().iter().map(|parameter| format!("{}=", parameter.name))).collect();
    Box::new(Settings { document, typed, places })
}

impl Attack for Settings {
    fn case(&mut self, dice: &mut Dice) -> Result<Taken, String> {
        let typed = if dice.one_in(2) {
            let typed = dice.pick(&self.typed).clone();
            dice.damaged_text(&typed, &PIECES)
        } else {
            let value = *dice.pick(&VALUES);
            let value = if dice.one_in(2) { value.to_owned() } else { dice.damaged_text(value, &PIECES) };
            dice.pick(&self.places).clone() + &value
        };
        let _ = typed.parse::<Sweep>();
        let _ = typed.parse::<Cells>();
        let _ = typed.parse::<Part>().map(|part| part.window(self.document.world()));
        let mut accepted = false;
        if let Ok(setting) = typed.parse::<Setting>() {
            let before = self.document.source().to_owned();
            accepted = setting.apply(&mut self.document, "--set").is_ok();
            if accepted {
                while self.document.undo() {}
            }
            if self.document.source() != before {
                return Err(format!("`{typed}` left a changed document"));
            }
        }
        Ok(Taken::text(accepted))
    }
}
