//! Edits of the world.

use super::Editor;
use crate::{
    document::{
        check::{
            args::{args, migrate, version},
            problems::Problems,
            sea::{self, Own},
            world::{self, FROM, PLACE, Rasters, SEA_LEVEL},
        },
        edit::EditError,
        syntax::{Item, lex::quote, literal::number_text},
    },
    world::{Boundary, Edge, GeoPlace, World},
};

impl Editor<'_> {
    pub(in crate::document) fn set_world(&mut self, world: &World) -> Result<(), EditError> {
        let default = World::default();
        let mut now = self.world();
        if self.world_field(FROM).is_some() && now.is_none_or(|now| now.size != world.size || now.place != world.place)
        {
            // the raster gives neither any more
            self.set_world_field(FROM, None);
            now = self.world();
        }
        let pair = |[x, y]: [String; 2]| format!("({x}, {y})");
        if now.is_none_or(|now| now.seed != world.seed) {
            self.set_world_field("seed", (world.seed != default.seed).then(|| world.seed.to_string()));
        }
        if now.is_none_or(|now| now.boundary != world.boundary) {
            let text = (world.boundary != default.boundary).then(|| boundary_text(&world.boundary));
            self.set_world_field("boundary", text);
        }
        if now.is_none_or(|now| now.size != world.size) {
            let text = (world.size != default.size).then(|| pair(world.size.map(number_text)));
            self.set_world_field("size", text);
        }
        if now.is_none_or(|now| now.place != world.place) {
            let text = world.place.map(|GeoPlace { epsg, corner_m }| {
                format!("(epsg: {epsg}, corner: {})", pair(corner_m.map(number_text)))
            });
            self.set_world_field(PLACE, text);
        }
        let differs = |now: World| now.size != world.size || now.cells != world.cells;
        if self.world().is_none_or(differs) {
            self.set_world_field("cells", None);
            // Without `cells` they follow from the size, which may be sufficient.
            if self.world().is_none_or(differs) {
                self.set_world_field("cells", Some(pair(world.cells.map(|cells| cells.to_string()))));
            }
        }
        self.set_sea(world.sea_level)
    }

    /// Sets the sea level, and removes those of older nodes, which would contradict it.
    fn set_sea(&mut self, level: Option<f64>) -> Result<(), EditError> {
        let own = self.own_seas();
        let now = self.world().and_then(|now| now.sea_level).or(own.first().and_then(|own| own.level));
        if now == level {
            return Ok(());
        }
        for own in own {
            self.current(&own.node)?;
        }
        let text = level.map(|level| quote(&format!("{} m", number_text(level))));
        self.set_world_field(SEA_LEVEL, text);
        Ok(())
    }

    /// Writes the sea level of an older node into a world without one.
    pub(super) fn give_sea(&mut self, text: String) {
        let world = self.draft.root().and_then(|root| root.get("world")).and_then(|item| item.value.as_group());
        if world.is_none_or(|world| world.get(SEA_LEVEL).is_none()) {
            self.set_world_field(SEA_LEVEL, Some(text));
        }
    }

    /// The nodes that have their own sea level.
    fn own_seas(&self) -> Vec<Own> {
        let own = |item: &Item| {
            let (node, group) = self.known(item)?;
            let (group, source) = (group?, self.draft.source.as_str());
            let moved = migrate(&mut args(group, source), node, version(group, source)?, &(0..0))?;
            let own = sea::of_node(node, &item.key.as_ref()?.text, &moved.span, Some(&moved)).ok()??;
            own.level.is_some().then_some(own)
        };
        self.items("nodes").iter().filter_map(own).collect()
    }

    /// The world in the file. Returns None when it is invalid.
    fn world(&self) -> Option<World> {
        let Some(item) = self.draft.root().and_then(|root| root.get("world")) else { return Some(World::default()) };
        let mut problems = Problems::new(Vec::new());
        let rasters = Rasters { registry: self.registry, folder: &self.home.folder };
        let world = world::read(&item.value, &self.draft.source, &rasters, &mut problems);
        (!problems.has_errors()).then_some(world)
    }

    /// The value of a field of the world.
    pub(super) fn world_field(&self, name: &str) -> Option<&Item> {
        self.draft.root()?.get("world")?.value.as_group()?.get(name)
    }

    /// Changes the name of the raster that gives the world its size.
    pub(in crate::document) fn set_world_raster(&mut self, file: &str) {
        self.set_world_field(FROM, Some(quote(file)));
    }

    fn set_world_field(&mut self, name: &str, text: Option<String>) {
        let world = self.draft.root().and_then(|root| root.get("world")).map(|item| &item.value);
        match (world.and_then(|value| value.as_group()), text) {
            (Some(group), Some(text)) => {
                let changes = match group.get(name) {
                    Some(item) => vec![(item.value.span.clone(), text)],
                    None => self.draft.insertion(group, &format!("{name}: {text}"), false),
                };
                self.draft.change(changes);
            }
            (Some(group), None) => {
                if let Some(position) = group.position(name) {
                    let changes = self.draft.removal(group, position);
                    self.draft.change(changes);
                }
            }
            (None, Some(text)) => self.set_root("world", &format!("({name}: {text})")),
            (None, None) => {}
        }
    }
}

fn boundary_text(boundary: &Boundary) -> String {
    let sides =
        [("west", boundary.west), ("east", boundary.east), ("north", boundary.north), ("south", boundary.south)];
    if sides.iter().all(|(_, edge)| *edge == boundary.west) {
        return boundary.west.name().to_owned();
    }
    let said = sides.iter().filter(|(_, edge)| *edge != Edge::default());
    format!("({})", said.map(|(side, edge)| format!("{side}: {}", edge.name())).collect::<Vec<_>>().join(", "))
}
