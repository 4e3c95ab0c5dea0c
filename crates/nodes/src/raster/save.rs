//! Writing results: whole files or none.
//!
//! A file is written under a temporary name in its own folder and renamed into place when it is complete, so a reader
//! never sees half of one, and a full disk leaves what was there before as it was.

use std::{
    io::{self, BufWriter, Seek, SeekFrom, Write},
    path::Path,
};

use orograph_graph::{Field, memory::Leftover, mix};
use rayon::prelude::*;
use tempfile::NamedTempFile;

use ::png::{BitDepth, ColorType};

use super::{GoOn, Problem, RasterError, Sidecar, exr, geotiff, png, png::Rows, sidecar_path};
use crate::{math, simd::simd};

/// A format for heights, masks and scalars.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR, 32-bit reals, uncompressed.
    Exr,
    /// 16-bit grey PNG: codes over a range.
    Png16,
    /// 8-bit grey PNG: codes over a range, for masks.
    Png8,
    /// GeoTIFF, 32-bit reals, with cell size.
    Tiff,
    /// Raw 16-bit codes over a range, little-endian.
    R16,
    /// Raw 32-bit reals, little-endian.
    R32,
}

impl Format {
    /// Every format, best first.
    pub const ALL: [Self; 6] = [Self::Exr, Self::Png16, Self::Png8, Self::Tiff, Self::R16, Self::R32];

    /// Its name on a command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Exr => "exr",
            Self::Png16 => "png16",
            Self::Png8 => "png8",
            Self::Tiff => "tiff",
            Self::R16 => "r16",
            Self::R32 => "r32",
        }
    }

    /// The extension of its files.
    #[must_use]
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Exr => "exr",
            Self::Png16 | Self::Png8 => "png",
            Self::Tiff => "tif",
            Self::R16 => "r16",
            Self::R32 => "r32",
        }
    }

    /// The format of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.name() == name)
    }

    /// The largest code where it holds whole codes over a range, `None` where it holds numbers.
    #[must_use]
    pub const fn largest_code(self) -> Option<u16> {
        match self {
            Self::Png16 | Self::R16 => Some(u16::MAX),
            Self::Png8 => Some(255),
            Self::Exr | Self::Tiff | Self::R32 => None,
        }
    }
}

/// How samples are written.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Writing {
    /// What the lowest and the largest code of a format of codes stand for; values beyond are cut off. `None` takes the
    /// smallest and largest value. Tiles of one world need one range to fit together.
    pub range: Option<[f64; 2]>,
    /// Rounds to codes at random between the two nearest, so that their mean is the value: gentle slopes get a grain of
    /// half a step where rounding gives them terraces. The draw depends on the cell's place in the world alone.
    pub dither: bool,
    /// Names the channel of an OpenEXR file `R`, which some programs ask for, in place of `Y`.
    pub red: bool,
}

/// What a sidecar says beyond the raster itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Meta {
    /// What the values are, such as `height`.
    pub quantity: String,
    /// Symbol of their unit.
    pub unit: String,
    /// Hash of the graph that made them.
    pub graph_hash: Option<String>,
    /// What to type where a program imports the file.
    pub import: Option<serde_json::Map<String, serde_json::Value>>,
}

