//! What the shaders know of a picture: `Frame` in `shaders/view/frame.wgsl`.

use glam::{DVec3, Mat4, Vec4};
use orograph_nodes::numerics::math;

use super::{
    inset::Inset,
    land::Land,
    lod::{Ground, eye_above},
    scene::{Background, Colouring, Scene},
    sweep::Sweep,
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
    /// Eye in metres from the corner of what is drawn; its height above the highest land.
    eye: Vec4,
    /// The eye in grid lines of the mesh: whole part.
    eye_line: [i32; 2],
    /// The eye in grid lines of the mesh: the rest.
    eye_part: [f32; 2],
    cells: [u32; 2],
    cell_m: f32,
    exaggeration: f32,
    /// Lowest height above the sea, highest height, elevation of the sea, in metres; base of the walls, exaggerated.
    heights: Vec4,
    size: [f32; 2],
    seconds: f32,
    exposure: f32,
    /// Metres between contour lines, their opacity, opacity of the mask, share of haze.
    overlay: Vec4,
    /// Haze: metres to where it begins, density a metre, height of its layer in metres; 1 over the land's extent.
    air: Vec4,
    /// Altitude of the eye for the sky's tables, in kilometres.
    sky: Vec4,
    sweep: Vec4,
    sweep_lines: [i32; 4],
    sweep_fall: Vec4,
    /// Cells of a texel of the map of open sky along x and y; how far it looks, in cells.
    open: Vec4,
    /// Light behind the land; 1 where it is the sky's instead.
    background: Vec4,
    /// Colouring, 1 for levels of detail, 1 for shadows, 1 for codes of a screen instead of linear light.
    flags: [u32; 4],
    /// Mesh: last grid line along x and y, first one; what is drawn: 0 all, 1 around the inset, 2 the inset.
    lines: [u32; 4],
    /// Mesh: cells a line, metres a line, distance of the land's edge from the outermost lines in lines; longer side of the
    /// land in metres.
    grid: Vec4,
    /// Rectangle of the inset in metres, relative to the eye: west, north, east, south.
    inset: Vec4,
    /// Corner of the inset in metres, relative to the eye; its cells a metre.
    inset_cells: Vec4,
    /// From the map of what is drawn to the whole land's: first and size.
    over: Vec4,
    /// Sides of the inset in its cells.
    sides: Vec4,
    /// Corner of what is drawn in metres from the whole land's; 1 / cells of the inset's band.
    corner: Vec4,
}

/// A sea that is nowhere.
const NO_SEA: f32 = -1e30;

impl Frame {
    /// Of the whole land, around its inset if it has one.
    pub(super) fn new(
        (land, inset): (&Land, Option<&Inset>),
        scene: &Scene,
        sweep: &Sweep,
        size: [u32; 2],
        encode: bool,
    ) -> Self {
        let camera = &scene.camera;
        let [tx, ty] = camera.half_extent(size);
        let near = near(land);
        let ground = ground(land, inset, scene);
        let lines_a_cell = f64::from(1_u32 << ground.finer);
        let grid = (DVec3::new(camera.eye.x, 0.0, camera.eye.z) / land.cell_m() + 0.5) * lines_a_cell;
        let whole = grid.floor();
        let edge = if ground.finer == 0 { 0.5 } else { 0.0 };
        let vector = |v: DVec3, w: f64| v.extend(w).as_vec4();
        let [low, high] = land.range();
        let sea = scene.sea_level.map_or(NO_SEA, |sea| sea as f32);
        // tints begin at the shore
        let low = (low as f32).max(sea);
        let contours = scene.contours.map_or([0.0; 2], |lines| [lines.interval as f32, lines.opacity]);
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
            eye_line: [whole.x as i32, whole.z as i32],
            eye_part: [(grid.x - whole.x) as f32, (grid.z - whole.z) as f32],
            cells: land.cells(),
            cell_m: land.cell_m() as f32,
            exaggeration: scene.exaggeration as f32,
            heights: Vec4::new(low, high as f32, sea, ground.base as f32),
            size: size.map(|n| n as f32),
            seconds: scene.seconds,
            exposure: scene.exposure + EXPOSURE + adapted(scene.sun.elevation_deg),
            overlay: Vec4::new(contours[0], contours[1], mask, scene.haze as f32),
            air: haze(land, scene, ground.base),
            sky: Vec4::new(altitude_km(scene, ground.base) as f32, 0.0, 0.0, 0.0),
            sweep: steps(sweep),
            sweep_lines: lines(sweep),
            sweep_fall: Vec4::new(sweep.fall[0] as f32, sweep.fall[1] as f32, 0.0, 0.0),
            open: {
                let [x, y] = open_texels(land);
                let [nx, ny] = land.cells().map(|n| n as f32);
                Vec4::new(nx / x as f32, ny / y as f32, 0.2 * nx.max(ny), 0.0)
            },
            background: match scene.background {
                Background::Sky => Vec4::W,
                Background::Plain([r, g, b]) => Vec4::new(r, g, b, 0.0),
            },
            flags: [colouring, u32::from(scene.show_levels), u32::from(scene.shadows), u32::from(encode)],
            lines: [ground.last_line(0), ground.last_line(1), (1 << ground.finer) / 2, u32::from(inset.is_some())],
            grid: {
                let step = 1.0 / lines_a_cell;
                let [w, h] = land.size_m();
                Vec4::new(step as f32, (land.cell_m() * step) as f32, edge, w.max(h) as f32)
            },
            inset: inset.map_or(NOWHERE, |inset| {
                let [west, north, east, south] = inset.rectangle();
                let eye = camera.eye;
                Vec4::from_array([west - eye.x, north - eye.z, east - eye.x, south - eye.z].map(|v| v as f32))
            }),
            inset_cells: inset.map_or(Vec4::ZERO, |inset| {
                let [x, y] = inset.corner();
                let a_metre = 1.0 / inset.land().cell_m();
                Vec4::new((x - camera.eye.x) as f32, (y - camera.eye.z) as f32, a_metre as f32, 0.0)
            }),
            over: Vec4::new(0.0, 0.0, 1.0, 1.0),
            sides: Vec4::ZERO,
            corner: Vec4::ZERO,
        }
    }

    /// Of the inset of that land.
    pub(super) fn of_inset(self, land: &Land, inset: &Inset, scene: &Scene, sweep: &Sweep) -> Self {
        let (own, corner, size) = (inset.land(), inset.corner(), land.size_m());
        let eye = scene.camera.eye - DVec3::new(corner[0], 0.0, corner[1]);
        let share = |axis: usize, metres: [f64; 2]| (metres[axis] / size[axis]) as f32;
        let [drawn_x, drawn_y, first, _] = self.lines;
        Self {
            eye: eye.as_vec3().extend(self.eye.w),
            cells: own.cells(),
            cell_m: own.cell_m() as f32,
            sweep: steps(sweep),
            sweep_lines: lines(sweep),
            lines: [drawn_x, drawn_y, first, 2],
            over: Vec4::new(share(0, corner), share(1, corner), share(0, own.size_m()), share(1, own.size_m())),
            sides: Vec4::from_array(inset.sides().map(|side| side as f32)),
            corner: Vec4::new(corner[0] as f32, corner[1] as f32, (1.0 / inset.band()) as f32, 0.0),
            ..self
        }
    }
}

