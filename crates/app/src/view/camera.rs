//! The camera, and the rays through its pixels.

use glam::{DVec3, Mat4, Vec4};
use orograph_nodes::numerics::math;

/// An upright perspective camera.
///
/// Positions are metres from the north-west corner of the terrain: x east, y up (exaggerated), z south.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Its position.
    pub eye: DVec3,
    /// Its direction, a unit vector that is not vertical.
    pub forward: DVec3,
    /// Vertical field of view in radians.
    pub fov_y: f64,
}

/// A half-line: `origin + t * direction` with t from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// The start of the ray.
    pub origin: DVec3,
    /// Its direction, a unit vector.
    pub direction: DVec3,
}

impl Camera {
    /// A camera that looks at a position.
    #[must_use]
    pub fn looking_at(eye: DVec3, target: DVec3, fov_y: f64) -> Self {
        let forward = (target - eye).try_normalize().unwrap_or(DVec3::NEG_Z);
        Self { eye, forward: upright(forward), fov_y }
    }

    /// A camera with a heading (radians clockwise from north) and a pitch (radians above level).
    #[must_use]
    pub fn heading(eye: DVec3, heading: f64, pitch: f64, fov_y: f64) -> Self {
        Self { eye, forward: upright(direction(heading, pitch)), fov_y }
    }

    /// Unit vector to the right in the picture.
    #[must_use]
    pub fn right(&self) -> DVec3 {
        self.forward.cross(DVec3::Y).normalize()
    }

    /// Unit vector up in the picture.
    #[must_use]
    pub fn up(&self) -> DVec3 {
        self.right().cross(self.forward)
    }

    /// Half the extent of the picture at distance 1, to the right and up.
    #[must_use]
    pub fn half_extent(&self, size: [u32; 2]) -> [f64; 2] {
        let up = math::tan(self.fov_y * 0.5);
        let [w, h] = size.map(|n| f64::from(n.max(1)));
        [up * w / h, up]
    }

    /// The ray through a point of the picture, in pixels from its upper left corner.
    #[must_use]
    pub fn ray(&self, pixel: [f64; 2], size: [u32; 2]) -> Ray {
        let [tx, ty] = self.half_extent(size);
        let [w, h] = size.map(|n| f64::from(n.max(1)));
        let (x, y) = (2.0 * pixel[0] / w - 1.0, 1.0 - 2.0 * pixel[1] / h);
        let direction = self.forward + self.right() * (x * tx) + self.up() * (y * ty);
        Ray { origin: self.eye, direction: direction.normalize() }
    }

    /// Projects a position to pixels from the upper left corner. Returns None behind the camera.
    #[must_use]
    pub fn pixel(&self, place: DVec3, size: [u32; 2]) -> Option<[f64; 2]> {
        let to = place - self.eye;
        let depth = to.dot(self.forward);
        if depth <= 0.0 {
            return None;
        }
        let [tx, ty] = self.half_extent(size);
        let (x, y) = (to.dot(self.right()) / (depth * tx), to.dot(self.up()) / (depth * ty));
        Some([(x + 1.0) * 0.5 * f64::from(size[0]), (1.0 - y) * 0.5 * f64::from(size[1])])
    }

    /// The matrix from positions relative to the camera to clip space. Depth is `near / distance`, 0 at infinity.
    pub(super) fn projection(&self, size: [u32; 2], near: f64) -> Mat4 {
        let [tx, ty] = self.half_extent(size);
        let row = |v: DVec3, s: f64| (v * s).extend(0.0).as_vec4();
        let x = row(self.right(), 1.0 / tx);
        let y = row(self.up(), 1.0 / ty);
        let w = row(self.forward, 1.0);
        let z = Vec4::new(0.0, 0.0, 0.0, near as f32);
        Mat4::from_cols(x, y, z, w).transpose()
    }
}

/// The unit vector of a heading (clockwise from north) and a pitch (above level), both in radians.
pub(super) fn direction(heading: f64, pitch: f64) -> DVec3 {
    let level = math::cos(pitch);
    DVec3::new(math::sin(heading) * level, math::sin(pitch), -math::cos(heading) * level)
}

/// The same direction, turned off the vertical just enough to define which way is up in the picture.
fn upright(forward: DVec3) -> DVec3 {
    const LEAST: f64 = 1e-4;
    let level = (forward.x * forward.x + forward.z * forward.z).sqrt();
    if level >= LEAST {
        return forward;
    }
    let north = if level > 0.0 { DVec3::new(forward.x, 0.0, forward.z) / level } else { DVec3::NEG_Z };
    (DVec3::Y * forward.y.signum() + north * LEAST).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [640, 360];

    #[test]
    fn a_pixel_and_its_ray_belong_together() {
        let camera = Camera::looking_at(DVec3::new(100.0, 900.0, 4000.0), DVec3::new(700.0, 20.0, 300.0), 0.7);
        for pixel in [[320.0, 180.0], [0.5, 0.5], [639.0, 12.0], [77.0, 340.0]] {
            let ray = camera.ray(pixel, SIZE);
            let back = camera.pixel(ray.origin + ray.direction * 1234.0, SIZE).expect("in front");
            assert!((back[0] - pixel[0]).abs() < 1e-9 && (back[1] - pixel[1]).abs() < 1e-9, "{back:?}");
        }
        let middle = camera.ray([320.0, 180.0], SIZE).direction;
        assert!((middle - camera.forward).length() < 1e-12);
        assert_eq!(camera.pixel(camera.eye - camera.forward, SIZE), None);
    }

    #[test]
    fn east_is_right_of_north_and_clip_space_agrees_with_pixels() {
        let camera = Camera::heading(DVec3::new(5.0, 6.0, 7.0), 0.0, 0.0, 1.0);
        assert!((camera.right() - DVec3::X).length() < 1e-12 && (camera.up() - DVec3::Y).length() < 1e-12);
        let place = DVec3::new(30.0, -9.0, -80.0);
        let clip = camera.projection(SIZE, 0.25) * (place - camera.eye).as_vec3().extend(1.0);
        let pixel = camera.pixel(place, SIZE).expect("in front");
        let x = f64::from(clip.x / clip.w * 0.5 + 0.5) * 640.0;
        let y = f64::from(0.5 - clip.y / clip.w * 0.5) * 360.0;
        assert!((x - pixel[0]).abs() < 1e-3 && (y - pixel[1]).abs() < 1e-3);
        assert!((clip.z / clip.w - 0.25 / 87.0).abs() < 1e-7);
    }

    #[test]
    fn straight_down_still_has_an_up() {
        let camera = Camera::looking_at(DVec3::new(0.0, 50.0, 0.0), DVec3::ZERO, 0.7);
        assert!(camera.up().is_finite() && (camera.up() - DVec3::NEG_Z).length() < 1e-3);
        assert!(Camera::looking_at(DVec3::ZERO, DVec3::ZERO, 0.7).right().is_finite());
    }
}
