//! Tests of opening files with problems of the file, the machine or the window.

use std::{collections::BTreeSet, fs, path::PathBuf, thread, time::Duration};

use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::{App, Journals, NodeState, Session};
use orograph_graph::{Edit, Input, Node, Output, PortType, Registry};

use crate::{built, device, graph, look, picture, scratch, settle, wait, window};

#[test]
fn a_file_opens_and_its_nodes_are_built() {
    let window = built("hello.ron", 64);
    let session = window.state().session();
    assert_eq!(session.shown().as_deref(), Some("rivers.height"));
    for node in ["ground", "rise", "rivers"] {
        assert_eq!(session.node(node).state, NodeState::Fresh, "{node}");
    }
    assert_eq!(session.built("rivers.height").map(|built| built.cells), Some(64));
}

fn build(session: &mut Session) {
    wait("all is built", || {
        session.poll();
        !session.is_busy()
    });
}

fn failure(session: &Session, node: &str) -> String {
    match session.node(node).state {
        NodeState::Failed { message, .. } => message,
        other => panic!("{node}: {other:?}"),
    }
}

#[test]
fn a_missing_file_is_named_and_read_once_it_exists() {
    let folder = scratch(
        r#"(world: (size: "4 km", cells: 64), nodes: { "dem": Import(file: "land.tif"), "b": Terrace(height: "dem"), "c": Perlin }, outputs: { "h": "b" })"#,
    );
    let path = folder.path().join("graph.ron");
    let mut session =
        Session::open(Some(path), orograph_nodes::registry(), orograph::build::storage::in_memory(), || {})
            .expect("it opens");
    session.keep(Journals::with_state(folder.path()), || {});
    build(&mut session);
    for node in ["dem", "b"] {
        let message = failure(&session, node);
        assert!(message.contains("land.tif") && message.contains("dem"), "{message}");
    }
    assert_eq!(session.node("c").state, NodeState::Fresh, "what does not read it is built");
    fs::copy(graph("../tests/data/glencoe_128.tif"), folder.path().join("land.tif")).expect("copied");
    wait("the file is read and all is built", || {
        session.poll();
        ["dem", "b", "c"].iter().all(|node| session.node(node).state == NodeState::Fresh)
    });
}

static PANICS: Node = Node {
    id: "Panics",
    category: "generate",
    inputs: &[Input::needs("height", PortType::Height, "H.")],
    outputs: &[Output::gives("height", PortType::Height, "H.")],
    cpu: |_| panic!("out of luck"),
    ..Node::DEFAULT
};

#[test]
fn a_panicking_node_does_not_affect_others() {
    let folder = scratch(
        r#"(world: (size: "4 km", cells: 64), nodes: { "a": Perlin, "bad": Panics(height: "a"), "b": Terrace(height: "bad"), "c": Terrace(height: "a") }, outputs: { "h": "b" })"#,
    );
    let registry = orograph_nodes::registry();
    let registry = Registry::new(registry.nodes().iter().copied().chain([&PANICS]));
    let mut session =
        Session::open(Some(folder.path().join("graph.ron")), registry, orograph::build::storage::in_memory(), || {})
            .expect("it opens");
    build(&mut session);
    assert!(failure(&session, "bad").contains("out of luck"));
    assert!(matches!(session.node("b").state, NodeState::Failed { at: Some(at), .. } if at == "bad"));
    assert_eq!([session.node("a").state, session.node("c").state], [NodeState::Fresh, NodeState::Fresh]);
    // The worker continues.
    session.apply(&Edit::Connect { from: "a".into(), to: "b".into(), input: "height".into() });
    build(&mut session);
    assert_eq!(session.node("b").state, NodeState::Fresh);
}

#[test]
fn a_huge_world_is_only_a_problem() {
    let folder = scratch("(world: (cells: 40000), nodes: { \"a\": Constant }, outputs: { \"h\": \"a\" })");
    let mut window = window(Some(folder.path().join("graph.ron")));
    window.run_steps(4);
    assert!(window.state().session().document().has_errors());
    window.get_by_label("Problems (1)");
}

