//! Cameras for orbiting and flying: plain data and arithmetic, independent of a window.

use glam::DVec3;
use orograph_nodes::numerics::math;

use super::{
    camera::{Camera, Ray, direction},
    terrain::Terrain,
};

/// The default vertical field of view. It is narrower than that of most 3D programs, so that mountains do not look like
/// miniatures.
const FOV_DEG: f64 = 34.0;

/// The steepest view down: slightly less than vertical, so that the picture keeps its azimuth.
const MOST_ELEVATION_DEG: f64 = 89.9;

/// A camera that orbits a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// The point in the centre of the view.
    pub target: DVec3,
    /// Azimuth of the camera as seen from the target, in degrees clockwise from north.
    pub azimuth_deg: f64,
    /// Elevation of the camera above the horizontal plane of the target, 0 to 90 degrees.
    pub elevation_deg: f64,
    /// Metres from the target to the camera.
    pub distance: f64,
    /// Vertical field of view in degrees.
    pub fov_deg: f64,
}

impl Orbit {
    /// A view from the south of the whole terrain.
    #[must_use]
    pub fn framing(terrain: &Terrain, exaggeration: f64, size: [u32; 2]) -> Self {
        let start = Self {
            target: terrain.middle(exaggeration),
            azimuth_deg: 160.0,
            elevation_deg: 20.0,
            distance: 1.0,
            fov_deg: FOV_DEG,
        };
        start.framed(terrain, exaggeration, size)
    }

    /// The same direction, with the target and the distance at which the whole terrain just fits.
    #[must_use]
    pub fn framed(self, terrain: &Terrain, exaggeration: f64, size: [u32; 2]) -> Self {
        /// Fraction of the picture that stays free around the terrain.
        const MARGIN: f64 = 0.04;
        /// Fraction of the free height that is above the terrain.
        const SKY: f64 = 0.68;
        let points = terrain.hull(exaggeration);
        let mut framed = Self { target: terrain.middle(exaggeration), distance: terrain.size_m()[0], ..self };
        // the visible outline of the terrain changes slightly with distance; a few rounds converge
        for _ in 0..8 {
            let camera = framed.camera();
            let [tx, ty] = camera.half_extent(size).map(|t| t * (1.0 - MARGIN));
            let (right, up) = (camera.right(), camera.up());
            let mut sides = [[f64::NEG_INFINITY; 2]; 2];
            for point in &points {
                let to = *point - framed.target;
                let depth = to.dot(camera.forward);
                for (axis, (along, t)) in [(to.dot(right), tx), (to.dot(up), ty)].into_iter().enumerate() {
                    // the distance at which this point is inside both sides
                    for (side, sign) in [(0, 1.0), (1, -1.0)] {
                        sides[axis][side] = sides[axis][side].max(sign * along / t - depth);
                    }
                }
            }
            let needed = sides.map(|[a, b]| 0.5 * (a + b));
            let shift = |axis: usize, t: f64| 0.5 * (sides[axis][0] - sides[axis][1]) * t;
            framed.distance = needed[0].max(needed[1]).max(terrain.cell_m());
            let free = (framed.distance - needed[1]) * ty;
            framed.target += right * shift(0, tx) + up * (shift(1, ty) + (2.0 * SKY - 1.0) * free);
        }
        framed
    }

    /// The camera.
    #[must_use]
    pub fn camera(&self) -> Camera {
        let back = direction(self.azimuth_deg.to_radians(), self.elevation_deg.to_radians());
        Camera::looking_at(self.target + back * self.distance, self.target, self.fov_deg.to_radians())
    }

    /// Orbits by a drag in pixels, as if it held the terrain. A drag over the height of the picture is half a turn.
    pub fn drag(&mut self, pixels: [f64; 2], size: [u32; 2]) {
        let degrees = 180.0 / f64::from(size[1].max(1));
        self.azimuth_deg = (self.azimuth_deg + pixels[0] * degrees).rem_euclid(360.0);
        self.elevation_deg = (self.elevation_deg + pixels[1] * degrees).clamp(0.5, MOST_ELEVATION_DEG);
    }

    /// Pans along the ground by a drag in pixels: the point under the pointer stays under it.
    pub fn pan(&mut self, pixels: [f64; 2], size: [u32; 2]) {
        let camera = self.camera();
        let [_, ty] = camera.half_extent(size);
        let metres = 2.0 * ty * self.distance / f64::from(size[1].max(1));
        let ahead = direction(self.azimuth_deg.to_radians() + std::f64::consts::PI, 0.0);
        // a pixel covers more ground the flatter the view; limited, because near level it would cover an unlimited
        // length
        let slant = math::sin(self.elevation_deg.to_radians()).max(0.2);
        self.target += camera.right() * (-pixels[0] * metres) + ahead * (pixels[1] * metres / slant);
    }

