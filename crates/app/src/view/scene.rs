//! The scene: camera, light and drawing options of the 3D view.

use super::{camera::Camera, error::ViewError, sun::Sun};

/// The camera, light and drawing options of a picture; all may differ from picture to picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// The camera.
    pub camera: Camera,
    /// The sun.
    pub sun: Sun,
    /// Vertical exaggeration; 1 is true to scale.
    pub exaggeration: f64,
    /// The colours of the terrain.
    pub colouring: Colouring,
    /// Contour lines, if drawn.
    pub contours: Option<Contours>,
    /// Elevation of the sea in metres, if there is one.
    pub sea_level: Option<f64>,
    /// Amount of haze: 0 is perfectly clear air, 1 a fine day.
    pub haze: f64,
    /// Unevenness and texture of the ground below the size of a cell: 0 for none.
    pub texture: f64,
    /// Fraction of the terrain in the shadow of clouds, 0 to 1.
    pub clouds: f64,
    /// The background behind the terrain.
    pub background: Background,
    /// True to draw shadows.
    pub shadows: bool,
    /// Opacity of a mask over the colours, 0 to 1.
    pub mask_opacity: f32,
    /// Exposure in stops above the default.
    pub exposure: f32,
    /// Time in seconds, which moves the ripples of water; equal times give equal pictures.
    pub seconds: f32,
    /// Target length of a triangle's side in pixels.
    pub detail_px: f64,
    /// Colours the terrain by level of detail, for debugging.
    pub show_levels: bool,
}

impl Scene {
    /// The default scene: true to scale, on a clear late afternoon.
    #[must_use]
    pub fn new(camera: Camera) -> Self {
        Self {
            camera,
            sun: Sun::default(),
            exaggeration: 1.0,
            colouring: Colouring::default(),
            contours: None,
            sea_level: None,
            haze: 1.0,
            texture: 1.0,
            clouds: 0.0,
            background: Background::Sky,
            shadows: true,
            mask_opacity: 0.6,
            exposure: 0.0,
            seconds: 0.0,
            detail_px: 4.0,
            show_levels: false,
        }
    }

    /// Refuses invalid numbers.
    pub(super) fn check(&self) -> Result<(), ViewError> {
        let Camera { eye, forward, fov_y } = self.camera;
        let level = forward.x * forward.x + forward.z * forward.z;
        let sees = eye.is_finite() && forward.is_finite() && level > 0.0 && (1e-6..3.1).contains(&fov_y);
        let sun = self.sun.azimuth_deg.is_finite() && self.sun.elevation_deg.is_finite();
        let sea = self.sea_level.unwrap_or(0.0);
        let rest = [self.haze, self.texture, self.clouds, self.detail_px, sea].into_iter().all(f64::is_finite);
        let refuse = |what: &str| Err(ViewError::Scene(format!("{what} is invalid")));
        match () {
            () if !sees => refuse("the camera position or target"),
            () if !sun => refuse("the position of the sun"),
            () if !(1e-6..=1e6).contains(&self.exaggeration) => refuse("the vertical exaggeration"),
            () if !rest || !self.exposure.is_finite() => refuse("haze, texture, clouds, detail, sea level or exposure"),
            () => Ok(()),
        }
    }
}

/// The background behind the terrain.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Background {
    /// Sky, and a plain below it, lit by the sun.
    #[default]
    Sky,
    /// A uniform linear RGB colour.
    Plain([f32; 3]),
}

/// The colours of the terrain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Colouring {
    /// The colours of the terrain if it has some, natural tints otherwise.
    #[default]
    Own,
    /// Natural tints by slope and height.
    Natural,
    /// The tints of a physical map, by height.
    Map,
    /// Uniform light grey, to judge form alone.
    Clay,
}

/// Contour lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contours {
    /// Metres between lines; every fifth is heavier.
    pub interval: f64,
    /// Opacity, 0 to 1.
    pub opacity: f32,
}

impl Contours {
    /// Contours for a range of heights in metres, at a round interval that gives about twenty lines.
    #[must_use]
    pub fn over(range: f64) -> Self {
        let wanted = if range.is_finite() && range > 0.0 { range / 20.0 } else { 1.0 };
        let ten = orograph_nodes::numerics::math::pow(10.0, orograph_nodes::numerics::math::log10(wanted).floor());
        let interval = [1.0, 2.0, 5.0, 10.0].map(|step| step * ten).into_iter().find(|step| *step >= wanted);
        Self { interval: interval.unwrap_or(wanted), opacity: 0.45 }
    }
}

#[cfg(test)]
mod tests {
    use super::Contours;

    #[test]
    fn contours_lie_at_round_heights() {
        for (range, interval) in [(2000.0, 100.0), (3500.0, 200.0), (7.0, 0.5), (0.0, 1.0), (f64::NAN, 1.0)] {
            assert!((Contours::over(range).interval - interval).abs() < 1e-9, "{range}");
        }
    }
}
