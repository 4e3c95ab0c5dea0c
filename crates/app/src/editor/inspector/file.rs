//! The settings of the file: its world, its outputs, what it expects, and its exposed parameters and inputs.

use egui::{Button, ComboBox, Label, RichText, Ui, containers::menu::MenuButton, containers::menu::MenuConfig};
use orograph_graph::{Boundary, Edge, Edit, ParamSpec, Port, Unit, World};

use super::{
    expected,
    form::{FormState, TextField, line, section, title},
    number, place, row,
    target::Target,
    value::thrown,
};
use crate::editor::{Session, window::names::Named as _};

/// Shows the settings of the file.
pub(super) fn show(ui: &mut Ui, form: &mut FormState, session: &mut Session) {
    title(ui, &session.title());
    let about = session.document().about();
    if about.is_empty() {
        ui.add(Label::new(RichText::new("Select a node to see what it does, or add one to the graph.").weak()).wrap());
    } else {
        ui.add(Label::new(about.replace('\n', " ")).wrap());
    }
    section(ui, "World");
    world(ui, form, session);
    section(ui, "Outputs");
    outputs(ui, form, session);
    section(ui, "Expectations");
    expected::show(ui, form, session);
    section(ui, "Exposed parameters");
    parameters(ui, form, session);
    if !session.document().inputs().is_empty() {
        section(ui, "Exposed inputs");
        inputs(ui, form, session);
    }
}

fn world(ui: &mut Ui, form: &mut FormState, session: &mut Session) {
    let now = session.document().world();
    size(ui, form, session, now);
    let cells = ui.make_persistent_id("cells");
    let axis = usize::from(now.size[1] > now.size[0]);
    let (typed, _) = line(ui, "cells", false, |ui, label| {
        let text = now.cells[axis].to_string();
        let hover = "Cells along the longer side; the other side follows because cells are square";
        let entry = TextField { salt: "n", text: &text, hint: "", hover, width: 70.0, label: Some(label.id), name: "" };
        let mut typed = form.quantity(ui, cells, Unit::Count, entry);
        let usual = ui.menu_button("⏷", |ui| {
            for choice in [256, 512, 1024, 2048, 4096, 8192] {
                if ui.button(choice.to_string()).clicked() {
                    typed = Some(choice.to_string());
                    ui.close();
                }
            }
        });
        let _ = usual.response.named("usual numbers of cells");
        let cell = Unit::Metres.display((now.cell_m() * 1e3).round() / 1e3);
        let tooltip = format!("{} x {} cells, cell size {cell}", now.cells[0], now.cells[1]);
        ui.add(Label::new(RichText::new(format!("cell size {cell}")).weak()).truncate()).on_hover_text(tooltip);
        typed
    });
    if let Some(text) = typed {
        let number = text.trim().parse().ok().filter(|wanted| (1..=World::MAX_SIDE).contains(wanted));
        let number = number.ok_or_else(|| format!("`{text}` is not a whole number from 1 to {}", World::MAX_SIDE));
        let made = number.and_then(|wanted| {
            let world = squared(World { cells: scaled(now, wanted), ..now }, now.size)?;
            session.attempt(&Edit::SetWorld(world))
        });
        form.judge(cells, made);
    }
    form.reason(ui, cells);

    let seed = ui.make_persistent_id("seed");
    let (typed, label) = line(ui, "seed", false, |ui, label| {
        let text = now.seed.to_string();
        let entry =
            TextField { salt: "n", text: &text, hint: "", hover: "", width: 70.0, label: Some(label.id), name: "" };
        let typed = form.quantity(ui, seed, Unit::Count, entry);
        let dice = ui.button("🎲").named("randomise seed").on_hover_text("New random seed");
        if dice.clicked() { Some(thrown(now.seed).to_string()) } else { typed }
    });
    label.on_hover_text("All random numbers in the graph depend on it");
    if let Some(text) = typed {
        let made = text.parse().map_err(|_| format!("`{text}` is not an integer from 0 to {}", u32::MAX));
        let made = made.and_then(|seed| session.attempt(&Edit::SetWorld(World { seed, ..now })));
        form.judge(seed, made);
    }
    form.reason(ui, seed);
    boundary(ui, form, session, now);
    sea_level(ui, form, session, now);
    place::show(ui, form, session, now);
}

