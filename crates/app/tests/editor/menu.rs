//! Tests of the menus: opening and saving files, questions before work is lost, copies of examples.

use egui::{Key, Modifiers, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use orograph::editor::{App, Question};
use orograph_graph::Edit;

use crate::{
    canvas::{ROW, window_on},
    graph,
    hand::{click, key, type_text},
    look, scratch, settle, window,
};

const GRAPH: &str = "(nodes: { \"a\": Constant(value: 1) }, outputs: { \"h\": \"a\" })";

fn press(window: &mut Harness<'_, App>, modifiers: Modifiers, key: Key) {
    window.key_press_modifiers(modifiers, key);
    window.run_steps(4);
}

fn menu(window: &mut Harness<'_, App>, menu: &str, item: &str) {
    window.get_by_role_and_label(Role::Button, menu).click();
    window.run_steps(3);
    window.get_by_label_contains(item).click();
    window.run_steps(4);
}

/// Chooses an item of a submenu.
fn inner(window: &mut Harness<'_, App>, outer: &str, menu: &str, item: &str) {
    window.get_by_role_and_label(Role::Button, outer).click();
    window.run_steps(3);
    window.get_by_label_contains(menu).click();
    window.run_steps(4);
    window.get_by_label(item).click();
    window.run_steps(4);
}

/// Types a path into the file browser and presses Enter.
fn name(window: &mut Harness<'_, App>, path: &str) {
    window.get_by_label("path").focus();
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.run_steps(1);
    window.get_by_label("path").type_text(path);
    window.run_steps(1);
    window.key_press(Key::Enter);
    window.run_steps(4);
}

fn change(window: &mut Harness<'_, App>) {
    let edit = Edit::AddNode { name: "new".into(), kind: "Constant".into(), at: None };
    assert!(window.state_mut().session_mut().apply(&edit));
    window.run_steps(2);
}

#[test]
fn the_3d_view_is_saved_as_a_picture_beside_the_graph() {
    crate::draws();
    let folder = scratch(&std::fs::read_to_string(graph("hello.ron")).expect("there"));
    let mut window = window(Some(folder.path().join("graph.ron")));
    window.state_mut().session_mut().set_cells(128);
    settle(&mut window);
    let Some(seen) = crate::picture(&mut window, "before_picture") else { return };
    menu(&mut window, "File", "Save picture");
    window.get_by_label("Save").click();
    window.run_steps(3);
    let saved = image::open(folder.path().join("graph.png")).expect("a picture").to_rgb8();
    assert!(saved.width() == 1920 && saved.height() > 500, "{:?}", saved.dimensions());
    let colours: std::collections::BTreeSet<[u8; 3]> = saved.pixels().step_by(997).map(|pixel| pixel.0).collect();
    assert!(colours.len() > 100, "{} colours", colours.len());
    // The top centre of the viewport is sky, in the window and in the picture.
    let ([r, g, b, _], [x, y, z]) = (seen.get_pixel(475, 90).0, saved.get_pixel(960, 20).0);
    let near = |a: u8, b: u8| a.abs_diff(b) < 12;
    assert!(near(r, x) && near(g, y) && near(b, z), "{:?} {:?}", [r, g, b], [x, y, z]);
    assert!(window.query_by_label_contains("graph.png, 1920 x ").is_some());
    menu(&mut window, "File", "Save picture");
    window.get_by_label("Save").click();
    window.run_steps(3);
    assert!(folder.path().join("graph 2.png").exists(), "no picture is written over");
}

#[test]
fn a_file_is_opened_by_its_path() {
    let folder = scratch(GRAPH);
    let path = folder.path().join("graph.ron");
    let mut window = window(None);
    press(&mut window, Modifiers::COMMAND, Key::O);
    name(&mut window, &path.display().to_string());
    assert_eq!(window.state().session().path(), Some(path.as_path()));
    assert!(window.query_by_label("path").is_none(), "the list is closed");
    assert!(window.query_all_by_label("graph.ron").next().is_some(), "the bar names the file");
}

#[test]
fn quitting_with_unsaved_work_asks_first() {
    let folder = scratch(GRAPH);
    let path = folder.path().join("graph.ron");
    let mut window = window(Some(path.clone()));
    change(&mut window);
    assert!(window.query_all_by_label("• graph.ron").next().is_some(), "the bar marks it");
    menu(&mut window, "File", "Quit");
    assert!(matches!(window.state().session().question(), Some(Question::Unsaved(_))));
    window.get_by_label("Cancel").click();
    window.run_steps(3);
    assert!(!window.state().session().is_over() && window.state().session().is_dirty());
    press(&mut window, Modifiers::COMMAND, Key::S);
    assert!(std::fs::read_to_string(&path).expect("there").contains("\"new\""));
    press(&mut window, Modifiers::COMMAND, Key::N);
    assert_eq!(window.state().session().path(), None);
    menu(&mut window, "File", "Save as…");
    assert_eq!(window.state().session().question(), Some(&Question::Name));
    window.key_press(Key::Escape);
    window.run_steps(3);
    menu(&mut window, "File", "Quit");
    assert!(window.state().session().is_over());
}

#[test]
fn an_example_is_opened_as_a_copy_that_finds_its_files() {
    crate::draws();
    let mut window = window(None);
    menu(&mut window, "File", "Examples…");
    window.query_all_by_label("A real landscape, eroded further").next().expect("offered").click();
    window.run_steps(4);
    let session = window.state().session();
    assert_eq!(session.document().source(), std::fs::read_to_string(graph("carve_dem.ron")).expect("there"));
    assert_eq!((session.path(), session.is_dirty(), session.document().problems()), (None, false, &[][..]));
    assert!(session.document().files().iter().all(|file| file.is_file()));
    // It is saved in the current folder, and not where the program keeps the files of examples.
    menu(&mut window, "File", "Save as…");
    let place =
        std::env::current_dir().and_then(|folder| folder.canonicalize()).expect("a folder").join("carve_dem.ron");
    let typed = window.query_all_by_role(Role::TextInput).filter_map(|field| field.value()).collect::<Vec<_>>();
    assert!(typed.contains(&place.display().to_string()), "{typed:?}");
}

#[test]
fn preview_resolution_and_theme_are_chosen_in_menus() {
    // In a folder of its own, as the choice is kept for the file.
    let folder = scratch(&std::fs::read_to_string(graph("hello.ron")).expect("there"));
    let file = folder.path().join("graph.ron");
    let mut window = window(Some(file.clone()));
    window.run_steps(2);
    assert!(window.query_by_label("24 km x 24 km").is_some(), "the extent of the world");
    let combos = window.query_all_by_role(Role::ComboBox);
    let preview = combos.into_iter().find(|combo| combo.value().as_deref() == Some("Preview 512 of 512"));
    preview.expect("the choice of cells").click();
    window.run_steps(3);
    window.get_by_label("256").click();
    window.run_steps(3);
    assert_eq!(window.state().session().cells(), 256);
    inner(&mut window, "View", "Theme", "Light");
    assert_eq!(window.ctx.theme(), egui::Theme::Light);
    inner(&mut window, "View", "Theme", "Same as the system");
    inner(&mut window, "View", "Preview resolution", "128");
    assert_eq!(window.state().session().cells(), 128);
    let mut again = self::window(Some(file));
    again.step();
    assert_eq!(again.state().session().cells(), 128, "kept for the file");
    assert!(
        again.query_all_by_role(Role::ComboBox).any(|combo| combo.value().as_deref() == Some("Preview 128 of 512"))
    );
    menu(&mut window, "Help", "Keys and mouse");
    assert!(window.query_by_label("Type a value with its unit; Enter applies, Escape cancels").is_some());
}

/// Chooses a canvas command in a menu of the window, with the pointer on the menu.
fn graph_menu(window: &mut Harness<'_, App>, outer: &str, item: &str) {
    window.get_by_role_and_label(Role::Button, outer).click();
    window.run_steps(3);
    // Switches have a button elsewhere as well.
    let at = window.query_all_by_label(item).map(|node| node.rect()).min_by(|a, b| a.left().total_cmp(&b.left()));
    click(window, at.expect("a line of the menu").center());
}

fn names(window: &Harness<'_, App>) -> Vec<String> {
    window.state().session().document().nodes().iter().map(|node| node.name.clone()).collect()
}

#[test]
fn every_key_command_is_in_the_menus() {
    crate::draws();
    let (mut window, _folder) = window_on(ROW);
    settle(&mut window);
    window.get_by_role_and_label(Role::Button, "Edit").click();
    window.run_steps(3);
    let grey = |window: &Harness<'_, App>, item: &str| window.get_by_label(item).accesskit_node().is_disabled();
    for item in ["Undo Ctrl+Z", "Redo Ctrl+Shift+Z", "Copy Ctrl+C", "Duplicate Ctrl+D", "Mute M", "Delete Delete"] {
        assert!(grey(&window, item), "{item}: nothing is selected");
    }
    for item in ["Paste Ctrl+V", "Select all Ctrl+A", "Find… Ctrl+F", "Add a node… Tab", "Arrange L"] {
        assert!(!grey(&window, item), "{item}");
    }
    window.key_press(Key::Escape);
    window.run_steps(3);

    window.state_mut().session_mut().select_only("steps");
    window.run_steps(3);
    graph_menu(&mut window, "Edit", "Duplicate Ctrl+D");
    assert_eq!(names(&window).len(), 5);
    assert_eq!(window.state().session().selected(), Some("steps2"));
    graph_menu(&mut window, "Edit", "Mute M");
    assert!(window.state().session().document().nodes().iter().any(|node| node.name == "steps2" && node.muted));
    window.get_by_role_and_label(Role::Button, "Edit").click();
    window.run_steps(3);
    let toggled = window.get_by_label("Mute M").accesskit_node().toggled();
    assert_eq!(toggled, Some(egui::accesskit::Toggled::True));
    look(&mut window, "menu_edit");
    window.key_press(Key::Escape);
    window.run_steps(3);
    graph_menu(&mut window, "Edit", "Cut Ctrl+X");
    assert_eq!(names(&window), ["ground", "steps", "lonely", "place"]);
    graph_menu(&mut window, "Edit", "Undo Ctrl+Z");
    assert_eq!(names(&window).len(), 5);
    graph_menu(&mut window, "Edit", "Add a node… Tab");
    type_text(&mut window, "ridged");
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert!(names(&window).contains(&"ridged".to_owned()));
}

#[test]
fn the_clipboard_answers_a_menu_wherever_the_pointer_is() {
    let (mut window, _folder) = window_on(ROW);
    settle(&mut window);
    let paste = |window: &mut Harness<'_, App>| {
        window.event(egui::Event::Paste("{ \"x\": Ridged }".to_owned()));
        window.run_steps(2);
    };
    window.hover_at(egui::pos2(600.0, 200.0));
    window.run_steps(3);
    paste(&mut window);
    assert_eq!(names(&window).len(), 4, "nobody has asked for it");
    window.get_by_role_and_label(Role::Button, "Edit").click();
    window.run_steps(3);
    window.get_by_label("Paste Ctrl+V").click();
    window.step();
    paste(&mut window);
    assert_eq!(names(&window).last().map(String::as_str), Some("x"));
}

