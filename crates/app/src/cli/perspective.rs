//! The options of `orograph render --view 3d`.

use orograph_graph::{Field, Unit};

use super::render::wrong_view;
use crate::report::failure::Failure;

/// Options of `--view 3d`.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Options of --view 3d")]
pub struct Perspective {
    /// Size of the picture in pixels [default: 1280x720]
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Camera azimuth: degrees clockwise from north, seen from the centre of the terrain [default: 160]
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true, value_parser = number)]
    azimuth: Option<f64>,
    /// Camera elevation: degrees above the horizontal, 1 to 89 [default: 20]
    #[arg(long, value_name = "DEGREES", value_parser = number)]
    elevation: Option<f64>,
    /// Distance of the camera from the centre of the terrain; by default all of the terrain just fits
    #[arg(long, value_name = "METRES", value_parser = metres)]
    distance: Option<f64>,
    /// Position of the sun: degrees clockwise from north and above the horizon [default: 240,30]
    #[arg(long, value_name = "AZIMUTH,ELEVATION", allow_hyphen_values = true, value_parser = pair)]
    sun: Option<[f64; 2]>,
    /// Vertical exaggeration; 1 is true to scale [default: 1]
    #[arg(long, value_name = "FACTOR", value_parser = number)]
    exaggeration: Option<f64>,
    /// Colours of the terrain without `--colour` [default: natural]
    #[arg(long, value_enum, conflicts_with = "colour")]
    tints: Option<Tints>,
    /// Output of the graph with the colours of the terrain, without lighting
    #[arg(long, value_name = "NAME")]
    pub colour: Option<String>,
    /// Output of the graph with water depths in metres
    #[arg(long, value_name = "NAME")]
    pub water: Option<String>,
    /// Contour interval in metres
    #[arg(long, value_name = "METRES", value_parser = metres)]
    contours: Option<f64>,
    /// Amount of haze, 0 for none [default: 1]
    #[arg(long, value_name = "AMOUNT", value_parser = number)]
    haze: Option<f64>,
    /// Unevenness and texture of the ground below the size of a cell, 0 for none [default: 1]
    #[arg(long, value_name = "AMOUNT", value_parser = number)]
    texture: Option<f64>,
    /// Fraction of the terrain in the shadow of clouds, 0 to 1 [default: 0]
    #[arg(long, value_name = "FRACTION", value_parser = number)]
    clouds: Option<f64>,
    /// Exposure in stops: brighter above 0, darker below [default: 0]
    #[arg(long, value_name = "STOPS", allow_hyphen_values = true, value_parser = number)]
    exposure: Option<f64>,
}

/// Colours of a terrain without an output of colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Tints {
    /// Forest, meadow, rock and snow, by height and slope
    Natural,
    /// Physical map colours, by height
    Map,
    /// Uniform grey
    Clay,
}

/// The fields that the 3D view draws.
#[cfg_attr(not(feature = "editor"), expect(dead_code, reason = "only the view reads them"))]
#[derive(Clone, Debug)]
pub struct Seen {
    pub height: Field,
    pub colour: Option<Field>,
    pub water: Option<Field>,
}

fn number(text: &str) -> Result<f64, String> {
    match text.trim().trim_end_matches('°').parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err("not a number".to_owned()),
    }
}

fn metres(text: &str) -> Result<f64, String> {
    Unit::Metres.parse(text).map_err(|error| error.to_string())
}

fn pair(text: &str) -> Result<[f64; 2], String> {
    let (a, b) = text.split_once(',').ok_or("write two angles with a comma between, such as `240,30`")?;
    Ok([number(a)?, number(b)?])
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let side = |text: &str| match text.trim().parse::<u32>() {
        Ok(pixels @ 1..=8192) => Ok(pixels),
        _ => Err(format!("`{text}` is not a number of pixels from 1 to 8192")),
    };
    let (w, h) = text.split_once(['x', 'X', '×']).ok_or("write width and height, such as `1280x720`")?;
    Ok([side(w)?, side(h)?])
}

