//! The fields that the 3D view draws for an output: heights, colours, water, mask and lines.

use std::sync::Arc;

use orograph_graph::{Field, Graph, Lines, Port, PortType, Unit, Value};

use super::{
    Shown,
    look::{Look, Over, Water},
    shown,
};
use crate::editor::Session;

/// What follows the name of a snapshot in the name of the heights that it lies on.
pub(super) const GROUND: &str = " ground";

/// The name of level ground, on which lines lie that have no terrain.
pub(super) const LEVEL: &str = "level ground";

/// The fields of a drawn terrain.
#[derive(Clone)]
pub(super) struct Surface {
    pub(super) key: Key,
    pub(super) height: Field,
    /// The source of its colours.
    pub(super) colour: Option<Colour>,
    pub(super) water: Option<Field>,
    pub(super) mask: Option<Field>,
    pub(super) lines: Option<Arc<Lines>>,
}

/// An output drawn as colours.
#[derive(Clone)]
pub(super) struct Colour {
    pub(super) field: Field,
    pub(super) ty: PortType,
    /// The whole output, which gives the range of the tints.
    pub(super) whole: Field,
}

/// Identifies a drawn terrain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Key {
    /// Its outputs, each with the state of the document, the intermediate step, and the cells.
    parts: Vec<(String, [u64; 2], [u32; 2])>,
}

impl Key {
    /// The oldest state of the document among the outputs, and the fewest cells along the longer side. Returns None
    /// while one of them is an intermediate result.
    pub(super) fn age(&self) -> Option<(u64, u32)> {
        if self.parts.iter().any(|(_, [_, step], _)| *step > 0) {
            return None;
        }
        let oldest = self.parts.iter().map(|(_, [revision, _], _)| *revision).min()?;
        let fewest = self.parts.iter().map(|(_, _, [nx, ny])| *nx.max(ny)).min()?;
        Some((oldest, fewest))
    }
}

/// The outputs that the 3D view draws for the shown one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Parts {
    /// Heights.
    pub(super) ground: Option<String>,
    /// Colours or a mask.
    pub(super) over: Option<String>,
    /// Depths of water.
    pub(super) water: Option<String>,
    pub(super) lines: Option<String>,
}

impl Parts {
    /// The outputs to draw on a map with these settings: lines, a mask and numbers lie on heights, water on the ground.
    pub(super) fn of_map(session: &Session, port: &str, look: &Look) -> Self {
        let graph = session.document().graph();
        let is_lines = graph.port(port).is_ok_and(|shown| graph.output_type(shown) == PortType::Lines);
        let level = || is_lines.then(|| LEVEL.to_owned());
        Self {
            ground: Self::ground_of(session, port).or_else(level),
            over: None,
            water: Self::water_of(session, port, look),
            lines: is_lines.then(|| port.to_owned()),
        }
    }

    /// The heights on which lines, a mask or numbers lie.
    pub(super) fn ground_of(session: &Session, port: &str) -> Option<String> {
        let graph = session.document().graph();
        let Ok(shown) = graph.port(port) else {
            let Self { ground, over, .. } = Self::of_snapshot(session, port);
            return ground.filter(|_| over.is_some());
        };
        let lies = matches!(graph.output_type(shown), PortType::Lines | PortType::Mask | PortType::Scalar(_));
        let ground = lies.then(|| session.ground_of(shown)).flatten()?;
        Some(graph.port_name(ground))
    }

    /// The depth of the water on an output of heights, with these settings.
    pub(super) fn water_of(session: &Session, port: &str, look: &Look) -> Option<String> {
        let graph = session.document().graph();
        let heights = graph.port(port).ok().filter(|shown| graph.output_type(*shown) == PortType::Height)?;
        match &look.water {
            Water::None => None,
            Water::Output(water) => Some(water.clone()),
            Water::Own => own_water(graph, heights).map(|port| graph.port_name(port)),
        }
    }