/// The sea level; an empty field is a world without a sea.
fn sea_level(ui: &mut Ui, form: &mut FormState, session: &mut Session, now: World) {
    let id = ui.make_persistent_id("sea level");
    let (typed, label) = line(ui, "sea level", false, |ui, label| {
        let text = now.sea_level.map_or_else(String::new, |level| Unit::Metres.display(level));
        let hover = number::hint(Unit::Metres);
        let entry = TextField {
            salt: "level",
            text: &text,
            hint: "none",
            hover: &hover,
            width: 90.0,
            label: Some(label.id),
            name: "",
        };
        let typed = form.quantity(ui, id, Unit::Metres, entry);
        let remove = Button::new("✖").small().frame(false);
        let removed =
            now.sea_level.is_some() && ui.add(remove).named("remove sea level").on_hover_text("No sea").clicked();
        if removed { Some(String::new()) } else { typed }
    });
    label.on_hover_text("Terrain below this elevation is under water; leave empty for a world without a sea");
    if let Some(text) = typed {
        let level = match text.trim() {
            "" => Ok(None),
            text => Unit::Metres.parse(text).map(Some).map_err(|error| error.to_string()),
        };
        let made = level.and_then(|sea_level| session.attempt(&Edit::SetWorld(World { sea_level, ..now })));
        form.judge(id, made);
    }
    form.reason(ui, id);
}

fn size(ui: &mut Ui, form: &mut FormState, session: &mut Session, now: World) {
    let id = ui.make_persistent_id("size");
    let locked = id.with("locked");
    let mut keep = ui.data(|data| data.get_temp(locked)).unwrap_or(true);
    let (typed, _) = line(ui, "size", false, |ui, label| {
        let hover = number::hint(Unit::Metres);
        ui.spacing_mut().item_spacing.x = 4.0;
        let width = ((ui.available_width() - 47.0) / 2.0).clamp(36.0, 90.0);
        let mut typed = None;
        for axis in 0..2 {
            let text = Unit::Metres.display(now.size[axis]);
            let salt = ["width", "height"][axis];
            let label = Some(label.id);
            let name = ["width of the world", "height of the world"][axis];
            let entry = TextField { salt, text: &text, hint: salt, hover: &hover, width, label, name };
            if let Some(text) = form.quantity(ui, id, Unit::Metres, entry) {
                typed = Some((axis, text));
            }
            if axis == 0 {
                ui.label("x");
            }
        }
        if ui
            .selectable_label(keep, "🔒")
            .named("keep the aspect ratio")
            .on_hover_text("Keep the aspect ratio")
            .clicked()
        {
            keep = !keep;
            ui.data_mut(|data| data.insert_temp(locked, keep));
        }
        typed
    });
    if let Some((axis, text)) = typed {
        let made = Unit::Metres.parse(&text).map_err(|error| error.to_string()).and_then(|side| {
            let mut size = now.size;
            size[axis] = side;
            if keep {
                size[1 - axis] = now.size[1 - axis] * side / now.size[axis];
            }
            session.attempt(&Edit::SetWorld(squared(now, size)?))
        });
        form.judge(id, made);
    }
    form.reason(ui, id);
}

/// The cells of a world with this many along its longer side.
fn scaled(world: World, longer: u32) -> [u32; 2] {
    let axis = usize::from(world.size[1] > world.size[0]);
    let mut cells = [longer; 2];
    cells[1 - axis] = (f64::from(longer) * world.size[1 - axis] / world.size[axis]).round() as u32;
    cells
}

/// The world with another size: with the same cells if they stay square, otherwise with cells of about the same length.
///
/// # Errors
/// When the size is invalid, or no number of cells near the current one is square.
fn squared(world: World, size: [f64; 2]) -> Result<World, String> {
    let same = World { size, ..world };
    if same.check().is_ok() {
        return Ok(same);
    }
    if !size.iter().all(|side| side.is_finite() && *side > 0.0) {
        return same.check().map(|()| same).map_err(|error| error.to_string());
    }
    let axis = usize::from(size[1] > size[0]);
    let wanted = (size[axis] / world.cell_m()).round().clamp(1.0, f64::from(World::MAX_SIDE)) as i64;
    let candidate = |longer: i64| {
        let longer = u32::try_from(longer).ok().filter(|longer| *longer > 0)?;
        let world = World { cells: scaled(same, longer), ..same };
        world.check().ok().map(|()| world)
    };
    let found = (0..20_000).find_map(|step| candidate(wanted - step).or_else(|| candidate(wanted + step)));
    found.ok_or_else(|| "no number of cells makes them square; choose a rounder size".to_owned())
}

const fn edge_doc(edge: Edge) -> &'static str {
    match edge {
        Edge::Base => "A fixed base level: water and sediment leave, the elevation stays",
        Edge::Open => "Water and sediment leave; the elevation is free",
        Edge::Wall => "Nothing crosses",
        Edge::Inland => "The terrain continues: rivers also run on a margin, which is cut off",
        Edge::Periodic => "Water and sediment that leave here enter on the opposite side",
    }
}