impl Perspective {
    /// The name of the first option that was given.
    fn given(&self) -> Option<&'static str> {
        let options = [
            ("--size", self.size.is_some()),
            ("--azimuth", self.azimuth.is_some()),
            ("--elevation", self.elevation.is_some()),
            ("--distance", self.distance.is_some()),
            ("--sun", self.sun.is_some()),
            ("--exaggeration", self.exaggeration.is_some()),
            ("--tints", self.tints.is_some()),
            ("--colour", self.colour.is_some()),
            ("--water", self.water.is_some()),
            ("--contours", self.contours.is_some()),
            ("--haze", self.haze.is_some()),
            ("--texture", self.texture.is_some()),
            ("--clouds", self.clouds.is_some()),
            ("--exposure", self.exposure.is_some()),
        ];
        options.into_iter().find(|(_, given)| *given).map(|(option, _)| option)
    }

    /// Refuses these options with another view.
    pub fn check_unused(&self) -> Result<(), Failure> {
        self.given().map_or(Ok(()), |option| Err(wrong_view(option)))
    }

    /// Refuses numbers outside their range.
    pub fn check(&self) -> Result<(), Failure> {
        let within = |option: &str, value: Option<f64>, low: f64, high: f64| match value {
            Some(value) if !(low..=high).contains(&value) => {
                Err(Failure::wrong(format!("`{option} {value}` is not from {low} to {high}")))
            }
            _ => Ok(()),
        };
        within("--elevation", self.elevation, 1.0, 89.0)?;
        within("--exaggeration", self.exaggeration, 0.01, 1000.0)?;
        within("--haze", self.haze, 0.0, 100.0)?;
        within("--texture", self.texture, 0.0, 10.0)?;
        within("--clouds", self.clouds, 0.0, 1.0)?;
        within("--exposure", self.exposure, -10.0, 10.0)?;
        within("--distance", self.distance, 1e-3, 1e9)?;
        within("--contours", self.contours, 1e-3, 1e6)
    }

    /// The picture, in linear RGB.
    #[cfg(not(feature = "editor"))]
    pub fn picture(&self, _: &Seen) -> Result<Field, Failure> {
        Err(Failure::unable("this build has no 3D view")
            .hint("build the program with its feature `editor`, which is on by default"))
    }

    /// The picture, in linear RGB.
    #[cfg(feature = "editor")]
    pub fn picture(&self, seen: &Seen) -> Result<Field, Failure> {
        use std::sync::Arc;

        use crate::view::{Cover, Offscreen, Orbit, Terrain};

        let failed = |error: crate::view::ViewError| match error {
            crate::view::ViewError::Terrain(_) => Failure::wrong(error.to_string()).hint(error.remedy()),
            _ => Failure::unable(error.to_string()).hint(error.remedy()),
        };
        let cover = Cover { colour: seen.colour.as_ref(), water: seen.water.as_ref(), ..Cover::default() };
        let terrain = Terrain::new(&seen.height).and_then(|terrain| terrain.covered(cover)).map_err(failed)?;
        let size = self.size.unwrap_or([1280, 720]);
        let exaggeration = self.exaggeration.unwrap_or(1.0);
        let mut orbit = Orbit::framing(&terrain, exaggeration, size);
        orbit.azimuth_deg = self.azimuth.unwrap_or(orbit.azimuth_deg);
        orbit.elevation_deg = self.elevation.unwrap_or(orbit.elevation_deg);
        orbit = orbit.framed(&terrain, exaggeration, size);
        if let Some(distance) = self.distance {
            orbit.target = terrain.middle(exaggeration);
            orbit.distance = distance;
            orbit.limit(&terrain, exaggeration);
        }
        let scene = self.scene(orbit.camera(), exaggeration, seen.height.window().world.sea_level);
        let bytes = Offscreen::new().and_then(|device| device.picture(&Arc::new(terrain), &scene, size));
        Ok(crate::export::picture::of_codes(&bytes.map_err(failed)?, size))
    }

    #[cfg(feature = "editor")]
    fn scene(&self, camera: crate::view::Camera, exaggeration: f64, sea_level: Option<f64>) -> crate::view::Scene {
        use crate::view::{Colouring, Contours, Scene, Sun};

        let mut scene = Scene { exaggeration, sea_level, ..Scene::new(camera) };
        if let Some([azimuth_deg, elevation_deg]) = self.sun {
            scene.sun = Sun { azimuth_deg, elevation_deg };
        }
        scene.colouring = match self.tints {
            None | Some(Tints::Natural) => Colouring::Own,
            Some(Tints::Map) => Colouring::Map,
            Some(Tints::Clay) => Colouring::Clay,
        };
        if let Some(interval) = self.contours {
            scene.contours = Some(Contours { interval, ..Contours::over(1.0) });
        }
        // no later frame follows
        scene.detail_px = 1.5;
        scene.haze = self.haze.unwrap_or(scene.haze);
        scene.texture = self.texture.unwrap_or(scene.texture);
        scene.clouds = self.clouds.unwrap_or(scene.clouds);
        scene.exposure = self.exposure.map_or(scene.exposure, |stops| stops as f32);
        scene
    }
}