    /// The outputs to draw in 3D with these settings.
    pub(super) fn of(session: &Session, port: &str, look: &Look) -> Self {
        let graph = session.document().graph();
        let Ok(shown) = graph.port(port) else { return Self::of_snapshot(session, port) };
        let ground = session.ground_of(shown);
        let ty = graph.output_type(shown);
        let over = match (&look.over, ty) {
            (Over::Output(over), PortType::Height | PortType::Lines) => Some(over.clone()),
            (_, PortType::Height | PortType::Lines) => None,
            _ => Some(port.to_owned()),
        };
        let lines = (ty == PortType::Lines).then(|| port.to_owned());
        let water = match &look.water {
            Water::None => None,
            Water::Output(water) => Some(water.clone()),
            Water::Own => ground.and_then(|ground| own_water(graph, ground)).map(|port| graph.port_name(port)),
        };
        let depth = water.as_deref().and_then(|water| graph.port(water).ok());
        let bed = depth.zip(ground).and_then(|(depth, ground)| bed(graph, depth, ground));
        let ground = bed.or(ground);
        let level = || lines.as_ref().map(|_| LEVEL.to_owned());
        Self { ground: ground.map(|port| graph.port_name(port)).or_else(level), over, water, lines }
    }

    /// The parts of a snapshot, under the names that [`shown()`] knows.
    fn of_snapshot(session: &Session, name: &str) -> Self {
        let own = || Some(name.to_owned());
        match session.snapshot(name) {
            Some(snapshot) if snapshot.ty() == PortType::Height => Self { ground: own(), ..Self::default() },
            Some(snapshot) if snapshot.ground.is_some() => {
                Self { ground: Some(format!("{name}{GROUND}")), over: own(), ..Self::default() }
            }
            _ => Self::default(),
        }
    }

    /// The names of those that can have a finer part, without duplicates; empty if there are no heights to draw.
    pub(super) fn drawn(&self) -> Vec<String> {
        let fields = self.names().filter(|name| self.lines.as_ref() != Some(name));
        let mut names: Vec<String> = fields.filter(|_| self.ground.is_some()).collect();
        names.sort();
        names.dedup();
        names
    }

    /// Their names.
    pub(super) fn names(&self) -> impl Iterator<Item = String> {
        [&self.ground, &self.over, &self.water, &self.lines].into_iter().flatten().cloned()
    }
}

/// The name of an output.
fn name(graph: &Graph, port: Port) -> &str {
    graph.instance(port.node).node.outputs[port.output].name
}

/// Returns true if heights are those of the surface of water, whose depth is another output of the node.
fn is_surface(graph: &Graph, ground: Port) -> bool {
    name(graph, ground) == "level"
}

/// The depth of the water on the heights of a node, or below them if they are its surface. Other depths, such as those of
/// snow, are no water.
fn own_water(graph: &Graph, ground: Port) -> Option<Port> {
    let mut outputs = (0..graph.instance(ground.node).node.outputs.len()).map(|output| Port { output, ..ground });
    outputs.find(|port| {
        let is_water = match name(graph, *port) {
            "water" => true,
            "depth" => is_surface(graph, ground),
            _ => false,
        };
        is_water && graph.output_type(*port) == PortType::Scalar(Unit::Metres)
    })
}

/// The ground below the surface of water, on which the depth of the water lies: the heights that the node reads. Returns
/// None if the depth does not belong to these heights, or they are the ground.
fn bed(graph: &Graph, depth: Port, ground: Port) -> Option<Port> {
    if depth.node != ground.node || !is_surface(graph, ground) {
        return None;
    }
    let inputs = 0..graph.instance(ground.node).node.inputs.len();
    let mut sources = inputs.filter_map(|input| graph.source(ground.node, input));
    sources.find(|source| graph.output_type(*source) == PortType::Height)
}

