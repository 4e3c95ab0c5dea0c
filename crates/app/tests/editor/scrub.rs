//! Tests of earlier moments of a live run: they are shown by a slider, and the run goes on as it was.

use std::collections::BTreeMap;

use egui::{Key, Modifiers, Pos2, accesskit::Role, pos2, vec2};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::{App, Simulation};
use orograph_graph::{Evaluator, EvaluatorOptions, Field, Value, Window};

use crate::{hand::drag, picture, scratch, settle, until, window};

const STORM: &str = r#"(
    world: (size: 960, cells: 96, seed: 3),
    nodes: {
        "base":   Perlin(wavelength: 700, amplitude: 90),
        "storm":  HydraulicPipe(height: "base", duration: 1000, rain: 60),
    },
    outputs: { "height": "storm" },
)"#;

/// The slider.
const SLIDER: &str = "time shown";

/// The heights that were shown at moments of the run, by the bits of their times, which are positive.
type Seen = BTreeMap<u64, Field>;

fn storm() -> (Harness<'static, App>, tempfile::TempDir) {
    let folder = scratch(STORM);
    let mut window = window(Some(folder.path().join("graph.ron")));
    window.state_mut().session_mut().set_cells(96);
    window.state_mut().session_mut().select_only("storm");
    settle(&mut window);
    for name in ["Map", "Live"] {
        window.get_by_label(name).click();
        window.run_steps(2);
    }
    until(&mut window, "it starts", |window| run(window).moment().is_some());
    (window, folder)
}

fn run<'a>(window: &'a Harness<'_, App>) -> &'a Simulation {
    window.state().session().simulation().expect("it runs live")
}

fn now(window: &Harness<'_, App>) -> f64 {
    run(window).moment().map_or(0.0, |moment| moment.now)
}

fn heights(window: &Harness<'_, App>) -> Field {
    let built = window.state().session().built("storm.height").expect("it is shown");
    built.value.as_field().expect("heights").clone()
}

/// Takes single steps until a time. Returns what was shown after each.
fn step_until(window: &mut Harness<'_, App>, time: f64) -> Seen {
    let mut seen = Seen::new();
    while now(window) < time {
        let before = now(window);
        seen.insert(before.to_bits(), heights(window));
        window.state_mut().session_mut().step_simulation(1);
        until(window, "it goes on", |window| now(window) > before);
    }
    seen
}

/// Waits until no more reports arrive.
fn pause(window: &mut Harness<'_, App>) {
    let mut last = (now(window), std::time::Instant::now());
    until(window, "it pauses", |window| {
        if now(window) != last.0 {
            last = (now(window), std::time::Instant::now());
        }
        last.1.elapsed() > std::time::Duration::from_millis(500)
    });
}

/// A point of the slider.
fn on_slider(window: &Harness<'_, App>, share: f32) -> Pos2 {
    let rect = window.get_by_role_and_label(Role::Slider, SLIDER).rect();
    pos2(rect.left() + share * rect.width(), rect.center().y)
}

fn said(window: &Harness<'_, App>) -> Option<String> {
    window.get_by_role_and_label(Role::Slider, SLIDER).value()
}