#[test]
fn views_are_switched_by_the_menu() {
    crate::draws();
    let (mut window, _folder) = window_on(ROW);
    settle(&mut window);
    let before = window.get_by_label_contains("node ground:").rect().width();
    graph_menu(&mut window, "View", "Zoom to 100 % 1");
    let full = window.get_by_label_contains("node ground:").rect().width();
    assert!((full - 180.0).abs() < 0.5 && before < full, "{before} {full}");
    graph_menu(&mut window, "View", "Zoom to fit all Home");
    let home = window.get_by_label_contains("node ground:").rect().width();
    assert!((home - before).abs() < 0.5, "{home} {before}");
    graph_menu(&mut window, "View", "Map 2");
    graph_menu(&mut window, "View", "Contours C");
    window.get_by_role_and_label(Role::Button, "View").click();
    window.run_steps(3);
    let on = |window: &Harness<'_, App>, item: &str| {
        let mut nodes = window.query_all_by_role_and_label(Role::CheckBox, item);
        nodes.next().and_then(|node| node.accesskit_node().toggled())
    };
    assert_eq!(on(&window, "Map 2"), Some(egui::accesskit::Toggled::True));
    assert_eq!(on(&window, "3D 3"), Some(egui::accesskit::Toggled::False));
    assert_eq!(on(&window, "Contours C"), Some(egui::accesskit::Toggled::True));
    assert!(window.get_by_label("Shadows").accesskit_node().is_disabled(), "a map has none");
    look(&mut window, "menu_view");
    window.key_press(Key::Escape);
    window.run_steps(3);

    let panes = |window: &mut Harness<'_, App>, item: &str| {
        window.get_by_role_and_label(Role::Button, "View").click();
        window.run_steps(3);
        window.get_by_label_contains("Panes").click();
        window.run_steps(4);
        let of_menu = window.query_all_by_label(item).filter(|node| node.rect().left() < 600.0);
        of_menu.max_by(|a, b| a.rect().top().total_cmp(&b.rect().top())).expect("offered").click();
        window.run_steps(5);
    };
    let width = window.get_by_label("graph").rect().width();
    panes(&mut window, "Inspector");
    assert!((window.get_by_label("graph").rect().width() - width).abs() < 0.5, "another comes forth");
    panes(&mut window, "Problems");
    assert!((window.get_by_label("graph").rect().width() - width).abs() < 0.5, "the history comes forth");
    panes(&mut window, "History");
    assert!(window.get_by_label("graph").rect().width() > width + 100.0, "all are hidden");
    panes(&mut window, "Reset panes");
    assert!((window.get_by_label("graph").rect().width() - width).abs() < 0.5);
}

