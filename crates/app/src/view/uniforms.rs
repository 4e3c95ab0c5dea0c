//! What the shaders know of a picture: `Frame` in `shaders/view/frame.wgsl`.

use glam::{DVec3, Mat4, Vec4};

use super::{
    land::Land,
    lod::{Ground, eye_above},
    scene::{Background, Colouring, Scene},
};

/// The uniform of a picture, field by field as in the shader.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Frame {
    projection: Mat4,
    /// Half the picture at distance 1 to the right.
    right: Vec4,
    /// Half the picture at distance 1 up.
    up: Vec4,
    /// Where the eye looks; near distance.
    forward: Vec4,
    /// Unit vector to the sun; tangent of the picture's half height.
    sun: Vec4,
    /// Eye in metres; its height above the highest land.
    eye: Vec4,
    /// Grid coordinates of the eye: whole part.
    eye_cell: [i32; 2],
    /// Grid coordinates of the eye: the rest.
    eye_part: [f32; 2],
    cells: [u32; 2],
    cell_m: f32,
    exaggeration: f32,
    /// Lowest and highest height, elevation of the sea, in metres; base of the walls, exaggerated.
    heights: Vec4,
    size: [f32; 2],
    seconds: f32,
    exposure: f32,
    /// Metres between contour lines, their opacity, opacity of the mask, share of haze.
    overlay: Vec4,
    /// Kilometres of air that a metre of the scene counts as, and height of the air's layers in metres of the scene.
    air: Vec4,
    /// Light behind the land; 1 where it is the sky's instead.
    background: Vec4,
    /// Colouring, 1 for levels of detail, 1 for shadows, 1 for codes of a screen instead of linear light.
    flags: [u32; 4],
}

/// A sea that is nowhere.
const NO_SEA: f32 = -1e30;

impl Frame {
    pub(super) fn new(land: &Land, scene: &Scene, size: [u32; 2], encode: bool) -> Self {
        let camera = &scene.camera;
        let [tx, ty] = camera.half_extent(size);
        let near = near(land);
        let grid = DVec3::new(camera.eye.x, 0.0, camera.eye.z) / land.cell_m() + 0.5;
        let whole = grid.floor();
        let ground = ground(land, scene);
        let vector = |v: DVec3, w: f64| v.extend(w).as_vec4();
        let [low, high] = land.range();
        let sea = scene.sea_level.map_or(NO_SEA, |sea| sea as f32);
        let contours = scene.contours.map_or([0.0; 2], |lines| [lines.interval as f32, lines.opacity]);
        let [w, h] = land.size_m();
        let colouring = match (scene.colouring, land.colour()) {
            (Colouring::Own, Some(_)) => 0,
            (Colouring::Own, None) | (Colouring::Natural, _) => 1,
            (Colouring::Map, _) => 2,
            (Colouring::Clay, _) => 3,
        };
        let mask = if land.mask().is_some() { scene.mask_opacity } else { 0.0 };
        Self {
            projection: camera.projection(size, near),
            right: vector(camera.right() * tx, 0.0),
            up: vector(camera.up() * ty, 0.0),
            forward: vector(camera.forward, near),
            sun: vector(scene.sun.towards(), ty),
            eye: vector(camera.eye, eye_above(&ground, camera)),
            eye_cell: [whole.x as i32, whole.z as i32],
            eye_part: [(grid.x - whole.x) as f32, (grid.z - whole.z) as f32],
            cells: land.cells(),
            cell_m: land.cell_m() as f32,
            exaggeration: scene.exaggeration as f32,
            heights: Vec4::new(low as f32, high as f32, sea, ground.base as f32),
            size: size.map(|n| n as f32),
            seconds: scene.seconds,
            exposure: scene.exposure,
            overlay: Vec4::new(contours[0], contours[1], mask, scene.haze as f32),
            air: Vec4::new(w as f32, h as f32, 0.0, 0.0),
            background: match scene.background {
                Background::Sky => Vec4::W,
                Background::Plain([r, g, b]) => Vec4::new(r, g, b, 0.0),
            },
            flags: [colouring, u32::from(scene.show_levels), u32::from(scene.shadows), u32::from(encode)],
        }
    }
}

/// The distance at which the picture begins. Depth is a float whose smallest numbers are the farthest places, so that it
/// may be short.
fn near(land: &Land) -> f64 {
    0.05 * land.cell_m()
}

/// The land as the choice of tiles needs it.
pub(super) fn ground<'a>(land: &'a Land, scene: &Scene) -> Ground<'a> {
    Ground {
        bounds: land.bounds(),
        cells: land.cells(),
        cell_m: land.cell_m(),
        exaggeration: scene.exaggeration,
        base: land.base(scene.exaggeration) * scene.exaggeration,
        sea_level: scene.sea_level,
    }
}
