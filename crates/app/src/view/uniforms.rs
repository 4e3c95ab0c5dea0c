//! The uniform of a picture: `Frame` in `shaders/view/frame.wgsl`.

use glam::{DVec3, Mat4, Vec4};
use orograph_nodes::numerics::math;

use super::{
    inset::Inset,
    lod::{Ground, eye_above},
    scene::{Background, Colouring, Scene},
    sweep::Sweep,
    terrain::Terrain,
};

/// The uniform of a picture, with the fields of the shader.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Frame {
    projection: Mat4,
    /// Half the width of the picture at distance 1, as a vector.
    right: Vec4,
    /// Half the height of the picture at distance 1, as a vector.
    up: Vec4,
    /// Direction of the camera; near distance.
    forward: Vec4,
    /// Unit vector to the sun; tangent of half the vertical field of view.
    sun: Vec4,
    /// Position of the camera in metres from the corner of the drawn terrain or inset; its height above the highest
    /// terrain.
    eye: Vec4,
    /// Position of the camera in grid lines of the mesh: whole part.
    eye_line: [i32; 2],
    /// Position of the camera in grid lines of the mesh: fraction.
    eye_part: [f32; 2],
    cells: [u32; 2],
    cell_m: f32,
    exaggeration: f32,
    /// Lowest height above the sea, highest height, elevation of the sea, in metres; base of the walls, exaggerated.
    heights: Vec4,
    size: [f32; 2],
    seconds: f32,
    exposure: f32,
    /// Contour interval in metres, opacity of contours, opacity of masks, amount of haze.
    overlay: Vec4,
    /// Haze: distance in metres to its beginning, density per metre, height of its layer in metres; 1 / extent of the
    /// terrain.
    air: Vec4,
    /// Altitude of the camera for the tables of the sky, in kilometres; amount of texture of the ground, and the
    /// length of its largest forms in metres.
    sky: Vec4,
    sweep: Vec4,
    sweep_lines: [i32; 4],
    sweep_fall: Vec4,
    /// Cells per texel of the sky visibility along x and y; search distance in cells.
    open: Vec4,
    /// Background colour; 1 to draw the sky instead.
    background: Vec4,
    /// Colouring; 1 to show levels of detail; 1 for shadows; 1 to encode sRGB instead of writing linear light.
    flags: [u32; 4],
    /// Mesh: last grid line along x and y, first line; draw 0 all, 1 the terrain around the inset, 2 the inset.
    lines: [u32; 4],
    /// Mesh: cells per line, metres per line, distance of the edge from the outermost lines in lines; longer side of
    /// the terrain in metres.
    grid: Vec4,
    /// Rectangle of the inset in metres, relative to the camera: west, north, east, south.
    inset: Vec4,
    /// Corner of the inset in metres, relative to the camera; its cells per metre.
    inset_cells: Vec4,
    /// Offset and size of the drawn map in that of the whole terrain (0 to 1).
    over: Vec4,
    /// Sides of the inset in its cells.
    sides: Vec4,
    /// Corner of the drawn map in metres from that of the whole terrain; 1 / band of the inset in cells.
    corner: Vec4,
    /// Clouds: value of their noise at their edges, above 1 for none; 1 / length of the largest in metres; their height in
    /// metres, exaggerated.
    clouds: Vec4,
}

/// Elevation of the sea in a world without one.
const NO_SEA: f32 = -1e30;

