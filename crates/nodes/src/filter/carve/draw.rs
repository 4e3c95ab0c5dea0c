//! Blends beds into the surrounding terrain.

use orograph_graph::{Job, NodeError, Window};

use super::{
    Mode, Params, Profile,
    way::{Place, Way},
};
use crate::numerics::{
    joins::{Joins, Weights},
    lines::Ends,
    math,
    noise::place::Octaves,
    par,
};

/// Rows of a strip.
const ROWS: usize = 32;

/// The part of the roughness that stays at the edges of a carved bed that is not flat, and the part of the bank over
/// which the rest comes back.
const IN_BED: f64 = 0.4;
const COMES_BACK: f64 = 0.3;

/// The terrain, and its roughness: empty where banks are smooth.
#[derive(Clone, Copy)]
pub struct Ground<'a> {
    pub heights: &'a [f32],
    pub rough: &'a [f32],
}

/// Returns the terrain with beds, and the bed mask (1 on the bed, 0 beyond its banks), if wanted.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn draw(
    job: &Job<'_>,
    Ground { heights: land, rough }: Ground<'_>,
    ways: &[Way],
    params: &Params,
    seed: u32,
    wanted: [bool; 2],
) -> Result<[Option<Vec<f32>>; 2], NodeError> {
    let window = job.window();
    let bank_m = params.bank.max(window.cell_m());
    let octaves = |wavelength_m: f64, salt: u32| Octaves {
        wavelength_m,
        count: 4,
        gain: 0.6,
        cell_m: window.cell_m(),
        seed: orograph_graph::mix(seed ^ salt),
    };
    let longest_m = 1.6 * (bank_m + 0.5 * params.width);
    let ragged = Ragged {
        joins: Joins::of(&window.world, longest_m, Weights::Random { longest_m }),
        amount: params.raggedness,
        octaves: octaves(longest_m, 0x6a09_e667),
        of_bed: params.detail * params.raggedness,
        bed: octaves(2.5 * params.width.max(2.0 * window.cell_m()), 0xbb67_ae85),
    };
    let reach_m = bank_m * ragged.most();
    let pieces: Vec<Vec<Piece>> = ways.iter().map(|way| pieces(&window, way, reach_m, ragged.widest_bed())).collect();
    let nx = window.nx();
    let strips = |raster| strips(raster, nx * ROWS, land.len());
    let mut height = wanted[0].then(|| land.to_vec());
    let mut bed = wanted[1].then(|| vec![0.0; land.len()]);
    let (heights, beds) = (strips(&mut height), strips(&mut bed));
    let lands = land.chunks(nx * ROWS).zip(heights).zip(beds);
    par::each_with(lands, Vec::new, |nearest, k, ((land, mut height), mut bed)| {
        let rows = [k * ROWS, k * ROWS + land.len() / nx];
        nearest.clear();
        nearest.resize(land.len(), Nearest::NOTHING);
        let rough = rough.get(k * ROWS * nx..).map_or(&[][..], |rough| &rough[..land.len().min(rough.len())]);
        let strip = Strip { window: &window, land, rough, rows, bank_m, ragged: &ragged, params };
        for pieces in &pieces {
            job.check()?;
            strip.draw(pieces, nearest, height.as_deref_mut(), bed.as_deref_mut());
        }
        Ok::<_, NodeError>(())
    })?;
    job.advance(0.9)?;
    Ok([height, bed])
}

/// Returns the bytes that [`draw`] needs in addition to its results, on one thread: the nearest bed point of each cell
/// of a strip.
pub fn bytes(window: &Window) -> u64 {
    (ROWS * window.nx() * size_of::<Nearest>()) as u64
}

/// Returns the strips of a raster, or `len` times None if there is no raster.
fn strips(raster: &mut Option<Vec<f32>>, size: usize, len: usize) -> Vec<Option<&mut [f32]>> {
    match raster {
        Some(raster) => raster.chunks_mut(size).map(Some).collect(),
        None => std::iter::repeat_with(|| None).take(len.div_ceil(size)).collect(),
    }
}

/// A straight segment of a bed, and the cells that it may change: first column and row, and those after the last.
struct Piece {
    from: Place,
    to: Place,
    columns: [usize; 2],
    rows: [usize; 2],
}

/// The nearest point of a bed to a cell.
#[derive(Clone, Copy)]
struct Nearest {
    square_m2: f64,
    elevation_m: f64,
    half_m: f64,
    depth_m: f64,
    /// Factor of the bank's width.
    bank: f64,
}