/// Writes the first plane of a field, and its sidecar beside it; returns what the sidecar says.
///
/// # Errors
/// [`Problem::Unwritable`] when either file cannot be written, [`Problem::NotFinite`] when a format of codes cannot hold it,
/// [`Problem::Stopped`] when `go_on` said no; earlier files of these names are then as they were.
pub fn write(
    path: &Path,
    format: Format,
    field: &Field,
    writing: Writing,
    meta: &Meta,
    go_on: GoOn<'_>,
) -> Result<Sidecar, RasterError> {
    let window = field.window();
    let samples = field.plane(0);
    let [columns, rows] = window.cells;
    let own = field.range(0).map_or([0.0, 0.0], |(lo, hi)| [f64::from(lo), f64::from(hi)]);
    let full = format.largest_code();
    let range = if full.is_some() { writing.range.unwrap_or(own) } else { own };
    if full.is_some() {
        check_finite(samples).map_err(|problem| problem.of(path))?;
    }
    let coding = Coding { range, full: full.unwrap_or_default(), dither: writing.dither };
    let sidecar = Sidecar {
        range: Some(range),
        step: full.map(|full| (range[1] - range[0]) / f64::from(full)),
        dither: (full.is_some() && writing.dither).then_some(true),
        ..Sidecar::of(window, meta)
    };
    let raster = stage(path, go_on, |to| match format {
        Format::Exr => exr::write(to, columns, rows, samples, if writing.red { "R" } else { "Y" }),
        Format::Png16 => {
            let fill = |first: usize, out: &mut [u8]| coding.rows(field, first, out, u16::to_be_bytes);
            let (colour, depth) = (ColorType::Grayscale, BitDepth::Sixteen);
            png::write(to, &Rows { cells: window.cells, colour, depth, srgb: false, fill: &fill })
        }
        Format::Png8 => {
            let fill = |first: usize, out: &mut [u8]| coding.rows(field, first, out, |code| [code as u8]);
            let (colour, depth) = (ColorType::Grayscale, BitDepth::Eight);
            png::write(to, &Rows { cells: window.cells, colour, depth, srgb: false, fill: &fill })
        }
        Format::Tiff => geotiff::write(to, window, samples),
        Format::R16 => {
            let mut codes = vec![0; 2 * samples.len()];
            coding.rows(field, 0, &mut codes, u16::to_le_bytes);
            to.write_all(&codes)
        }
        Format::R32 => to.write_all(&bytes_of(samples, f32::to_le_bytes)),
    })?;
    let beside = sidecar_path(path);
    let text = stage_sidecar(&beside, &sidecar, go_on)?;
    // Both are complete: what may still fail are two renames.
    persist(raster, path)?;
    persist(text, &beside)?;
    Ok(sidecar)
}

/// Writes the sidecar of a file that has none of its own, such as a picture.
///
/// # Errors
/// [`Problem::Unwritable`], and [`Problem::Stopped`] when `go_on` said no; an earlier sidecar is then as it was.
pub fn write_sidecar(path: &Path, sidecar: &Sidecar, go_on: GoOn<'_>) -> Result<(), RasterError> {
    let beside = sidecar_path(path);
    persist(stage_sidecar(&beside, sidecar, go_on)?, &beside)
}

fn stage_sidecar(beside: &Path, sidecar: &Sidecar, go_on: GoOn<'_>) -> Result<NamedTempFile, RasterError> {
    stage(beside, go_on, |to| {
        serde_json::to_writer_pretty(&mut *to, sidecar)?;
        to.write_all(b"\n")
    })
}

/// Writes three planes of linear RGB, 0 to 1, as an 8-bit sRGB picture.
///
/// # Errors
/// [`Problem::Unwritable`], and [`Problem::Stopped`] when `go_on` said no; an earlier file of this name is then as it was.
///
/// # Panics
/// When the field has fewer than three planes: a caller's mistake, never a file's.
pub fn write_colour(path: &Path, field: &Field, go_on: GoOn<'_>) -> Result<(), RasterError> {
    let curve = Srgb::new();
    let fill = |first: usize, out: &mut [u8]| curve.rows::<3>(field, first, out);
    let (cells, colour, depth) = (field.window().cells, ColorType::Rgb, BitDepth::Eight);
    persist(stage(path, go_on, |to| png::write(to, &Rows { cells, colour, depth, srgb: true, fill: &fill }))?, path)
}

/// The pixels of a picture of linear light, red, green and blue of each in turn, with the transfer curve of sRGB.
///
/// # Panics
/// When the field has fewer than three planes: a caller's mistake, never a file's.
#[must_use]
pub fn srgb_bytes(field: &Field) -> Vec<u8> {
    let mut bytes = vec![0; 3 * field.window().len()];
    Srgb::new().rows::<3>(field, 0, &mut bytes);
    bytes
}

/// Writes a file of any kind whole: `fill` writes under a temporary name, which is renamed into place.
///
/// # Errors
/// [`Problem::Unwritable`]; an earlier file of this name is then as it was.
pub fn replace(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), RasterError> {
    persist(stage(path, &|| true, |to| fill(to))?, path)
}

/// A file under its temporary name, which takes no more bytes once it is told to stop.
pub(super) struct Part<'a> {
    file: NamedTempFile,
    go_on: GoOn<'a>,
}

impl Write for Part<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if (self.go_on)() { self.file.write(bytes) } else { Err(io::Error::other("stopped")) }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for Part<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