    /// Zooms by notches of a wheel, each by a sixth; `towards` keeps its place in the picture.
    pub fn scroll(&mut self, notches: f64, towards: Option<DVec3>) {
        let factor = math::exp2(-0.25 * notches.clamp(-40.0, 40.0));
        self.distance *= factor;
        if let Some(place) = towards.filter(|place| place.is_finite()) {
            self.target = place + (self.target - place) * factor;
        }
    }

    /// Keeps the target near the terrain, the camera above it, and the distance between a few cells and a multiple of
    /// the terrain's extent.
    pub fn limit(&mut self, terrain: &Terrain, exaggeration: f64) {
        let [w, h] = terrain.size_m();
        let [low, high] = [terrain.base(exaggeration), terrain.range()[1]].map(|height| height * exaggeration);
        // A view of the whole terrain can have its target beside it, which must not jump when the first drag begins.
        let beside = 0.5 * w.max(h);
        let (least, most) = (DVec3::new(0.0, low, 0.0), DVec3::new(w, high, h));
        self.target = self.target.clamp(least - beside, most + beside);
        self.distance = self.distance.clamp(4.0 * terrain.cell_m(), 12.0 * (w + h + high - low));
        self.elevation_deg = self.elevation_deg.clamp(0.5, MOST_ELEVATION_DEG);
        let clear = 2.0 * terrain.cell_m();
        let eye = self.camera().eye;
        let inside = (0.0..=w).contains(&eye.x) && (0.0..=h).contains(&eye.z);
        let floor = if inside { terrain.height_at([eye.x, eye.z]) * exaggeration } else { low };
        if eye.y < floor + clear {
            self.target.y += floor + clear - eye.y;
        }
    }
}

/// The pressed keys in fly mode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FlyKeys {
    /// Forward.
    pub forward: bool,
    /// Backward.
    pub back: bool,
    /// Left.
    pub left: bool,
    /// Right.
    pub right: bool,
    /// Up.
    pub up: bool,
    /// Down.
    pub down: bool,
    /// Four times the speed.
    pub fast: bool,
}

/// A camera that flies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fly {
    /// Its position.
    pub eye: DVec3,
    /// Heading, in degrees clockwise from north.
    pub heading_deg: f64,
    /// Pitch, in degrees above level.
    pub pitch_deg: f64,
    /// Speed in metres per second.
    pub speed: f64,
    /// Vertical field of view in degrees.
    pub fov_deg: f64,
}

impl Fly {
    /// Starts from an orbiting camera, at a speed that covers its distance in four seconds.
    #[must_use]
    pub fn from_orbit(orbit: &Orbit) -> Self {
        Self {
            eye: orbit.camera().eye,
            heading_deg: (orbit.azimuth_deg + 180.0).rem_euclid(360.0),
            pitch_deg: -orbit.elevation_deg,
            speed: 0.25 * orbit.distance,
            fov_deg: orbit.fov_deg,
        }
    }

    /// Switches to orbiting the terrain in the centre of the view, or a point ahead if there is none.
    #[must_use]
    pub fn orbit(&self, terrain: &Terrain, exaggeration: f64) -> Orbit {
        let camera = self.camera();
        let ray = Ray { origin: camera.eye, direction: camera.forward };
        let hit = terrain.cast(&ray, exaggeration);
        let distance = hit.map_or(4.0 * self.speed, |hit| hit.distance);
        Orbit {
            target: camera.eye + camera.forward * distance,
            azimuth_deg: (self.heading_deg + 180.0).rem_euclid(360.0),
            elevation_deg: -self.pitch_deg,
            distance,
            fov_deg: self.fov_deg,
        }
    }

    /// The camera.
    #[must_use]
    pub fn camera(&self) -> Camera {
        let [heading, pitch, fov] = [self.heading_deg, self.pitch_deg, self.fov_deg].map(f64::to_radians);
        Camera::heading(self.eye, heading, pitch, fov)
    }

    /// Turns the view by a drag in pixels, as if it held the terrain.
    pub fn look(&mut self, pixels: [f64; 2], size: [u32; 2]) {
        let degrees = self.fov_deg / f64::from(size[1].max(1));
        self.heading_deg = (self.heading_deg - pixels[0] * degrees).rem_euclid(360.0);
        self.pitch_deg = (self.pitch_deg + pixels[1] * degrees).clamp(-89.0, 89.0);
    }

    /// Flies for `dt` seconds.
    pub fn step(&mut self, keys: FlyKeys, dt: f64) {
        let camera = self.camera();
        let held = |yes: bool, no: bool| f64::from(i8::from(yes) - i8::from(no));
        let way = camera.forward * held(keys.forward, keys.back)
            + camera.right() * held(keys.right, keys.left)
            + DVec3::Y * held(keys.up, keys.down);
        let fast = if keys.fast { 4.0 } else { 1.0 };
        self.eye += way.normalize_or_zero() * (self.speed * fast * dt.clamp(0.0, 0.25));
    }

    /// Changes the speed by notches of a wheel, each by a fifth.
    pub fn scroll(&mut self, notches: f64) {
        self.speed *= math::exp2(0.25 * notches.clamp(-40.0, 40.0));
    }

