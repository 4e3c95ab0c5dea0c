//! Saved views: the camera of the 3D view under a name, kept for each graph file.

use std::path::PathBuf;

use egui::{Button, Ui};
use glam::DVec3;

use crate::{
    editor::{
        Session,
        window::{names::Named as _, state},
    },
    view::Orbit,
};

/// The stored file, and the most views in it.
const NAME: &str = "views.txt";
const MOST: usize = 400;

/// Views along the axes: name, azimuth and elevation of the camera.
const FIXED: [(&str, f64, f64); 5] = [
    ("From the south", 180.0, 20.0),
    ("From the west", 270.0, 20.0),
    ("From the north", 0.0, 20.0),
    ("From the east", 90.0, 20.0),
    ("From above", 180.0, 89.9),
];

/// A saved view.
#[derive(Clone, Debug, PartialEq)]
struct View {
    /// The graph file; empty for a graph without one.
    file: PathBuf,
    name: String,
    orbit: Orbit,
}

/// What was chosen in the menu.
pub(super) enum Chosen {
    /// A direction: azimuth and elevation, with the whole terrain in view.
    Towards([f64; 2]),
    /// A saved view.
    View(Orbit),
}

/// The saved views.
#[derive(Debug)]
pub(super) struct Views {
    views: Vec<View>,
}

impl Default for Views {
    fn default() -> Self {
        Self { views: stored() }
    }
}

/// The stored views.
fn stored() -> Vec<View> {
    state::read(NAME).unwrap_or_default().lines().filter_map(View::read).collect()
}

impl View {
    fn read(line: &str) -> Option<Self> {
        let mut parts = line.split('\t');
        let (file, name) = (PathBuf::from(parts.next()?), parts.next()?.to_owned());
        // earlier versions stored paths as they were typed
        let file = if file.as_os_str().is_empty() { file } else { state::whole_path(&file) };
        let numbers: Vec<f64> =
            parts.map(|part| part.parse().ok().filter(|v: &f64| v.is_finite())).collect::<Option<_>>()?;
        let [x, y, z, azimuth_deg, elevation_deg, distance, fov_deg] = numbers.try_into().ok()?;
        let orbit = Orbit { target: DVec3::new(x, y, z), azimuth_deg, elevation_deg, distance, fov_deg };
        (distance > 0.0).then_some(Self { file, name, orbit })
    }

    fn write(&self) -> String {
        let Orbit { target, azimuth_deg, elevation_deg, distance, fov_deg } = self.orbit;
        let numbers = [target.x, target.y, target.z, azimuth_deg, elevation_deg, distance, fov_deg];
        let numbers: Vec<String> = numbers.iter().map(f64::to_string).collect();
        format!("{}\t{}\t{}", self.file.display(), self.name, numbers.join("\t"))
    }
}

impl Views {
    /// The menu of views. `now` is the current one, if there is a terrain.
    pub(super) fn menu(&mut self, ui: &mut Ui, session: &Session, now: Option<Orbit>) -> Option<Chosen> {
        let file = session.path().map(state::whole_path).unwrap_or_default();
        let mut chosen = None;
        for (name, azimuth, elevation) in FIXED {
            if ui.button(name).clicked() {
                chosen = Some(Chosen::Towards([azimuth, elevation]));
            }
        }
        ui.separator();
        let mut removed = None;
        for (at, view) in self.views.iter().enumerate().filter(|(_, view)| view.file == file) {
            ui.horizontal(|ui| {
                let remove = ui.add(Button::new("✖").small().frame(false)).named(format!("Remove {}", view.name));
                if remove.on_hover_text("Remove the view").clicked() {
                    removed = Some(at);
                }
                if ui.button(&view.name).clicked() {
                    chosen = Some(Chosen::View(view.orbit));
                }
            });
        }
        if let Some(at) = removed {
            let view = self.views.remove(at);
            self.change(|views| views.retain(|other| other.file != view.file || other.name != view.name));
        }
        let save = ui.add_enabled(now.is_some(), Button::new("Save this view"));
        if let Some(orbit) = now.filter(|_| save.clicked()) {
            self.add(file, orbit);
            ui.close();
        }
        if chosen.is_some() {
            ui.close();
        }
        chosen
    }

    fn add(&mut self, file: PathBuf, orbit: Orbit) {
        self.change(|views| {
            let is_free = |name: &String| views.iter().all(|view| view.file != file || view.name != *name);
            let name = (1..).map(|number| format!("View {number}")).find(is_free).unwrap_or_default();
            views.push(View { file, name, orbit });
            let more = views.len().saturating_sub(MOST);
            views.drain(..more);
        });
    }

    /// Changes the stored views: other windows may have changed them since they were read.
    fn change(&mut self, change: impl FnOnce(&mut Vec<View>)) {
        self.views = stored();
        change(&mut self.views);
        let lines: Vec<String> = self.views.iter().map(View::write).collect();
        state::write(NAME, &lines.join("\n"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_are_read_as_they_are_written() {
        let orbit = Orbit {
            target: DVec3::new(1.5, -2.0, 3e4),
            azimuth_deg: 160.0,
            elevation_deg: 20.25,
            distance: 4321.0,
            fov_deg: 34.0,
        };
        let view = View { file: PathBuf::from("/land/a graph.ron"), name: "View 2".to_owned(), orbit };
        assert_eq!(View::read(&view.write()), Some(view.clone()));
        for line in
            ["", "a\tb", "a\tb\t1\t2\t3\t4\t5\t0\t7", "a\tb\t1\t2\t3\t4\t5\tNaN\t7", "a\tb\t1\t2\t3\t4\t5\t6\t7\t8"]
        {
            assert_eq!(View::read(line), None, "{line}");
        }
    }
}