#[test]
fn an_earlier_moment_is_shown_and_the_run_goes_on() {
    let (mut window, _folder) = storm();
    assert!(window.query_by_label(SLIDER).is_none(), "nothing is earlier than the start");
    let seen = step_until(&mut window, 400.0);
    let (end, present) = (now(&window), heights(&window));
    assert!(run(&window).shown_time().is_none() && said(&window).as_deref() == Some("shows the present"));
    let times = window.state().session().earlier_times();
    assert!(times.len() > 5 && times[0] == 0.0 && times.iter().all(|time| *time < end), "{times:?}");

    // The mouse: to a moment in the middle, then to the start.
    let (from, to) = (on_slider(&window, (end / 1000.0) as f32), on_slider(&window, (end / 2000.0) as f32));
    drag(&mut window, from, to);
    let middle = run(&window).shown_time().expect("an earlier moment is shown");
    assert!(times.contains(&middle) && (middle - end / 2.0).abs() < 0.3 * end, "{middle} of {end}: {times:?}");
    assert!(
        said(&window).is_some_and(|text| text.starts_with("shows ") && text.contains(char::is_numeric)),
        "{:?}",
        said(&window)
    );
    assert!(window.query_by_label_contains(&said(&window).expect("a text")).is_some(), "also in the bar");
    assert!(heights(&window) != present);
    let start = on_slider(&window, 0.0) - vec2(20.0, 0.0);
    drag(&mut window, to, start);
    assert_eq!(run(&window).shown_time(), Some(0.0));

    // The keyboard: every moment is what was seen when the run was there.
    window.get_by_role_and_label(Role::Slider, SLIDER).focus();
    window.run_steps(2);
    let mut compared = 0;
    for time in &times {
        assert_eq!(run(&window).shown_time(), Some(*time));
        if let Some(before) = seen.get(&time.to_bits()) {
            assert!(heights(&window) == *before, "at {time}");
            compared += 1;
        }
        window.key_press_modifiers(Modifiers::NONE, Key::ArrowRight);
        window.run_steps(2);
    }
    assert!(compared == times.len(), "{compared} of {}", times.len());
    assert!(run(&window).shown_time().is_none() && heights(&window) == present, "after the last comes the present");
    assert_eq!(now(&window), end, "the run has waited");

    // It goes on while an earlier moment is shown, and is followed again from the end of the slider.
    window.key_press_modifiers(Modifiers::NONE, Key::ArrowLeft);
    window.run_steps(2);
    let last = run(&window).shown_time().expect("the last picture");
    let before = heights(&window);
    // slowly enough that it is still on its way when the button is clicked
    window.state_mut().session_mut().pace_simulation(120.0);
    window.get_by_label("Run").click();
    until(&mut window, "it goes on", |window| now(window) > end + 20.0);
    assert!(run(&window).shown_time() == Some(last) && heights(&window) == before);
    window.get_by_label("Pause").click();
    pause(&mut window);
    let from = on_slider(&window, (last / 1000.0) as f32);
    let to = on_slider(&window, 1.0) + vec2(20.0, 0.0);
    drag(&mut window, from, to);
    assert!(run(&window).shown_time().is_none() && heights(&window) != before);

    // The result is that of a build, whatever was looked at.
    window.state_mut().session_mut().pace_simulation(0.0);
    window.get_by_label("Run").click();
    until(&mut window, "it is over", |window| run(window).is_over());
    settle(&mut window);
    let document = window.state().session().document();
    let evaluator = Evaluator::new(EvaluatorOptions::default()).expect("threads");
    let (graph, whole) = (document.graph(), Window::whole(document.world()));
    let port = graph.port("storm.height").expect("an output");
    let built = evaluator.values(graph, std::path::Path::new(""), &[port], whole).expect("it runs").remove(0);
    assert!(built == Value::Field(heights(&window)));
    // Also after the end earlier moments can be shown.
    window.state_mut().session_mut().show_time(Some(0.0));
    assert!(Value::Field(heights(&window)) != built);
}

#[test]
fn the_map_and_the_3d_view_draw_the_earlier_moment() {
    crate::draws();
    let (mut window, _folder) = storm();
    step_until(&mut window, 300.0);
    for view in ["Map", "3D"] {
        window.get_by_label(view).click();
        let mut drawn = |time: Option<f64>, name: &str| {
            window.state_mut().session_mut().show_time(time);
            window.event(egui::Event::PointerGone);
            let shown = picture(&mut window, &format!("scrub_{view}_{name}"))?;
            Some(image::imageops::crop_imm(&shown, 200, 160, 500, 240).to_image().into_raw())
        };
        let Some(present) = drawn(None, "present") else { return };
        assert!(drawn(Some(0.0), "start").is_some_and(|start| start != present), "{view}");
        assert!(drawn(None, "again").is_some_and(|again| again == present), "{view}");
    }
}

#[test]
fn strokes_another_output_and_a_restart_show_the_present() {
    let (mut window, _folder) = storm();
    step_until(&mut window, 100.0);
    let back = |window: &mut Harness<'_, App>| {
        window.state_mut().session_mut().show_time(Some(0.0));
        window.run_steps(2);
        assert_eq!(run(window).shown_time(), Some(0.0));
    };
    back(&mut window);
    window.get_by_label("Brush").click();
    window.run_steps(2);
    let end = now(&window);
    drag(&mut window, pos2(440.0, 280.0), pos2(520.0, 300.0));
    assert_eq!(run(&window).shown_time(), None, "a stroke acts on the present");
    assert!(now(&window) >= end, "the run does not start over");

    back(&mut window);
    window.state_mut().session_mut().pin(Some("base.height".to_owned()));
    window.run_steps(2);
    assert_eq!(run(&window).shown_time(), None);
    assert_eq!(window.state().session().earlier_times(), [0.0; 0], "it is not of the run");
    window.state_mut().session_mut().pin(None);
    window.run_steps(2);

    back(&mut window);
    window.get_by_label("Restart").click();
    until(&mut window, "it restarts", |window| run(window).moment().is_some_and(|moment| moment.now == 0.0));
    assert_eq!((run(&window).shown_time(), window.state().session().earlier_times()), (None, Vec::new()));
}
