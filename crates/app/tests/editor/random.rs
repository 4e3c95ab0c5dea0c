//! Random actions: nothing panics, and undo leads back to the first text.

use egui::{Event, Key, Modifiers, PointerButton, Pos2, Rect, accesskit::Role, pos2};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use orograph::editor::App;

use crate::{
    canvas::document,
    hand::{button, drag_with},
    harness, scratch, settle,
};

const TEXT: &str = "// A file with comments.
(
    format: 1,
    world: (size: \"4 km\", cells: 48, seed: 3),
    nodes: {
        \"ground\": Ridged(wavelength: \"1 km\", amplitude: 300), // hills
        \"hole\":   Crater(version: 2, pattern: one, centre: (2000, 1500), diameter: 600),
        \"both\":   Combine(a: \"ground\", b: \"hole\", mode: add),
        \"steps\":  Terrace(version: 2, height: \"both\"),
    },
    outputs: { \"height\": \"steps\" },
    layout: { \"ground\": (0, 0), \"hole\": (0, 300), \"both\": (240, 100), \"steps\": (480, 100) },
)
";

/// Number of actions, and of those of the test in which everything is built after each.
const ACTIONS: [usize; 2] = [500, 150];

/// A sequence of numbers that look random (Marsaglia's xorshift).
struct Dice(u64);

impl Dice {
    /// A number below a limit.
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 16) as usize % limit.max(1)
    }

    fn place(&mut self, rect: Rect) -> Pos2 {
        let share = [(); 2].map(|()| self.below(1000) as f32 / 1000.0);
        rect.lerp_inside(share)
    }

    fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }
}

/// Keys of the graph, the viewport, dialogs and text fields.
const KEYS: [(Modifiers, Key); 37] = [
    (Modifiers::NONE, Key::Tab),
    (Modifiers::NONE, Key::Enter),
    (Modifiers::NONE, Key::Escape),
    (Modifiers::NONE, Key::Delete),
    (Modifiers::NONE, Key::M),
    (Modifiers::NONE, Key::H),
    (Modifiers::NONE, Key::C),
    (Modifiers::NONE, Key::L),
    (Modifiers::NONE, Key::F),
    (Modifiers::NONE, Key::V),
    (Modifiers::NONE, Key::B),
    (Modifiers::NONE, Key::P),
    (Modifiers::NONE, Key::X),
    (Modifiers::NONE, Key::R),
    (Modifiers::NONE, Key::O),
    (Modifiers::NONE, Key::Num1),
    (Modifiers::NONE, Key::Num2),
    (Modifiers::NONE, Key::Num3),
    (Modifiers::NONE, Key::Home),
    (Modifiers::NONE, Key::F1),
    (Modifiers::NONE, Key::F2),
    (Modifiers::NONE, Key::ArrowDown),
    (Modifiers::NONE, Key::ArrowRight),
    (Modifiers::NONE, Key::Insert),
    (Modifiers::NONE, Key::Space),
    (Modifiers::COMMAND, Key::A),
    (Modifiers::COMMAND, Key::D),
    (Modifiers::COMMAND, Key::F),
    (Modifiers::COMMAND, Key::G),
    (Modifiers::COMMAND, Key::R),
    (Modifiers::COMMAND, Key::E),
    (Modifiers::COMMAND, Key::J),
    (Modifiers::COMMAND, Key::Z),
    (Modifiers::COMMAND, Key::Y),
    (Modifiers::COMMAND, Key::Space),
    (Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z),
    (Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::G),
];

const TEXTS: [&str; 9] = ["te", "2 km", "-1", "1e999", "Thermal", "ü\u{1f30d}", "(1, 2)", "\"", "0.5"];

/// Buttons that end the test or leave the window: other files, folders of the system.
const LEFT_OUT: [&str; 10] =
    ["Quit", "New", "Open", "Save", "Discard", "Examples", "Welcome", "Browse", "Copy of", "Export"];

/// Presses and releases the button, without the pause that tells two clicks from a double click.
fn tap(window: &mut Harness<'_, App>, at: Pos2, modifiers: Modifiers) {
    window.hover_at(at);
    window.step();
    button(window, at, PointerButton::Primary, true, modifiers);
    button(window, at, PointerButton::Primary, false, modifiers);
    window.step();
}

/// Clicks a button or another widget by its name. Returns what it clicked.
fn widget(window: &mut Harness<'_, App>, dice: &mut Dice) -> String {
    let roles =
        [Role::Button, Role::CheckBox, Role::ComboBox, Role::Link, Role::TextInput, Role::Slider, Role::SpinButton];
    let screen = window.ctx.content_rect();
    let widgets: Vec<(String, Pos2)> = roles
        .into_iter()
        .flat_map(|role| window.query_all_by_role(role))
        .map(|node| (node.accesskit_node().label().unwrap_or_default(), node.rect().center()))
        .filter(|(name, at)| screen.contains(*at) && !LEFT_OUT.iter().any(|left| name.starts_with(left)))
        .collect();
    let Some((name, at)) = widgets.get(dice.below(widgets.len())).cloned() else { return "nothing".to_owned() };
    tap(window, at, Modifiers::NONE);
    format!("click {name}")
}