fn boundary(ui: &mut Ui, form: &mut FormState, session: &mut Session, now: World) {
    let Boundary { west, east, north, south } = now.boundary;
    let mut chosen = None;
    line(ui, "boundary", false, |ui, label| {
        let all = [east, north, south].iter().all(|side| *side == west).then_some(west);
        if let Some(edge) = edge_choice(ui, "all", all, label.id) {
            chosen = Some(Boundary::all(edge));
        }
    });
    egui::CollapsingHeader::new("Each side").id_salt("sides").show(ui, |ui| {
        for (side, edge) in [("west", west), ("east", east), ("north", north), ("south", south)] {
            line(ui, side, false, |ui, label| {
                let Some(edge) = edge_choice(ui, side, Some(edge), label.id) else { return };
                let mut boundary = now.boundary;
                set_side(&mut boundary, side, edge);
                chosen = Some(boundary);
            });
        }
    });
    let id = ui.make_persistent_id("boundary");
    if let Some(boundary) = chosen {
        form.judge(id, session.attempt(&Edit::SetWorld(World { boundary, ..now })));
    }
    form.reason(ui, id);
}

/// Sets the edge of a side. Periodic sides come in pairs.
fn set_side(boundary: &mut Boundary, side: &str, edge: Edge) {
    let Boundary { west, east, north, south } = boundary;
    let (this, other) = match side {
        "west" => (west, east),
        "east" => (east, west),
        "north" => (north, south),
        _ => (south, north),
    };
    if edge == Edge::Periodic || *this == Edge::Periodic {
        *other = edge;
    }
    *this = edge;
}

fn edge_choice(ui: &mut Ui, salt: &str, now: Option<Edge>, label: egui::Id) -> Option<Edge> {
    let mut chosen = None;
    let shown = ComboBox::from_id_salt(("edge", salt)).selected_text(now.map_or("mixed", Edge::name)).width(120.0);
    let response = shown.show_ui(ui, |ui| {
        for (name, edge) in Edge::NAMES {
            if ui.selectable_label(now == Some(edge), name).on_hover_text(edge_doc(edge)).clicked() {
                chosen = Some(edge);
            }
        }
    });
    response.response.labelled_by(label);
    chosen.filter(|edge| now != Some(*edge))
}

/// The outputs of the file: each with its name, its source, and a button to remove it.
fn outputs(ui: &mut Ui, form: &mut FormState, session: &mut Session) {
    let graph = session.document().graph();
    let outputs: Vec<(String, String, String)> = session
        .document()
        .outputs()
        .iter()
        .map(|output| (output.name.clone(), graph.port_name(output.port), output.ty.to_string()))
        .collect();
    let ports = graph.indices().flat_map(|node| {
        let outputs = graph.instance(node).node.outputs.len();
        (0..outputs).map(move |output| Port { node, output })
    });
    let writable = ports.filter(|port| graph.output_type(*port).is_writable());
    let ports: Vec<String> = writable.map(|port| graph.port_name(port)).collect();
    let mut edit = None;
    let mut jump = None;
    for (name, port, ty) in &outputs {
        let id = ui.make_persistent_id(("output", name));
        ui.horizontal(|ui| {
            let width = (ui.available_width() * 0.36).clamp(60.0, 140.0);
            let entry = TextField {
                salt: "name",
                text: name,
                hint: "name",
                hover: "File name of the output",
                width,
                label: None,
                name: &format!("name of output {name}"),
            };
            if let Some(to) = form.entry(ui, id, entry) {
                edit = Some((id, Edit::RenameOutput { from: name.clone(), to }));
            }
            let remove = ui.add(Button::new("✖").small().frame(false)).named(format!("remove output {name}"));
            if remove.on_hover_text("Remove the output").clicked() {
                edit = Some((id, Edit::RemoveOutput { name: name.clone() }));
            }
            if ui.link(format!("⬅ {port}")).on_hover_text(ty).clicked() {
                jump = port.split_once('.').map(|(node, _)| node.to_owned());
            }
        });
        form.reason(ui, id);
    }
    if outputs.is_empty() {
        ui.add(Label::new(RichText::new("No outputs yet: exporting would write nothing.").weak()).wrap());
    }
    let id = ui.make_persistent_id("new output");
    ui.menu_button("➕ output", |ui| {
        egui::ScrollArea::vertical().max_height(360.0).show(ui, |ui| {
            for port in &ports {
                if ui.button(port).clicked() {
                    let taken = |name: &str| outputs.iter().any(|(output, ..)| output == name);
                    let (node, short) = port.split_once('.').unwrap_or((port, port));
                    let numbered = (2..).map(|n| format!("{node}_{n}"));
                    let mut names = [short.to_owned(), node.to_owned()].into_iter().chain(numbered);
                    let name = names.find(|name| !taken(name)).unwrap_or_default();
                    edit = Some((id, Edit::SetOutput { name, from: port.clone() }));
                    ui.close();
                }
            }
        });
    });
    if let Some((id, edit)) = edit {
        form.judge(id, session.attempt(&edit));
    }
    form.reason(ui, id);
    if let Some(node) = jump {
        session.select_only(&node);
    }
}