impl Frame {
    /// The uniform of the whole terrain, around its inset if it has one.
    pub(super) fn new(
        (terrain, inset): (&Terrain, Option<&Inset>),
        scene: &Scene,
        sweep: &Sweep,
        size: [u32; 2],
        encode: bool,
    ) -> Self {
        let camera = &scene.camera;
        let [tx, ty] = camera.half_extent(size);
        let near = near(terrain);
        let ground = ground(terrain, inset, scene);
        let lines_a_cell = f64::from(1_u32 << ground.finer);
        let grid = (DVec3::new(camera.eye.x, 0.0, camera.eye.z) / terrain.cell_m() + 0.5) * lines_a_cell;
        let whole = grid.floor();
        let edge = if ground.finer == 0 { 0.5 } else { 0.0 };
        let vector = |v: DVec3, w: f64| v.extend(w).as_vec4();
        let [low, high] = terrain.range();
        let sea = scene.sea_level.map_or(NO_SEA, |sea| sea as f32);
        // tints begin at the shore
        let low = (low as f32).max(sea);
        let contours = scene.contours.map_or([0.0; 2], |lines| [lines.interval as f32, lines.opacity]);
        let colouring = match (scene.colouring, terrain.colour()) {
            (Colouring::Own, Some(_)) => 0,
            (Colouring::Own, None) | (Colouring::Natural, _) => 1,
            (Colouring::Map, _) => 2,
            (Colouring::Clay, _) => 3,
        };
        Self {
            projection: camera.projection(size, near),
            right: vector(camera.right() * tx, 0.0),
            up: vector(camera.up() * ty, 0.0),
            forward: vector(camera.forward, near),
            sun: vector(scene.sun.towards(), ty),
            eye: vector(camera.eye, eye_above(&ground, camera)),
            eye_line: [whole.x as i32, whole.z as i32],
            eye_part: [(grid.x - whole.x) as f32, (grid.z - whole.z) as f32],
            cells: terrain.cells(),
            cell_m: terrain.cell_m() as f32,
            exaggeration: scene.exaggeration as f32,
            heights: Vec4::new(low, high as f32, sea, ground.base as f32),
            size: size.map(|n| n as f32),
            seconds: scene.seconds,
            exposure: scene.exposure + EXPOSURE + adapted(scene.sun.elevation_deg),
            overlay: Vec4::new(contours[0], contours[1], scene.mask_opacity, scene.haze as f32),
            air: haze(terrain, scene, ground.base),
            sky: {
                // an inset has the texture of the terrain around it
                let largest = math::exp2(math::log2(terrain.cell_m()).floor());
                Vec4::new(altitude_km(scene, ground.base) as f32, scene.texture.max(0.0) as f32, largest as f32, 0.0)
            },
            sweep: steps(sweep),
            sweep_lines: lines(sweep),
            sweep_fall: Vec4::new(sweep.fall[0] as f32, sweep.fall[1] as f32, 0.0, 0.0),
            open: {
                let [x, y] = open_texels(terrain);
                let [nx, ny] = terrain.cells().map(|n| n as f32);
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
                let [w, h] = terrain.size_m();
                Vec4::new(step as f32, (terrain.cell_m() * step) as f32, edge, w.max(h) as f32)
            },
            inset: inset.map_or(NOWHERE, |inset| {
                let [west, north, east, south] = inset.rectangle();
                let eye = camera.eye;
                Vec4::from_array([west - eye.x, north - eye.z, east - eye.x, south - eye.z].map(|v| v as f32))
            }),
            inset_cells: inset.map_or(Vec4::ZERO, |inset| {
                let [x, y] = inset.corner();
                let a_metre = 1.0 / inset.terrain().cell_m();
                Vec4::new((x - camera.eye.x) as f32, (y - camera.eye.z) as f32, a_metre as f32, 0.0)
            }),
            over: Vec4::new(0.0, 0.0, 1.0, 1.0),
            sides: Vec4::ZERO,
            corner: Vec4::ZERO,
            clouds: clouds(terrain, scene),
        }
    }