impl Nearest {
    const NOTHING: Self = Self { square_m2: f64::INFINITY, elevation_m: 0.0, half_m: 0.0, depth_m: 0.0, bank: 1.0 };
}

/// Returns the segments of a way that affect the world, repeated across periodic sides.
fn pieces(window: &Window, way: &Way, bank_m: f64, wider: f64) -> Vec<Piece> {
    let shifts = [0, 1].map(|axis| if Ends::of(window, axis) == Ends::Wrap { -1..=1 } else { 0..=0 });
    let mut pieces = Vec::new();
    for pair in way.places.windows(2) {
        for down in shifts[1].clone() {
            for across in shifts[0].clone() {
                let moved = |place: &Place| {
                    let [x, y] = place.at_m;
                    let [width, height] = window.world.size;
                    Place { at_m: [x + f64::from(across) * width, y + f64::from(down) * height], ..*place }
                };
                let (from, to) = (moved(&pair[0]), moved(&pair[1]));
                let reach_m = wider * from.half_m.max(to.half_m) + bank_m;
                let [columns, rows] = [0, 1].map(|axis| {
                    let (a, b) = (from.at_m[axis], to.at_m[axis]);
                    let cell =
                        |metres: f64| (metres / window.cell_m() - 0.5).clamp(-1.0, f64::from(window.cells[axis]));
                    [
                        cell(a.min(b) - reach_m).ceil().max(0.0) as usize,
                        (cell(a.max(b) + reach_m).floor() + 1.0) as usize,
                    ]
                });
                let [columns, rows] = [(columns, 0), (rows, 1)]
                    .map(|([first, end], axis): ([usize; 2], usize)| [first, end.min(window.cells[axis] as usize)]);
                if columns[0] < columns[1] && rows[0] < rows[1] {
                    pieces.push(Piece { from, to, columns, rows });
                }
            }
        }
    }
    pieces
}

/// A strip of rows of the world.
struct Strip<'a> {
    window: &'a Window,
    /// The input terrain.
    land: &'a [f32],
    /// Its roughness, or nothing.
    rough: &'a [f32],
    rows: [usize; 2],
    bank_m: f64,
    ragged: &'a Ragged,
    params: &'a Params,
}

/// How spurs and gullies make the banks uneven.
struct Ragged {
    /// 0 to 1.
    amount: f64,
    octaves: Octaves,
    /// The same of the edges of the bed, 0 to 1.
    of_bed: f64,
    bed: Octaves,
    joins: Option<Joins>,
}

/// The most by which a bed is narrower and wider, as factors.
const BED: [f64; 2] = [0.7, 1.4];

impl Ragged {
    /// Returns the most by which it and the factors of the banks lengthen the distance over which a bed blends into the
    /// terrain.
    fn most(&self) -> f64 {
        (1.0 + 0.8 * self.amount) / self.least()
    }

    /// Noise at a place, which goes on across joined sides.
    fn noise(&self, octaves: &Octaves, at_m: [f64; 2]) -> f64 {
        Joins::apply(self.joins.as_ref(), at_m, |at_m| octaves.at(at_m))
    }

    /// Returns the factor by which the bed is wider than its mean at a place.
    fn bed_factor(&self, at_m: [f64; 2]) -> f64 {
        if self.of_bed == 0.0 {
            1.0
        } else {
            (1.0 + 0.8 * self.of_bed * self.noise(&self.bed, at_m)).clamp(BED[0], BED[1])
        }
    }

    /// Returns the most of [`Self::bed_factor`].
    fn widest_bed(&self) -> f64 {
        if self.of_bed == 0.0 { 1.0 } else { BED[1] }
    }

    /// Returns the least factor.
    fn least(&self) -> f64 {
        1.0 - 0.4 * self.amount
    }

    /// Returns the factor by which a place beyond the bed is farther from it than its distance.
    fn factor(&self, at_m: [f64; 2]) -> f64 {
        if self.amount == 0.0 {
            1.0
        } else {
            1.0 + self.amount * (1.3 * self.noise(&self.octaves, at_m)).clamp(-0.4, 1.5)
        }
    }
}