/// The exposed parameters of the file.
fn parameters(ui: &mut Ui, form: &mut FormState, session: &mut Session) {
    let graph = session.document().graph();
    let named: Vec<(Target, ParamSpec, Vec<String>)> = session
        .document()
        .parameters()
        .iter()
        .map(|named| {
            let places = named.places.iter().map(|place| {
                let instance = graph.instance(place.node);
                let (node, name) = (instance.name.clone(), place.name.to_owned());
                match instance.node.input(place.name) {
                    Some(_) => Target::Input { node, name },
                    None => Target::Param { node, name },
                }
            });
            let target = Target::Named { name: named.name.clone(), places: places.collect() };
            // Only its kind, unit and documentation are shown; the name comes from the target.
            let spec = ParamSpec {
                name: named.places[0].name,
                doc: graph
                    .instance(named.places[0].node)
                    .node
                    .specs()
                    .iter()
                    .find(|spec| spec.name == named.places[0].name)
                    .map_or("", |spec| spec.doc),
                unit: named.unit,
                kind: named.kind.clone(),
                when: &[],
            };
            let places = named.places.iter().map(|place| format!("{}.{}", graph.instance(place.node).name, place.name));
            (target, spec, places.collect())
        })
        .collect();
    if named.is_empty() {
        let text = "None yet. Use a value's … menu to expose it to the command line and to other graphs.";
        ui.add(Label::new(RichText::new(text).weak()).wrap());
    }
    for (target, spec, places) in &named {
        let value = spec.kind.default_value();
        row::row(ui, form, session, row::Subject { target, spec, value: &value, changed: false });
        names(ui, form, session, target.label(), places);
    }
}

/// The exposed inputs of the file.
fn inputs(ui: &mut Ui, form: &mut FormState, session: &mut Session) {
    let graph = session.document().graph();
    let named: Vec<(String, Vec<String>)> = session
        .document()
        .inputs()
        .iter()
        .map(|named| {
            let places = named.places.iter().map(|place| format!("{}.{}", graph.instance(place.node).name, place.name));
            (named.name.clone(), places.collect())
        })
        .collect();
    for (name, places) in named {
        line(ui, &name, false, |_, _| {});
        names(ui, form, session, &name, &places);
    }
}

/// The places that an exposed name sets, and buttons to rename or remove it.
fn names(ui: &mut Ui, form: &mut FormState, session: &mut Session, name: &str, places: &[String]) {
    let id = ui.make_persistent_id(("named", name));
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        for place in places {
            if ui.link(RichText::new(format!("⬅ {place}")).small()).on_hover_text("Go to this node").clicked()
                && let Some((node, _)) = place.split_once('.')
            {
                session.select_only(node);
            }
        }
        let config = MenuConfig::new().close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside);
        let rename = MenuButton::from_button(Button::new(RichText::new("rename…").small()).frame(false));
        let (button, _) = rename.config(config).ui(ui, |ui| {
            let entry = TextField {
                salt: "name",
                text: name,
                hint: "name",
                hover: "",
                width: 140.0,
                label: None,
                name: "new name",
            };
            if let Some(to) = form.entry(ui, id, entry) {
                form.judge(id, session.attempt(&Edit::RenameNamed { from: name.to_owned(), to }));
                ui.close();
            }
            form.reason(ui, id);
        });
        let _ = button.named(format!("rename {name}"));
        let stop = ui.add(Button::new(RichText::new("✖").small()).frame(false)).named(format!("stop exposing {name}"));
        if stop.on_hover_text("Stop exposing it").clicked() {
            form.judge(id, session.attempt(&Edit::Conceal { name: name.to_owned() }));
        }
    });
    form.reason(ui, id);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_stay_square_when_the_size_changes() {
        let world = World::default();
        let wide = squared(world, [20_000.0, 16_384.0]).expect("some cells are square");
        assert_eq!((wide.cells, wide.check()), ([1250, 1024], Ok(())));
        assert_eq!(squared(world, [32_768.0; 2]).expect("square").cells, [1024; 2]);
        assert_eq!(squared(World { cells: scaled(world, 500), ..world }, world.size).expect("square").cells, [500; 2]);
        assert!(squared(world, [0.0, 5.0]).is_err() && squared(world, [-1.0, f64::NAN]).is_err());
    }

    #[test]
    fn periodic_sides_come_in_pairs() {
        let mut boundary = Boundary::default();
        set_side(&mut boundary, "west", Edge::Periodic);
        assert_eq!((boundary.west, boundary.east, boundary.north), (Edge::Periodic, Edge::Periodic, Edge::Base));
        set_side(&mut boundary, "east", Edge::Wall);
        assert_eq!((boundary.west, boundary.east), (Edge::Wall, Edge::Wall));
    }
}
