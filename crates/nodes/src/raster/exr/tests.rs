//! Tests of blocks: tiles, orders, levels, several channels and layers.

use std::io::Cursor;

use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes, LineOrder,
    SmallVec, Vec2, WritableImage, f16,
};

use super::open;
use crate::raster::{Problem, reader::Reader, tests::memory};

const COLUMNS: usize = 53;
const ROWS: usize = 41;

fn heights() -> Vec<f32> {
    (0..COLUMNS * ROWS).map(|at| ((at * 7919) % 10_007) as f32 * 0.25 - 500.0).collect()
}

/// A file with the channels `A`, `Y` and `depth`, of which `Y` has the heights.
fn file(encoding: Encoding, heights: FlatSamples) -> Vec<u8> {
    let other = |value: f32| FlatSamples::F32(vec![value; COLUMNS * ROWS]);
    let mut channels = SmallVec::new();
    channels.push(AnyChannel::new("Y", heights));
    channels.push(AnyChannel::new("A", FlatSamples::U32(vec![7; COLUMNS * ROWS])));
    channels.push(AnyChannel::new("depth", other(9.0)));
    let layer = Layer::new((COLUMNS, ROWS), LayerAttributes::named("terrain"), encoding, AnyChannels::sort(channels));
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).expect("a file");
    bytes.into_inner()
}

/// A square file with one channel of equal heights.
fn flat(side: usize, height: f32, encoding: Encoding) -> Vec<u8> {
    let mut channels = SmallVec::new();
    channels.push(AnyChannel::new("Y", FlatSamples::F32(vec![height; side * side])));
    let layer = Layer::new((side, side), LayerAttributes::default(), encoding, AnyChannels::sort(channels));
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).expect("a file");
    bytes.into_inner()
}

fn read(bytes: &[u8]) -> Result<Vec<f32>, Problem> {
    open(memory(bytes), None)?.raster(&|| true).map(|raster| raster.samples)
}

#[test]
fn blocks_are_read_in_any_order() {
    let heights = heights();
    let blocks = [Blocks::ScanLines, Blocks::Tiles(Vec2(16, 8)), Blocks::Tiles(Vec2(64, 64))];
    let orders = [LineOrder::Increasing, LineOrder::Decreasing];
    let compressions = [Compression::Uncompressed, Compression::ZIP16, Compression::PIZ, Compression::RLE];
    for blocks in blocks {
        for line_order in orders {
            for compression in compressions {
                let encoding = Encoding { compression, blocks, line_order };
                let file = file(encoding, FlatSamples::F32(heights.clone()));
                assert!(read(&file).expect("readable") == heights, "{encoding:?}");
            }
        }
    }
}

#[test]
fn samples_of_all_types_become_numbers() {
    let encoding = Encoding::FAST_LOSSLESS;
    let halves: Vec<f16> = heights().into_iter().map(f16::from_f32).collect();
    let told: Vec<f32> = halves.iter().map(|v| v.to_f32()).collect();
    assert!(read(&file(encoding, FlatSamples::F16(halves))).expect("readable") == told);
    let whole: Vec<u32> = (0..(COLUMNS * ROWS) as u32).collect();
    let told: Vec<f32> = whole.iter().map(|v| *v as f32).collect();
    assert!(read(&file(encoding, FlatSamples::U32(whole))).expect("readable") == told);
}

#[test]
fn a_large_file_is_read_in_little_memory() {
    let side = 4096;
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let bytes = flat(side, 1.0, encoding);
    let reader = open(memory(&bytes), None).expect("readable");
    // a block, its unpacked and its stored bytes, and the places of the blocks, where the whole takes 64 MiB
    assert!(reader.bytes() < 4 << 20, "{}", reader.bytes());
    let mut next = 0;
    let voids = reader.read(&|| true, &mut |first, block| {
        assert_eq!(first, next, "blocks come from north to south");
        assert!(block.iter().all(|v| *v == 1.0));
        next += block.len() / side;
        Ok(())
    });
    assert_eq!((voids.expect("readable").cells, next), (0, side));
}

#[test]
fn exchanged_and_absent_blocks_are_refused() {
    let encoding = Encoding {
        compression: Compression::Uncompressed,
        blocks: Blocks::Tiles(Vec2(16, 8)),
        line_order: LineOrder::Increasing,
    };
    let whole = file(encoding, FlatSamples::F32(heights()));
    // the table of places, whose first entry is the place behind the table
    let entries = COLUMNS.div_ceil(16) * ROWS.div_ceil(8);
    let is_table = |at: &usize| {
        let number = |at: usize| whole.get(at..at + 8).map(|b| u64::from_le_bytes(b.try_into().expect("8 bytes")));
        number(*at) == Some((at + 8 * entries) as u64)
    };
    let table = (0..whole.len()).find(is_table).expect("a table");
    let mut exchanged = whole.clone();
    let (first, second) = exchanged[table..table + 16].split_at_mut(8);
    first.swap_with_slice(second);
    assert!(matches!(read(&exchanged), Err(Problem::Damaged(_))));
    let mut beyond = whole.clone();
    beyond[table..table + 8].copy_from_slice(&(1_u64 << 40).to_le_bytes());
    assert!(matches!(read(&beyond), Err(Problem::Truncated(_))));
    assert!(matches!(read(&whole[..table + 8]), Err(Problem::Truncated(_))));
    assert!(matches!(read(&whole[..whole.len() - 9]), Err(Problem::Truncated(_) | Problem::Damaged(_))));
}

#[test]
fn blocks_too_large_for_memory_are_refused() {
    // a single tile of 4096 x 4096 numbers is 64 MiB
    let side = 4096;
    let encoding = Encoding {
        compression: Compression::RLE,
        blocks: Blocks::Tiles(Vec2(side, side)),
        line_order: LineOrder::Increasing,
    };
    let bytes = flat(side, 0.0, encoding);
    let problem = open(memory(&bytes), None).map(|_: Reader<'_>| ()).unwrap_err();
    assert!(matches!(problem, Problem::Unsupported { .. }), "{problem}");
}