/// A rectangle without a place in it.
const NOWHERE: Vec4 = Vec4::new(1e30, 1e30, -1e30, -1e30);

fn steps(sweep: &Sweep) -> Vec4 {
    Vec4::new(sweep.shift as f32, sweep.step_m as f32, sweep.first as f32, sweep.cells as f32)
}

fn lines(sweep: &Sweep) -> [i32; 4] {
    [sweep.axis, i32::from(sweep.forward), sweep.steps as i32, sweep.lines as i32]
}

/// Stops that show a matt grey surface in an afternoon's sun as middle grey.
const EXPOSURE: f32 = 1.9;

/// Stops by which the eye gets used to a low sun, and to twilight.
fn adapted(elevation_deg: f64) -> f32 {
    let low = ((30.0 - elevation_deg) / 30.0).clamp(0.0, 1.0);
    let below = (-elevation_deg).clamp(0.0, 7.0);
    (1.5 * low * low + 0.7 * below) as f32
}

/// Where the haze over the land begins, how dense it is and how high it lies. True air would hardly be seen over a small land
/// and hide a large one that is looked at whole, so it is a matter of the land's extent: thick enough that near and far
/// part, less so over small land.
fn haze(land: &Land, scene: &Scene, base: f64) -> Vec4 {
    let [w, h] = land.size_m();
    let across = math::hypot(w, h);
    let relief = (land.range()[1] - land.range()[0]) * scene.exaggeration;
    let begin = ((scene.camera.eye - land.middle(scene.exaggeration)).length() - 0.5 * across).max(0.0);
    let density = scene.haze.max(0.0) * 0.15 / across * (across / (across + 6_000.0));
    let layer = (0.05 * across).max(0.7 * relief).max(scene.exaggeration * land.range()[0] - base);
    Vec4::new(begin as f32, density as f32, layer as f32, (1.0 / across) as f32)
}

/// Altitude of the eye for the sky: never so high that the sky turns black over a land that is looked at whole.
pub(super) fn altitude_km(scene: &Scene, base: f64) -> f64 {
    // in steps that no sky shows, so that its tables stay while the eye goes along the ground
    ((scene.camera.eye.y - base) * 0.05).round().clamp(5.0, 100.0) * 0.02
}

/// Texels of the map of open sky along x and y.
pub(super) fn open_texels(land: &Land) -> [u32; 2] {
    let [nx, ny] = land.cells();
    let stride = nx.max(ny).div_ceil(384);
    [nx, ny].map(|n| n.div_ceil(stride))
}

/// The distance at which the picture begins. Depth is a float whose smallest numbers are the farthest places, so that it
/// may be short.
fn near(land: &Land) -> f64 {
    0.05 * land.cell_m()
}

/// The land as the choice of tiles needs it.
pub(super) fn ground<'a>(land: &'a Land, inset: Option<&'a Inset>, scene: &Scene) -> Ground<'a> {
    Ground {
        bounds: inset.map_or(land.bounds(), Inset::bounds),
        cells: land.cells(),
        cell_m: land.cell_m(),
        finer: inset.map_or(0, Inset::finer),
        exaggeration: scene.exaggeration,
        base: land.base(scene.exaggeration) * scene.exaggeration,
        sea_level: scene.sea_level,
    }
}