#[test]
fn terrain_wider_than_textures_is_shown() {
    crate::draws();
    let folder = scratch(
        r#"(world: (size: ("200 km", "400 m"), cells: (20000, 40)), nodes: { "a": Perlin(wavelength: "9 km") }, outputs: { "h": "a" })"#,
    );
    let mut window = window(Some(folder.path().join("graph.ron")));
    window.state_mut().session_mut().set_cells(20_000);
    settle(&mut window);
    assert_eq!(window.state().session().built("a.height").map(|built| built.cells), Some(20_000));
    let Some(land) = picture(&mut window, "wide") else { return };
    window.get_by_label("Map").click();
    let Some(map) = picture(&mut window, "wide_map") else { return };
    for (name, picture) in [("3D", &land), ("map", &map)] {
        let pane = (100..440).flat_map(|y| (20..900).map(move |x| picture.get_pixel(x, y).0));
        let colours = pane.collect::<BTreeSet<[u8; 4]>>().len();
        assert!(colours > 30, "{name}: {colours}");
    }
}

#[test]
fn without_a_graphics_device_the_viewport_is_a_map() {
    crate::draws();
    let file = graph("hello.ron");
    let mut window: Harness<'static, App> =
        Harness::builder().with_size([1280.0, 800.0]).with_max_steps(64).build_eframe(|context| {
            context.wgpu_render_state = None;
            App::new(context, Some(file), orograph::build::storage::in_memory()).expect("the file can be read")
        });
    window.state_mut().session_mut().set_cells(64);
    settle(&mut window);
    window.get_by_label("3D").hover();
    window.run_steps(40);
    assert!(window.query_by_label_contains("no graphics driver was found").is_some(), "it says why");
    let Some(map) = picture(&mut window, "no_device") else { return };
    assert!((100..400).map(|y| map.get_pixel(475, y).0).collect::<BTreeSet<[u8; 4]>>().len() > 30);
}

#[test]
fn a_lost_graphics_device_loses_no_work() {
    crate::draws();
    if device::skips("a graphics device that is lost") {
        return;
    }
    let folder = scratch("(world: (cells: 64), nodes: { \"a\": Perlin }, outputs: { \"h\": \"a\" })");
    let path: PathBuf = folder.path().join("graph.ron");
    let mut state = None;
    let mut window = {
        let state = &mut state;
        crate::harness([1280.0, 800.0]).build_eframe(move |context| {
            state.clone_from(&context.wgpu_render_state);
            App::new(context, Some(path), orograph::build::storage::in_memory()).expect("the file can be read")
        })
    };
    settle(&mut window);
    window.run_steps(8);
    state.expect("there is a device").device.destroy();
    let add = Edit::SetText { node: "a".into(), name: "wavelength".into(), text: "700".into() };
    assert!(window.state_mut().session_mut().apply(&add));
    settle(&mut window);
    for _ in 0..20 {
        window.step();
        thread::sleep(Duration::from_millis(10));
    }
    let session = window.state_mut().session_mut();
    assert!(session.save());
    assert!(fs::read_to_string(folder.path().join("graph.ron")).expect("there").contains("700"));
}

#[test]
fn a_window_has_as_many_panes_as_fit() {
    crate::draws();
    for (name, size, scale, seen) in [
        ("window_large", [3000.0, 2000.0], 1.0, [true, true, true]),
        ("window_wide", [1280.0, 800.0], 1.0, [true, true, true]),
        ("window_scaled", [853.0, 533.0], 1.5, [true, true, true]),
        ("window_tall", [420.0, 900.0], 1.0, [true, true, true]),
        ("window_small", [400.0, 300.0], 1.0, [true, false, false]),
        ("window_tiny", [200.0, 200.0], 1.0, [true, false, false]),
        ("window_of_scale_3", [427.0, 267.0], 3.0, [true, false, false]),
    ] {
        let mut window = window(Some(graph("hello.ron")));
        window.set_size(size.into());
        window.set_pixels_per_point(scale);
        window.state_mut().session_mut().set_cells(64);
        window.state_mut().session_mut().select_only("rivers");
        settle(&mut window);
        look(&mut window, name);
        let has = |window: &Harness<'_, App>| {
            ["Fit view", "graph", "uplift"].map(|label| window.query_all_by_label(label).next().is_some())
        };
        assert_eq!(has(&window), seen, "{name}");
        if seen != [true; 3] {
            for (tab, seen) in [("Graph", [false, true, false]), ("Inspector", [false, false, true])] {
                window.get_by_label(tab).click();
                window.run_steps(4);
                assert_eq!(has(&window), seen, "{name}: {tab}");
                look(&mut window, &format!("{name}_{}", tab.to_lowercase()));
            }
        }
    }
}
