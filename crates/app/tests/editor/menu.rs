//! The menus: files are opened and saved, work is never lost without a question, examples are copies.

use egui::{Key, Modifiers, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::{App, Question};
use orograph_graph::Edit;

use crate::{graph, scratch, settle, window};

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

/// Types a path into the list of files and presses Enter.
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
fn the_land_is_saved_as_a_picture_beside_the_graph() {
    let folder = scratch(&std::fs::read_to_string(graph("hello.ron")).expect("there"));
    let mut window = window(Some(folder.path().join("graph.ron")));
    window.state_mut().session_mut().set_cells(128);
    settle(&mut window);
    let seen = crate::picture(&mut window, "before_picture");
    menu(&mut window, "File", "Save picture");
    window.get_by_label("Save").click();
    window.run_steps(3);
    let saved = image::open(folder.path().join("graph.png")).expect("a picture").to_rgb8();
    assert!(saved.width() == 1920 && saved.height() > 500, "{:?}", saved.dimensions());
    let colours: std::collections::BTreeSet<[u8; 3]> = saved.pixels().step_by(997).map(|pixel| pixel.0).collect();
    assert!(colours.len() > 100, "{} colours", colours.len());
    // The middle of the upper edge is sky, in the window as in the picture.
    let ([r, g, b, _], [x, y, z]) = (seen.get_pixel(475, 90).0, saved.get_pixel(960, 20).0);
    let near = |a: u8, b: u8| a.abs_diff(b) < 12;
    assert!(near(r, x) && near(g, y) && near(b, z), "{:?} {:?}", [r, g, b], [x, y, z]);
    assert!(window.query_by_label_contains("graph.png has the picture").is_some());
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
fn work_that_is_not_saved_is_asked_about() {
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
    let mut window = window(None);
    menu(&mut window, "File", "Examples…");
    window.query_all_by_label("A real place, worn further").next().expect("offered").click();
    window.run_steps(4);
    let session = window.state().session();
    assert_eq!(session.document().source(), std::fs::read_to_string(graph("carve_dem.ron")).expect("there"));
    assert_eq!((session.path(), session.is_dirty(), session.document().problems()), (None, false, &[][..]));
    assert!(session.document().files().iter().all(|file| file.is_file()));
    // It is saved where the person is, and not where the program keeps what it reads.
    menu(&mut window, "File", "Save as…");
    let place =
        std::env::current_dir().and_then(|folder| folder.canonicalize()).expect("a folder").join("carve_dem.ron");
    let typed = window.query_all_by_role(Role::TextInput).filter_map(|field| field.value()).collect::<Vec<_>>();
    assert!(typed.contains(&place.display().to_string()), "{typed:?}");
}

#[test]
fn previews_are_as_fine_as_chosen_and_the_theme_too() {
    let mut window = window(Some(graph("hello.ron")));
    window.run_steps(2);
    let combos = window.query_all_by_role(Role::ComboBox);
    let preview = combos.into_iter().find(|combo| combo.value().as_deref() == Some("512 (all) cells"));
    preview.expect("the choice of cells").click();
    window.run_steps(3);
    window.get_by_label("256").click();
    window.run_steps(3);
    assert_eq!(window.state().session().cells(), 256);
    menu(&mut window, "View", "Light");
    assert_eq!(window.ctx.theme(), egui::Theme::Light);
    menu(&mut window, "View", "As the system");
    menu(&mut window, "Help", "Keys and mouse");
    assert!(window.query_by_label("Typed with the unit: Enter takes it, Escape takes it back").is_some());
}