pub(super) fn stage(
    path: &Path,
    go_on: GoOn<'_>,
    fill: impl FnOnce(&mut BufWriter<Part<'_>>) -> io::Result<()>,
) -> Result<NamedTempFile, RasterError> {
    let unwritable = |error| if go_on() { Problem::Unwritable(error) } else { Problem::Stopped }.of(path);
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".orograph-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Temporary files are private by default; a result is an ordinary file, as the umask would have it.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder).map_err(unwritable)?;
    let _leftover = Leftover::note(file.path(), &[]);
    let mut to = BufWriter::with_capacity(1 << 18, Part { file, go_on });
    fill(&mut to).map_err(unwritable)?;
    to.into_inner().map(|part| part.file).map_err(|error| unwritable(error.into_error()))
}

pub(super) fn persist(file: NamedTempFile, path: &Path) -> Result<(), RasterError> {
    match file.persist(path) {
        Ok(_) => Ok(()),
        Err(error) => Err(Problem::Unwritable(error.error).of(path)),
    }
}

/// Numbers that are worked on at a time: few enough for the innermost cache, enough to be worth a turn.
const BLOCK: usize = 1 << 12;

/// The bytes of numbers, one after the other.
pub(super) fn bytes_of<T: Copy + Sync, const N: usize>(numbers: &[T], bytes: impl Fn(T) -> [u8; N] + Sync) -> Vec<u8> {
    let mut all = vec![0; N * numbers.len()];
    all.par_chunks_mut(N * BLOCK).zip(numbers.par_chunks(BLOCK)).for_each(|(out, numbers)| {
        for (out, number) in out.as_chunks_mut::<N>().0.iter_mut().zip(numbers) {
            *out = bytes(*number);
        }
    });
    all
}

/// How numbers become codes from 0 to `full` over a range.
#[derive(Clone, Copy)]
struct Coding {
    range: [f64; 2],
    full: u16,
    dither: bool,
}

impl Coding {
    /// The bytes of the codes of whole rows of a field's first plane, rounded to the nearest or, with `dither`, at random to one
    /// of the two nearest. A value that is a code stays that code either way.
    fn rows<const N: usize>(self, field: &Field, first: usize, out: &mut [u8], bytes: impl Fn(u16) -> [u8; N] + Sync) {
        let window = field.window();
        let [lo, hi] = self.range;
        // A level raster has no span; all its codes are 0.
        let per_unit = if hi > lo { f64::from(self.full) / (hi - lo) } else { 0.0 };
        let (nx, [column, row]) = (window.nx(), window.origin);
        let samples = field.plane(0)[first * nx..].par_chunks(nx);
        out.par_chunks_mut(N * nx).zip(samples).enumerate().for_each_init(
            || (vec![0.5; nx], vec![0; nx]),
            |(up, codes), (j, (out, samples))| {
                if self.dither {
                    let row = mix(row + (first + j) as u32);
                    for (i, up) in up.iter_mut().enumerate() {
                        *up = f64::from(mix(row ^ (column + i as u32))) / 4_294_967_296.0;
                    }
                }
                encode(codes, samples, up, lo, per_unit, f64::from(self.full));
                for (out, code) in out.as_chunks_mut::<N>().0.iter_mut().zip(codes) {
                    *out = bytes(*code);
                }
            },
        );
    }
}

/// Refuses what has no code.
fn check_finite(samples: &[f32]) -> Result<(), Problem> {
    let infinite = |part: &[f32]| part.iter().map(|v| usize::from(!v.is_finite())).sum::<usize>();
    match samples.par_chunks(BLOCK).map(infinite).sum() {
        0 => Ok(()),
        count => Err(Problem::NotFinite { count }),
    }
}

simd! {
    /// Codes of finite samples: how far they are above `lo` in steps, a part of a step `up`, rounded down.
    fn encode(codes: &mut [u16], samples: &[f32], up: &[f64], lo: f64, per_unit: f64, full: f64) {
        // from here on double precision has whole numbers only, and its last bits are those of the number
        const WHOLE: f64 = 4_503_599_627_370_496.0;
        for ((code, v), up) in codes.iter_mut().zip(samples).zip(up) {
            let at = ((f64::from(*v) - lo) * per_unit + up).max(0.0).min(full);
            let near = (at + WHOLE) - WHOLE;
            let down = if near > at { near - 1.0 } else { near };
            *code = (down + WHOLE).to_bits() as u16;
        }
    }
}

/// The transfer curve of sRGB (IEC 61966-2-1), exact to the nearest 8-bit code, by table.
pub(super) struct Srgb {
    /// Code at the low end of each of 65536 equal steps from 0 to 1.
    start: Vec<u8>,
    /// Linear value from which a code becomes the next.
    next: [f32; 256],
}

impl Srgb {
    pub(super) fn new() -> Self {
        let linear = |v: f64| if v <= 0.04045 { v / 12.92 } else { math::pow((v + 0.055) / 1.055, 2.4) };
        let mut next = [f32::INFINITY; 256];
        for (code, limit) in next.iter_mut().enumerate().take(255) {
            *limit = linear((code as f64 + 0.5) / 255.0) as f32;
        }
        // The narrowest code is twenty steps wide, so two steps hold at most one limit; entries begin one step early,
        // for the index may be rounded up.
        let mut code = 0;
        let start = (0..=65_535_u32)
            .map(|step| {
                while next[usize::from(code)] <= step.saturating_sub(1) as f32 / 65_535.0 {
                    code += 1;
                }
                code
            })
            .collect();
        Self { start, next }
    }

    /// Fills the first three of `N` bytes of the pixels of whole rows.
    pub(super) fn rows<const N: usize>(&self, field: &Field, first: usize, out: &mut [u8]) {
        let nx = field.window().nx();
        let [red, green, blue] = [0, 1, 2].map(|plane| field.plane(plane));
        out.par_chunks_mut(N * nx).enumerate().for_each(|(j, out)| {
            let row = (first + j) * nx..(first + j + 1) * nx;
            let light = red[row.clone()].iter().zip(&green[row.clone()]).zip(&blue[row]);
            for (out, ((r, g), b)) in out.as_chunks_mut::<N>().0.iter_mut().zip(light) {
                out[..3].copy_from_slice(&[self.code(*r), self.code(*g), self.code(*b)]);
            }
        });
    }

    fn code(&self, linear: f32) -> u8 {
        let v = linear.clamp(0.0, 1.0);
        let code = self.start[(v * 65_535.0) as usize];
        code + u8::from(v >= self.next[usize::from(code)])
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Window, World};

    use super::*;
    use crate::testing::at_every_level;

    fn level(value: f32) -> Field {
        let world = World { size: [200.0, 100.0], cells: [200, 100], ..World::default() };
        Field::constant(Window::whole(world), value)
    }

    /// Codes from 0 to 65535 of the numbers from 0 to 65535.
    fn codes(field: &Field, dither: bool) -> Vec<u16> {
        let coding = Coding { range: [0.0, 65_535.0], full: u16::MAX, dither };
        let mut bytes = vec![0; 2 * field.window().len()];
        coding.rows(field, 0, &mut bytes, u16::to_le_bytes);
        bytes.as_chunks().0.iter().map(|bytes| u16::from_le_bytes(*bytes)).collect()
    }

    #[test]
    fn dither_keeps_the_mean_and_whole_codes() {
        let drawn = codes(&level(100.3), true);
        assert!(drawn.iter().all(|code| *code == 100 || *code == 101));
        let mean = drawn.iter().map(|code| f64::from(*code)).sum::<f64>() / drawn.len() as f64;
        // 20000 draws: the mean is off by 0.0032 in one of three cases
        assert!((mean - 100.3).abs() < 0.013, "{mean}");
        for value in [0.0, 777.0, 65_535.0] {
            assert!(codes(&level(value), true).iter().all(|code| f32::from(*code) == value));
        }
        assert!(codes(&level(100.5), false).iter().all(|code| *code == 101));
    }

    /// Rounding by the bits of large numbers is rounding down after a half, in every case and at every width of vectors.
    #[test]
    fn codes_are_the_nearest() {
        let window = *level(0.0).window();
        let draw = |cell: u32| match cell % 5 {
            0 => (mix(cell) % 65_536) as f32,
            1 => (mix(cell) % 65_536) as f32 + 0.5,
            2 => (mix(cell) % 70_000) as f32 - 2000.25,
            3 => mix(cell) as f32 / 65_536.0,
            _ => [f32::MAX, f32::MIN, -0.0, 1e-40, 65_534.5, 65_535.5][cell as usize / 5 % 6],
        };
        let field = Field::new(window, (0..20_000).map(draw).collect());
        let expected = |v: &f32| (f64::from(*v) + 0.5).clamp(0.0, 65_535.0) as u16;
        let expected: Vec<u16> = field.samples().iter().map(expected).collect();
        assert!(codes(&field, false) == expected);
        at_every_level(|| codes(&field, false));
    }

    #[test]
    fn dither_belongs_to_the_place() {
        let field = level(7.5);
        let whole = codes(&field, true);
        let part = Window { origin: [50, 20], cells: [40, 30], ..*field.window() };
        for (j, row) in codes(&field.crop(&part), true).chunks(40).enumerate() {
            assert_eq!(row, &whole[(20 + j) * 200 + 50..][..40]);
        }
    }
}