    /// Keeps the camera above the terrain and not too far from it, and the speed between a cell per second and the
    /// extent of the terrain.
    pub fn limit(&mut self, terrain: &Terrain, exaggeration: f64) {
        let [w, h] = terrain.size_m();
        let far = 6.0 * (w + h);
        let low = terrain.base(exaggeration) * exaggeration;
        self.eye = self.eye.clamp(DVec3::new(-far, low, -far), DVec3::new(w + far, low + far, h + far));
        self.speed = self.speed.clamp(terrain.cell_m(), w + h);
        let inside = (0.0..=w).contains(&self.eye.x) && (0.0..=h).contains(&self.eye.z);
        let floor = if inside { terrain.height_at([self.eye.x, self.eye.z]) * exaggeration } else { low };
        self.eye.y = self.eye.y.max(floor + 2.0 * terrain.cell_m());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::field;

    const SIZE: [u32; 2] = [800, 500];

    fn terrain() -> Terrain {
        Terrain::new(&field([80, 50], 100.0, |x, y| 0.1 * x + 0.05 * y)).expect("heights")
    }

    #[test]
    fn framing_shows_all_of_the_land_and_little_else() {
        let terrain = terrain();
        for azimuth_deg in [0.0, 77.0, 205.0, 310.0] {
            for elevation_deg in [3.0, 27.0, 89.0] {
                for size in [[800, 500], [300, 900]] {
                    let start = Orbit { azimuth_deg, elevation_deg, ..Orbit::framing(&terrain, 1.0, size) };
                    let camera = start.framed(&terrain, 1.0, size).camera();
                    let mut used = [1.0_f64; 4];
                    for point in terrain.hull(1.0) {
                        let [x, y] = camera.pixel(point, size).expect("in front");
                        let (x, y) = (x / f64::from(size[0]), y / f64::from(size[1]));
                        used = [used[0].min(x), used[1].min(1.0 - x), used[2].min(y), used[3].min(1.0 - y)];
                    }
                    assert!(used.iter().all(|free| *free > 0.01), "{used:?}");
                    assert!(used[0] + used[1] < 0.06 || used[2] + used[3] < 0.06, "{used:?}");
                }
            }
        }
    }

    #[test]
    fn what_is_under_the_hand_stays_there() {
        let terrain = terrain();
        let mut orbit = Orbit::framing(&terrain, 1.0, SIZE);
        let before = orbit.camera().pixel(orbit.target, SIZE).expect("in front");
        let place = orbit.target;
        orbit.pan([30.0, 0.0], SIZE);
        let after = orbit.camera().pixel(place, SIZE).expect("in front");
        assert!(
            (after[0] - before[0] - 30.0).abs() < 0.5 && (after[1] - before[1]).abs() < 0.5,
            "{before:?} {after:?}"
        );

        let place = DVec3::new(1000.0, 150.0, 900.0);
        let before = orbit.camera().pixel(place, SIZE).expect("in front");
        orbit.scroll(3.0, Some(place));
        let after = orbit.camera().pixel(place, SIZE).expect("in front");
        assert!((after[0] - before[0]).abs() < 1e-6 && (after[1] - before[1]).abs() < 1e-6);

        orbit.drag([250.0, 0.0], SIZE);
        assert!((orbit.azimuth_deg - 250.0).abs() < 1e-9);
        orbit.drag([0.0, 1e6], SIZE);
        assert!(orbit.elevation_deg <= 90.0 && orbit.camera().up().is_finite());
    }

    #[test]
    fn a_framed_land_stays_in_its_frame() {
        let terrain = terrain();
        for size in [SIZE, [2000, 700], [300, 900]] {
            let framed = Orbit::framing(&terrain, 1.0, size);
            let mut touched = framed;
            touched.limit(&terrain, 1.0);
            assert_eq!(touched, framed);
        }
    }

    #[test]
    fn eyes_stay_above_the_land() {
        let terrain = terrain();
        let mut orbit = Orbit::framing(&terrain, 1.0, SIZE);
        orbit.scroll(1e9, None);
        orbit.elevation_deg = -40.0;
        orbit.target = DVec3::new(2000.0, -9e9, 2000.0);
        orbit.limit(&terrain, 1.0);
        let eye = orbit.camera().eye;
        assert!(eye.y > terrain.height_at([eye.x, eye.z]));
        let mut fly = Fly::from_orbit(&orbit);
        let keys = FlyKeys { down: true, fast: true, forward: true, ..FlyKeys::default() };
        (0..500).for_each(|_| fly.step(keys, 0.1));
        fly.limit(&terrain, 1.0);
        assert!(fly.eye.y >= terrain.base(1.0) && fly.eye.is_finite());
        let back = fly.orbit(&terrain, 1.0);
        assert!((back.camera().eye - fly.eye).length() < 1e-6);
        fly.look([10.0, -4.0], SIZE);
        assert!((back.camera().forward - fly.camera().forward).length() > 1e-3);
    }
}