/// Does something at random. Returns what it did.
fn act(window: &mut Harness<'_, App>, dice: &mut Dice) -> String {
    let screen = window.ctx.content_rect();
    let inside = screen.shrink(2.0);
    let modifiers = dice.one(&[Modifiers::NONE, Modifiers::NONE, Modifiers::COMMAND, Modifiers::SHIFT]);
    match dice.below(12) {
        0 | 1 => widget(window, dice),
        2 => {
            let at = dice.place(inside);
            tap(window, at, modifiers);
            format!("click at {at:?} with {modifiers:?}")
        }
        3 | 4 => {
            // A node, or a pin, to anywhere.
            let names = ["node ", "output ", "input ", "point ", "diameter"];
            let starts: Vec<Pos2> = window
                .query_all_by_role(Role::Unknown)
                .chain(window.query_all_by_role(Role::GenericContainer))
                .filter(|node| {
                    let label = node.accesskit_node().label().unwrap_or_default();
                    names.iter().any(|name| label.starts_with(name))
                })
                .map(|node| node.rect().center())
                .filter(|at| inside.contains(*at))
                .collect();
            let from = if starts.is_empty() { dice.place(inside) } else { dice.one(&starts) };
            let to = dice.place(inside);
            drag_with(window, from, to, modifiers);
            format!("drag {from:?} to {to:?} with {modifiers:?}")
        }
        5 => {
            let at = dice.place(inside);
            window.hover_at(at);
            window.step();
            button(window, at, PointerButton::Secondary, true, Modifiers::NONE);
            button(window, at, PointerButton::Secondary, false, Modifiers::NONE);
            window.step();
            format!("menu at {at:?}")
        }
        6 | 7 => {
            let graph = dice.below(2) == 0;
            let at = if graph { pos2(320.0, 580.0) } else { dice.place(inside) };
            window.hover_at(at);
            window.step();
            let (modifiers, key) = dice.one(&KEYS);
            window.key_press_modifiers(modifiers, key);
            window.run_steps(2);
            format!("{modifiers:?} {key:?} at {at:?}")
        }
        8 => {
            let text = dice.one(&TEXTS);
            window.event(Event::Text(text.to_owned()));
            window.run_steps(2);
            format!("type {text:?}")
        }
        9 => {
            let at = dice.place(inside);
            window.hover_at(at);
            let steps = dice.one(&[-3.0, -1.0, 1.0, 3.0]);
            crate::hand::wheel(window, steps);
            format!("wheel {steps} at {at:?}")
        }
        10 => {
            let menu = dice.one(&["Edit", "View", "Help"]);
            let at = window.query_all_by_label(menu).next().map(|node| node.rect().center());
            if let Some(at) = at {
                tap(window, at, Modifiers::NONE);
            }
            format!("menu {menu}")
        }
        _ => {
            let text = dice.one(&["{ \"x\": Ridged(seed: 4) }", "nonsense", "{ \"y\": Terrace(height: \"both\") }"]);
            window.event(Event::Paste(text.to_owned()));
            window.run_steps(2);
            format!("paste {text}")
        }
    }
}

#[test]
fn random_actions_never_lose_the_way_back() {
    crate::draws();
    act_at_random(0x5eed_0017, ACTIONS[0], false);
}

#[test]
fn random_actions_on_built_terrain_never_lose_the_way_back() {
    crate::draws();
    act_at_random(0x5eed_0039, ACTIONS[1], true);
}

/// Does a number of things; if `settles`, each once everything is built.
fn act_at_random(seed: u64, actions: usize, settles: bool) {
    let folder = scratch(TEXT);
    let file = folder.path().join("graph.ron");
    let mut window = harness([900.0, 620.0]).with_step_dt(1.0 / 20.0).build_eframe(|context| {
        App::new(context, Some(file), orograph::build::storage::in_memory()).expect("the file can be read")
    });
    window.state_mut().session_mut().set_cells(48);
    window.run_steps(4);
    let mut dice = Dice(seed);
    let (mut done, mut most) = (Vec::new(), 0);
    for _ in 0..actions {
        // If an action panics, the test's output ends with what was done.
        if settles {
            settle(&mut window);
        }
        let what = act(&mut window, &mut dice);
        println!("{}: {what}", done.len());
        done.push(what);
        most = most.max(document(&window).steps());
        assert!(window.state().session().question().is_none(), "{:?}", done.last());
    }
    // how many do depends on how far builds are
    assert!(most >= 3, "the actions changed the graph {most} times");
    let edited = document(&window).source().to_owned();
    let session = window.state_mut().session_mut();
    let steps = session.document().steps();
    let mut undone = 0;
    while session.undo() {
        undone += 1;
    }
    assert_eq!((undone, session.document().source()), (steps, TEXT));
    for _ in 0..steps {
        session.redo();
    }
    assert_eq!(session.document().source(), edited);
    window.run_steps(3);
}