impl Strip<'_> {
    /// Draws one way. `nearest` is reset before and after.
    fn draw(
        &self,
        pieces: &[Piece],
        nearest: &mut [Nearest],
        mut height: Option<&mut [f32]>,
        mut bed: Option<&mut [f32]>,
    ) {
        let nx = self.window.nx();
        let here = |piece: &&Piece| piece.rows[0] < self.rows[1] && piece.rows[1] > self.rows[0];
        let (mut first, mut end) = (nx, 0);
        for piece in pieces.iter().filter(here) {
            (first, end) = (first.min(piece.columns[0]), end.max(piece.columns[1]));
            for j in piece.rows[0].max(self.rows[0])..piece.rows[1].min(self.rows[1]) {
                let row = &mut nearest[(j - self.rows[0]) * nx..][..nx];
                for (i, nearest) in row.iter_mut().enumerate().take(piece.columns[1]).skip(piece.columns[0]) {
                    approach(nearest, &piece.from, &piece.to, self.window.centre_m(i, j));
                }
            }
        }
        for row in 0..self.land.len() / nx {
            for i in first..end {
                let at = row * nx + i;
                if nearest[at].square_m2 < f64::INFINITY {
                    let (mut spare, mut share) = (0.0, 0.0);
                    let height = height.as_mut().map_or(&mut spare, |height| &mut height[at]);
                    let bed = bed.as_mut().map_or(&mut share, |bed| &mut bed[at]);
                    let at_m = self.window.centre_m(i, self.rows[0] + row);
                    let rough = self.rough.get(at).map_or(0.0, |rough| f64::from(*rough));
                    self.change(&nearest[at], at_m, [f64::from(self.land[at]), rough], height, bed);
                    nearest[at] = Nearest::NOTHING;
                }
            }
        }
    }

    /// Applies the nearest bed point to a cell.
    fn change(&self, nearest: &Nearest, at_m: [f64; 2], [land, rough]: [f64; 2], height: &mut f32, bed: &mut f32) {
        let Nearest { square_m2, elevation_m, half_m, depth_m, bank } = *nearest;
        let distance_m = square_m2.sqrt();
        let widest_m = half_m * self.ragged.widest_bed();
        if (distance_m - widest_m) * self.ragged.least() >= self.bank_m * bank {
            return;
        }
        let half_m = half_m * self.ragged.bed_factor(at_m);
        let beyond_m = distance_m - half_m;
        if beyond_m * self.ragged.least() >= self.bank_m * bank {
            return;
        }
        let factor = if beyond_m > 0.0 { self.ragged.factor(at_m) / bank } else { 1.0 };
        let along_bank = beyond_m * factor / self.bank_m;
        let away = math::smoothstep(along_bank);
        if away >= 1.0 {
            return;
        }
        let x = if half_m > 0.0 { (distance_m / half_m).min(1.0) } else { 1.0 };
        let rise = match self.params.profile {
            Profile::Flat => 0.0,
            Profile::Round => x * x,
            Profile::Sharp => x,
        };
        // none in the middle of a bed, so that its water still runs, and none on dams and roads
        let is_carved = self.params.mode == Mode::Carve && self.params.profile != Profile::Flat;
        let in_bed = if is_carved { IN_BED * x * x } else { 0.0 };
        let stays = self.params.detail * (in_bed + (1.0 - in_bed) * math::smoothstep(along_bank / COMES_BACK));
        let risen = depth_m * rise + stays * rough;
        let surface = elevation_m + if is_carved && beyond_m <= 0.0 { risen.max(0.0) } else { risen };
        let target = |land: f64| (surface * (1.0 - away) + land * away) as f32;
        *height = match self.params.mode {
            Mode::Carve => height.min(target(land)),
            Mode::Fill => height.max(target(land)),
            Mode::Grade => target(f64::from(*height)),
        };
        *bed = bed.max((1.0 - away) as f32);
    }
}

/// Updates `nearest` if a segment has a nearer point.
fn approach(nearest: &mut Nearest, from: &Place, to: &Place, at_m: [f64; 2]) {
    let along = [0, 1].map(|axis| to.at_m[axis] - from.at_m[axis]);
    let off = [0, 1].map(|axis| at_m[axis] - from.at_m[axis]);
    let square = along[0] * along[0] + along[1] * along[1];
    let t = if square > 0.0 { ((off[0] * along[0] + off[1] * along[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    let [x, y] = [off[0] - t * along[0], off[1] - t * along[1]];
    let square_m2 = x * x + y * y;
    if square_m2 < nearest.square_m2 {
        let between = |a: f64, b: f64| a * (1.0 - t) + b * t;
        *nearest = Nearest {
            square_m2,
            elevation_m: between(from.elevation_m, to.elevation_m),
            half_m: between(from.half_m, to.half_m),
            depth_m: between(from.depth_m, to.depth_m),
            bank: if x * along[1] > y * along[0] {
                between(from.banks[1], to.banks[1])
            } else {
                between(from.banks[0], to.banks[0])
            },
        };
    }
}