    /// The uniform of the inset of that terrain.
    pub(super) fn of_inset(self, terrain: &Terrain, inset: &Inset, scene: &Scene, sweep: &Sweep) -> Self {
        let (own, corner, size) = (inset.terrain(), inset.corner(), terrain.size_m());
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

/// A rectangle that contains no point.
const NOWHERE: Vec4 = Vec4::new(1e30, 1e30, -1e30, -1e30);

fn steps(sweep: &Sweep) -> Vec4 {
    Vec4::new(sweep.shift as f32, sweep.step_m as f32, sweep.first as f32, sweep.cells as f32)
}

fn lines(sweep: &Sweep) -> [i32; 4] {
    [sweep.axis, i32::from(sweep.forward), sweep.steps as i32, sweep.lines as i32]
}

/// Exposure in stops at which a matt grey surface in the afternoon sun becomes middle grey.
const EXPOSURE: f32 = 1.9;

/// Additional exposure in stops for a low sun and for twilight, like the adaptation of an eye.
fn adapted(elevation_deg: f64) -> f32 {
    let low = ((30.0 - elevation_deg) / 30.0).clamp(0.0, 1.0);
    let below = (-elevation_deg).clamp(0.0, 7.0);
    (1.5 * low * low + 0.7 * below) as f32
}

/// Start, density and height of the haze over the terrain. Physical air would be invisible over a small terrain and
/// hide a large one seen as a whole, so the haze follows the extent of the terrain: thick enough to separate near from
/// far, thinner over small terrain.
fn haze(terrain: &Terrain, scene: &Scene, base: f64) -> Vec4 {
    let [w, h] = terrain.size_m();
    let across = math::hypot(w, h);
    let relief = (terrain.range()[1] - terrain.range()[0]) * scene.exaggeration;
    let begin = ((scene.camera.eye - terrain.middle(scene.exaggeration)).length() - 0.5 * across).max(0.0);
    let density = scene.haze.max(0.0) * 0.15 / across * (across / (across + 6_000.0));
    let layer = (0.05 * across).max(0.7 * relief).max(scene.exaggeration * terrain.range()[0] - base);
    Vec4::new(begin as f32, density as f32, layer as f32, (1.0 / across) as f32)
}

/// Edge, size and height of the clouds whose shadows lie on the terrain. A terrain has about five of the largest along its
/// longer side; they float above the highest summit.
fn clouds(terrain: &Terrain, scene: &Scene) -> Vec4 {
    // mean and standard deviation of the sum of octaves in terrain.wgsl
    const SUM: [f64; 2] = [0.492, 0.124];
    let share = scene.clouds.clamp(0.0, 0.999);
    if share == 0.0 {
        return Vec4::new(2.0, 0.0, 0.0, 0.0);
    }
    let [w, h] = terrain.size_m();
    let size = (0.2 * w.max(h)).clamp(400.0, 8000.0);
    // the quantile of a logistic distribution, nearly that of a normal one
    let edge = SUM[0] + SUM[1] * math::ln((1.0 - share) / share) / 1.702;
    let height = terrain.range()[1] * scene.exaggeration + 0.1 * size;
    Vec4::new(edge as f32, (1.0 / size) as f32, height as f32, 0.0)
}

/// Altitude of the camera for the sky, limited so that the sky does not turn black in a view of a large terrain.
pub(super) fn altitude_km(scene: &Scene, base: f64) -> f64 {
    // in invisible steps, so that the tables stay valid while the camera moves along the ground
    ((scene.camera.eye.y - base) * 0.05).round().clamp(5.0, 100.0) * 0.02
}

/// Texels of the sky visibility along x and y.
pub(super) fn open_texels(terrain: &Terrain) -> [u32; 2] {
    let [nx, ny] = terrain.cells();
    let stride = nx.max(ny).div_ceil(384);
    [nx, ny].map(|n| n.div_ceil(stride))
}

/// The near distance. It can be short, because depth is reversed: floats are most precise near 0, which is far away.
fn near(terrain: &Terrain) -> f64 {
    0.05 * terrain.cell_m()
}

/// The terrain, as needed for the selection of tiles.
pub(super) fn ground<'a>(terrain: &'a Terrain, inset: Option<&'a Inset>, scene: &Scene) -> Ground<'a> {
    Ground {
        bounds: inset.map_or(terrain.bounds(), Inset::bounds),
        cells: terrain.cells(),
        cell_m: terrain.cell_m(),
        finer: inset.map_or(0, Inset::finer),
        exaggeration: scene.exaggeration,
        base: terrain.base(scene.exaggeration) * scene.exaggeration,
        sea_level: scene.sea_level,
    }
}