impl Surface {
    /// The terrain of an output, with those of its fields that are built. Returns None without heights.
    pub(super) fn of(session: &Session, parts: &Parts) -> Option<Self> {
        let ground = shown(session, parts.ground.as_deref()?)?;
        let cells = ground.field.window().cells;
        let part = |name: &Option<String>| {
            let part = shown(session, name.as_deref()?)?;
            (part.field.window().cells == cells).then_some(part)
        };
        let (over, water) = (part(&parts.over), part(&parts.water));
        let lines = parts.lines.as_deref().and_then(|name| session.built(name).map(|built| (name, built)));
        let all = [Some(&ground), over.as_ref(), water.as_ref()];
        let name = |part: &Shown| (part.port.clone(), [part.revision, part.step], part.field.window().cells);
        let of_lines = lines.map(|(name, built)| (name.to_owned(), [built.revision, built.step], [built.cells; 2]));
        let parts = all.into_iter().flatten().map(name).chain(of_lines).collect();
        let lines = lines.and_then(|(_, built)| match &built.value {
            Value::Lines(lines) => Some(Arc::clone(lines)),
            _ => None,
        });
        let (mut colour, mut mask) = (None, None);
        if let Some(over) = over {
            match over.ty {
                PortType::Mask => mask = Some(over.field),
                ty => colour = Some(Colour { whole: over.field.clone(), field: over.field, ty }),
            }
        }
        let water = water.map(|water| water.field);
        Some(Self { key: Key { parts }, height: ground.field, colour, water, mask, lines })
    }

    /// The finer part near the camera. Returns None when the view is not close, or the part is of another state of the
    /// document.
    pub(super) fn finer(&self, session: &Session, parts: &Parts) -> Option<Self> {
        let now = [session.revision(), 0];
        let same = self.key.parts.iter().all(|(_, age, _)| *age == now);
        let part = |name: &Option<String>| {
            let built = session.finer(name.as_deref()?).filter(|built| same && built.revision == now[0])?;
            built.value.as_field().cloned()
        };
        let height = part(&parts.ground)?;
        let fits = |field: &Field| field.window() == height.window();
        let (key, lines) = (self.key.clone(), self.lines.clone());
        let mut finer = Self { key, height: height.clone(), colour: None, water: None, mask: None, lines };
        if let Some(colour) = &self.colour {
            finer.colour = Some(Colour { field: part(&parts.over).filter(fits)?, ..colour.clone() });
        }
        if self.water.is_some() {
            finer.water = Some(part(&parts.water).filter(fits)?);
        }
        if self.mask.is_some() {
            finer.mask = Some(part(&parts.over).filter(fits)?);
        }
        Some(finer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WATERS: &str = r#"(world: (size: 1000, cells: 16), nodes: {
        "land": Ridged(), "lakes": Lakes(height: "land"), "storm": HydraulicPipe(height: "land", duration: 60),
        "snow": Snow(height: "land") }, outputs: { "height": "land" })"#;

    /// The ground and the water that are drawn for an output.
    fn parts(session: &Session, port: &str, water: Water) -> [Option<String>; 2] {
        let mut look = Look::default();
        look.water = water;
        let Parts { ground, water, .. } = Parts::of(session, port, &look);
        [ground, water]
    }

    #[test]
    fn the_depth_of_water_lies_on_the_ground_and_not_on_its_surface() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("waters.ron");
        std::fs::write(&file, WATERS).expect("written");
        let store = crate::build::storage::in_memory();
        let session =
            Session::open(Some(file), orograph_nodes::registry(), store, || {}).expect("the file can be read");
        let both = |ground: &str, water: &str| [ground, water].map(|name| Some(name.to_owned()));
        let depth = || Water::Output("lakes.depth".to_owned());
        for port in ["lakes.level", "lakes.depth"] {
            assert_eq!(parts(&session, port, Water::Own), both("land.height", "lakes.depth"), "{port}");
            assert_eq!(parts(&session, port, depth()), both("land.height", "lakes.depth"), "{port}");
        }
        assert_eq!(parts(&session, "lakes.level", Water::None), [Some("lakes.level".to_owned()), None]);
        // water on the ground itself
        assert_eq!(parts(&session, "land.height", depth()), both("land.height", "lakes.depth"));
        assert_eq!(parts(&session, "storm.height", Water::Own), both("storm.height", "storm.water"));
        assert_eq!(parts(&session, "snow.height", Water::Own), [Some("snow.height".to_owned()), None]);
    }
}