#[test]
fn a_key_maximises_the_pane_under_the_pointer() {
    crate::draws();
    let (mut window, _folder) = window_on(ROW);
    settle(&mut window);
    let width = |window: &Harness<'_, App>| window.query_by_label("graph").map(|node| node.rect().width());
    let usual = width(&window).expect("the graph is seen");
    let over_graph = window.get_by_label("graph").rect().center_bottom() - egui::vec2(0.0, 20.0);
    window.hover_at(over_graph);
    window.run_steps(3);
    press(&mut window, Modifiers::COMMAND, Key::Space);
    assert!(width(&window).is_some_and(|wide| wide > 1200.0), "{:?}", width(&window));
    assert!(window.query_by_label("Fit view").is_none() && window.query_by_label("Look").is_none());
    look(&mut window, "maximised_graph");
    // The keys of the graph work; an action of the viewport shows the other panes.
    press(&mut window, Modifiers::COMMAND, Key::A);
    assert_eq!(window.state().session().selection().count(), 4);
    graph_menu(&mut window, "View", "Contours C");
    assert_eq!(width(&window), Some(usual));
    window.hover_at(egui::pos2(500.0, 250.0));
    window.run_steps(3);
    press(&mut window, Modifiers::COMMAND, Key::Space);
    assert!(width(&window).is_none() && window.query_by_label("Fit view").is_some());
    press(&mut window, Modifiers::COMMAND, Key::Space);
    assert_eq!(width(&window), Some(usual));
}

/// A file that is dropped into the window.
#[derive(Debug)]
struct Dropped(std::path::PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &std::path::Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|error| error.to_string())
    }
}

#[test]
fn a_dropped_file_is_opened_or_refused_with_the_reason() {
    let folder = scratch(GRAPH);
    let drop = |window: &mut Harness<'_, App>, name: &str| {
        window.input_mut().dropped_files.push(std::sync::Arc::new(Dropped(folder.path().join(name))));
        window.run_steps(4);
    };
    let mut window = window(None);
    drop(&mut window, "photo.png");
    assert_eq!(window.state().session().path(), None);
    assert!(window.query_by_label_contains("it is not a graph").is_some());
    drop(&mut window, "graph.ron");
    assert_eq!(window.state().session().path(), Some(folder.path().join("graph.ron").as_path()));
    // Unsaved work is asked about first, as with File > Open.
    change(&mut window);
    drop(&mut window, "graph.ron");
    assert!(matches!(window.state().session().question(), Some(Question::Unsaved(_))));
}
