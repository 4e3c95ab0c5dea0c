//! Tests that decode the files for each engine as the engine does.

use orograph_graph::{World, mix};

use crate::export::engine::*;
use crate::testing::field;

const ALL: [Engine; 3] = [Engine::Unreal, Engine::Unity, Engine::Godot];
const KINDS: [PortType; 5] = [PortType::Height, PortType::Mask, PortType::Weights, PortType::Colour, PortType::Normal];

fn fit(engine: Engine, ty: PortType, value: &Field) -> Vec<Piece> {
    fit_tiles(engine, ty, value, Tiles::WHOLE)
}

fn fit_tiles(engine: Engine, ty: PortType, value: &Field, tiles: Tiles) -> Vec<Piece> {
    engine.fit(&Exported { ty, value, tiles, dither: false, go_on: &|| true }).expect("not stopped")
}

fn height(engine: Engine, value: &Field) -> Piece {
    fit(engine, PortType::Height, value).remove(0)
}

fn number(piece: &Piece, name: &str) -> f64 {
    piece.import[name].as_f64().expect("a number to type")
}

fn range(piece: &Piece) -> [f64; 2] {
    let Content::Numbers(_, Writing { range: Some(range), .. }) = piece.content else { panic!("codes over a range") };
    range
}

/// A field of several planes; `value` computes each sample.
fn drawn(cells: [u32; 2], planes: usize, value: impl Fn(usize, u32) -> f32) -> Field {
    let world = World { size: cells.map(|n| f64::from(n) * 10.0), cells, ..World::default() };
    let window = Window::whole(world);
    let len = window.len() as u32;
    let samples = (0..planes).flat_map(|plane| (0..len).map(move |cell| (plane, cell)));
    Field::with_planes(window, planes, samples.map(|(plane, cell)| value(plane, cell)).collect())
}

/// Weights of four layers with hard and soft borders.
fn shares(cells: [u32; 2]) -> Field {
    let raw = drawn(cells, 4, |plane, cell| {
        let draw = mix(cell / 5 * 4 + plane as u32) % 1000;
        if draw < 300 { 0.0 } else { draw as f32 }
    });
    let sums: Vec<f32> =
        (0..raw.window().len()).map(|cell| (0..4).map(|plane| raw.plane(plane)[cell]).sum::<f32>().max(1.0)).collect();
    drawn(cells, 4, |plane, cell| raw.plane(plane)[cell as usize] / sums[cell as usize])
}

fn sample(ty: PortType, cells: [u32; 2]) -> Field {
    match ty {
        PortType::Weights => shares(cells),
        PortType::Colour => drawn(cells, 3, |plane, cell| (mix(cell + 7 * plane as u32) % 256) as f32 / 255.0),
        PortType::Normal => drawn(cells, 3, |plane, _| [0.6, 0.0, 0.8][plane]),
        PortType::Mask => field(cells, 10.0, |x, y| 0.5 + 0.5 * f64::from(((x + 2.0 * y) as f32 / 90.0).fract())),
        _ => field(cells, 10.0, |x, y| 0.2 * x + 40.0 * f64::from((y as f32 / 130.0).fract())),
    }
}

/// The sizes recommended by Epic, from the nearest powers of two.
#[test]
fn landscapes_have_sizes_that_unreal_accepts() {
    for (cells, vertices, components) in
        [(64, 127, "1 x 1"), (256, 253, "2 x 2"), (512, 505, "4 x 4"), (1024, 1009, "8 x 8"), (2048, 2017, "16 x 16")]
    {
        let piece = height(Engine::Unreal, &field([cells; 2], 4.0, |x, y| x + y));
        assert_eq!(piece.field.window().cells, [vertices; 2]);
        assert_eq!(piece.import["Number of Components"], components);
        let spacing = f64::from(cells) * 400.0 / f64::from(vertices - 1);
        assert!((number(&piece, "Scale X") / spacing - 1.0).abs() < 5e-9, "nine digits of {spacing}");
    }
    let wide = height(Engine::Unreal, &field([4200, 40], 2.0, |x, _| x));
    assert_eq!(wide.field.window().cells, [4319, 255]);
    assert_eq!(wide.import["Section Size"], "127x127 Quads");
}

/// Decoded as Unreal does, the lowest and highest codes give the lowest and highest heights.
#[test]
fn codes_become_heights_again_in_unreal() {
    let piece = height(Engine::Unreal, &field([256; 2], 8.0, |x, y| 0.4 * x - 0.2 * y - 90.0));
    let [low, high] = range(&piece);
    let metres =
        |code: f64| (number(&piece, "Location Z") + (code - 32_768.0) / 128.0 * number(&piece, "Scale Z")) / 100.0;
    // numbers of nine digits: half a unit of the last is 5e-9 of some 1e4 cm
    assert!((metres(0.0) - low).abs() < 1e-6 && (metres(65_535.0) - high).abs() < 1e-6);
}

#[test]
fn terrains_have_sizes_that_unity_accepts() {
    for (cells, side) in [([20, 10], 33), ([512, 512], 513), ([1024, 500], 1025), ([5000, 40], 4097)] {
        let piece = height(Engine::Unity, &field(cells, 3.0, |x, y| 50.0 + x * 0.1 + y));
        assert_eq!(piece.field.window().cells, [side; 2]);
        assert_eq!(number(&piece, "Terrain Width"), f64::from(cells[0]) * 3.0);
        assert_eq!(number(&piece, "Terrain Length"), f64::from(cells[1]) * 3.0);
        let [low, high] = range(&piece);
        let typed = [number(&piece, "Position Y"), number(&piece, "Terrain Height")];
        let near = |[typed, whole]: [f64; 2]| (typed - whole).abs() <= 5e-9 * whole.abs(); // nine digits
        assert!(near([typed[0], low]) && near([typed[1], high - low]), "{typed:?} {low} {high}");
        for ty in [PortType::Mask, PortType::Weights] {
            let control = fit(Engine::Unity, ty, &sample(ty, cells)).remove(0);
            assert_eq!(control.field.window().cells, [side - 1; 2]);
            assert_eq!(number(&control, "Control Texture Resolution"), f64::from(side - 1));
        }
    }
}

/// A plane is still a plane at finer vertices; at coarser ones, the average of whole and partial cells is offset by up
/// to an eighth of a cell.
#[test]
fn vertices_have_the_heights_of_their_positions() {
    for (cells, most) in [(90, 1e-3), (300, 10.0 / 8.0 * (0.3 + 0.2))] {
        let plane = |x: f64, y: f64| 0.3 * x - 0.2 * y + 7.0;
        let piece = height(Engine::Unreal, &field([cells; 2], 10.0, plane));
        let vertices = piece.field.window().cells[0] as usize;
        let spacing = number(&piece, "Scale X") / 100.0;
        for j in 3..vertices - 3 {
            for i in 3..vertices - 3 {
                let expected = plane(i as f64 * spacing, j as f64 * spacing);
                let got = f64::from(piece.field.samples()[j * vertices + i]);
                assert!((got - expected).abs() < most, "{i} {j}: {got} {expected}"); // heights are single precision
            }
        }
    }
}

/// Every file of an engine has the size that the engine requires, whatever the world's, and each output has one file
/// per name.
#[test]
fn files_of_an_engine_align() {
    for cells in [[100, 100], [192, 64], [3, 500], [1, 1]] {
        for engine in ALL {
            let land = height(engine, &sample(PortType::Height, cells)).field.window().cells;
            for ty in KINDS {
                let pieces = fit(engine, ty, &sample(ty, cells));
                assert_eq!(pieces.len(), engine.ends(ty).len(), "{engine:?} {ty}");
                for piece in &pieces {
                    let found = piece.field.window().cells;
                    let texture = matches!(ty, PortType::Colour | PortType::Normal) && engine != Engine::Godot;
                    match (texture, engine) {
                        (true, _) => assert!(found.iter().all(|n| n.is_power_of_two()), "{found:?}"),
                        (false, Engine::Unity) if ty != PortType::Height => assert_eq!(found, land.map(|n| n - 1)),
                        (false, Engine::Godot) => assert_eq!(found, cells, "as the importer asks"),
                        _ => assert_eq!(found, land, "{engine:?} {ty}"),
                    }
                    assert!(piece.field.samples().iter().all(|v| v.is_finite()));
                    assert!(piece.import.contains_key("Where"), "{engine:?} {ty}");
                }
            }
            for ty in [PortType::Scalar(orograph_graph::Unit::Degrees), PortType::Lines, PortType::Report] {
                assert!(engine.ends(ty).is_empty());
            }
        }
    }
}

/// A mask that equals the height, scaled to 0 to 1, still equals it in every engine: both have the same value at every
/// vertex, including the corners, so that splat maps align with the terrain.
#[test]
fn masks_align_with_the_terrain() {
    for cells in [[90, 90], [300, 200], [64, 64]] {
        let [width, length] = cells.map(|n| f64::from(n) * 10.0);
        let ramp = move |x: f64, y: f64| 0.5 * (x / width + y / length);
        let mask = field(cells, 10.0, ramp);
        let layers = drawn(cells, 4, |plane, cell| match plane {
            0 => 1.0 - mask.samples()[cell as usize],
            2 => mask.samples()[cell as usize],
            _ => 0.0,
        });
        for engine in ALL {
            let land = height(engine, &field(cells, 10.0, |x, y| 700.0 * ramp(x, y) - 100.0)).field;
            let shown = fit(engine, PortType::Mask, &mask).remove(0).field;
            let of_layers = fit(engine, PortType::Weights, &layers);
            let painted = match engine {
                Engine::Unreal => of_layers[2].field.clone(),
                _ => Field::new(*of_layers[0].field.window(), of_layers[0].field.plane(2).to_vec()),
            };
            let ([nx, ny], [mx, my]) = (land.window().cells, shown.window().cells);
            let code =
                |field: &Field, i: u32, j: u32| f64::from(field.samples()[(j * field.window().cells[0] + i) as usize]);
            for j in [0, 1, my / 3, my / 2, my - 2, my - 1] {
                for i in [0, 1, mx / 3, mx / 2, mx - 2, mx - 1] {
                    // position of this texel in the engine, in vertices of the terrain
                    let at = |index: u32, texels: u32, vertices: u32| {
                        f64::from(index) / f64::from(texels - 1) * f64::from(vertices - 1)
                    };
                    let (x, y) = (at(i, mx, nx), at(j, my, ny));
                    let between = |v: f64, n: u32| ((v as u32).min(n - 2), v - f64::from((v as u32).min(n - 2)));
                    let ((a, s), (b, t)) = (between(x, nx), between(y, ny));
                    let across = |j: u32| code(&land, a, j) * (1.0 - s) + code(&land, a + 1, j) * s;
                    let height = (across(b) * (1.0 - t) + across(b + 1) * t + 100.0) / 700.0;
                    let mask = code(&shown, i, j);
                    // if texels and vertices differ in number, each averages its own cells, at most an eighth of a cell
                    // apart
                    let most = if [mx, my] == [nx, ny] { 1e-6 } else { 0.125 / f64::from(cells[1]) + 1e-6 };
                    assert!((mask - height).abs() < most, "{engine:?} {cells:?} ({i}, {j}): {mask} {height}");
                    let layer = code(&painted, i, j);
                    assert!((layer - mask).abs() <= 0.51 / 255.0, "{engine:?} ({i}, {j}): {layer} {mask}");
                }
            }
        }
    }
}

#[test]
fn layers_sum_to_255_in_every_pixel() {
    for cells in [[64, 64], [200, 150], [3, 300]] {
        let layers = fit(Engine::Unreal, PortType::Weights, &shares(cells));
        for pixel in 0..layers[0].field.window().len() {
            // as written: integer codes, rounded
            let codes = layers.iter().map(|layer| (layer.field.samples()[pixel] * 255.0 + 0.5) as u32);
            assert_eq!(codes.sum::<u32>(), 255);
        }
        assert!(layers.iter().all(|layer| layer.content == Content::numbers(PortType::Mask, Format::Png8, false)));
        let control = fit(Engine::Unity, PortType::Weights, &shares(cells)).remove(0);
        assert_eq!((control.content, control.field.planes()), (Content::Weights, 4));
    }
}

/// Texels fill the world: for texels larger than a cell, the mean of a picture is that of its source, and a border in
/// the middle stays in the middle.
#[test]
fn textures_fill_the_world() {
    let colour = drawn([96, 96], 3, |plane, cell| if cell % 96 < 48 { 0.2 } else { 0.7 + 0.1 * plane as f32 });
    for engine in [Engine::Unreal, Engine::Unity] {
        let piece = fit(engine, PortType::Colour, &colour).remove(0);
        assert_eq!((piece.field.window().cells, piece.content), ([64; 2], Content::Colour));
        for plane in 0..3 {
            let row = &piece.field.plane(plane)[..64];
            assert!(row[..32].iter().all(|v| (v - 0.2).abs() < 1e-6));
            assert!(row[32..].iter().all(|v| (v - 0.7 - 0.1 * plane as f32).abs() < 1e-6));
        }
    }
    let tint = fit(Engine::Godot, PortType::Colour, &colour).remove(0);
    assert_eq!((&tint.field, tint.content), (&colour, Content::Tint));
    let turned = drawn([100, 50], 3, |plane, cell| {
        let east = if cell % 100 < 43 { 0.6 } else { -0.6 };
        [east, 0.0, 0.8][plane]
    });
    let normals = fit(Engine::Unreal, PortType::Normal, &turned).remove(0).field;
    assert_eq!(normals.window().cells, [128, 64]);
    for cell in 0..normals.window().len() {
        let length = (0..3).map(|plane| normals.plane(plane)[cell] * normals.plane(plane)[cell]).sum::<f32>();
        assert!((length - 1.0).abs() < 1e-5, "{length}"); // single precision
    }
}

/// Scales that map a texture over a landscape exactly once, when its squares are counted.
#[test]
fn a_texture_covers_a_landscape_once() {
    let piece = fit(Engine::Unreal, PortType::Colour, &sample(PortType::Colour, [1024, 512])).remove(0);
    let [across, down] = height(Engine::Unreal, &field([1024, 512], 2.0, |x, _| x)).field.window().cells;
    let scale = number(&piece, "Landscape Layer Coords, Mapping Scale");
    assert_eq!(f64::from(across - 1) / scale, 1.0);
    let v = f64::from(down - 1) / scale * number(&piece, "V times");
    assert!((v - 1.0).abs() < 1e-8, "nine digits of {v}");
    let square = fit(Engine::Unreal, PortType::Colour, &sample(PortType::Colour, [128, 128])).remove(0);
    assert!(!square.import.contains_key("V times"));
}

#[test]
fn terrain3d_keeps_the_cells() {
    let land = field([192, 128], 5.0, |x, _| x);
    let piece = height(Engine::Godot, &land);
    assert_eq!(piece.field, land);
    assert_eq!((number(&piece, "Region Size"), number(&piece, "Vertex Spacing")), (64.0, 5.0));
    let Content::Numbers(Format::Exr, writing) = piece.content else { panic!("real numbers") };
    assert!(writing.red && writing.range.is_none());
    for (cells, region) in [([4096, 2048], 2048.0), ([1000, 1000], 256.0), ([5000, 3], 512.0), ([2112, 64], 256.0)] {
        let piece = height(Engine::Godot, &field(cells, 5.0, |x, _| x));
        assert_eq!(number(&piece, "Region Size"), region, "{cells:?}");
        assert!(region * 16.0 >= f64::from(cells[0]), "16 regions hold it");
    }
    assert!(Engine::Godot.check([32_768, 16], None).is_ok() && Engine::Unreal.check([40_000, 4], None).is_ok());
    let refused = Engine::Godot.check([4, 40_000], None).expect_err("too long");
    assert!(refused.message.contains("32768") && refused.message.contains("4 x 40000"), "{refused}");
}

#[test]
fn level_and_tiny_worlds_have_an_extent() {
    for engine in ALL {
        let piece = height(engine, &field([1, 1], 1000.0, |_, _| -5.0));
        assert!(piece.field.samples().iter().all(|v| *v == -5.0));
        assert!(engine == Engine::Godot || range(&piece) == [-5.0, -4.0], "{engine:?}");
    }
    for ty in KINDS {
        let value = &sample(ty, [9, 9]);
        let stopped = Exported { ty, value, tiles: Tiles::WHOLE, dither: false, go_on: &|| false };
        assert!(Engine::Unity.fit(&stopped).is_err(), "it stops");
    }
}

/// Tiles have sizes that the engine accepts, one range, and the same vertices along their common edges; together they
/// are the whole.
#[test]
fn tiles_fit_together() {
    let tiles: Tiles = "3x2".parse().expect("tiles");
    let land = sample(PortType::Height, [900, 400]);
    for (engine, side) in [(Engine::Unreal, [253, 253]), (Engine::Unity, [257, 257])] {
        let whole = fit_tiles(engine, PortType::Height, &land, tiles).remove(0);
        let cut = |tile| whole.field.crop(&tiles.window(whole.field.window(), tile, whole.shared));
        for [column, row] in tiles.each() {
            let tile = cut([column, row]);
            assert_eq!(tile.window().cells, side, "{engine:?}");
            let [nx, ny] = side.map(|n| n as usize);
            if column < 2 {
                let east = cut([column + 1, row]);
                assert!((0..ny).all(|j| tile.samples()[j * nx + nx - 1] == east.samples()[j * nx]));
            }
            if row < 1 {
                let south = cut([column, row + 1]);
                assert_eq!(tile.samples()[(ny - 1) * nx..], south.samples()[..nx]);
            }
        }
        // layers have the vertices of the heights, or one texel fewer per tile; textures have no common pixels
        let layer = fit_tiles(engine, PortType::Mask, &sample(PortType::Mask, [900, 400]), tiles).remove(0);
        let texels = if engine == Engine::Unreal { 253 } else { 256 };
        assert_eq!(tiles.window(layer.field.window(), [2, 1], layer.shared).cells, [texels; 2]);
        let colour = fit_tiles(engine, PortType::Colour, &sample(PortType::Colour, [900, 400]), tiles).remove(0);
        assert_eq!((colour.shared, colour.field.window().cells), (0, [768, 512]));
    }
    assert!(Engine::Godot.check([900, 400], Some(tiles)).expect_err("whole maps").hint.is_some());
}

/// The same numbers for any number of threads.
#[test]
fn threads_change_nothing() {
    let made = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let mut bits = Vec::new();
            for engine in ALL {
                for ty in KINDS {
                    for piece in fit(engine, ty, &sample(ty, [150, 90])) {
                        bits.extend(piece.field.samples().iter().map(|v| v.to_bits()));
                    }
                }
            }
            bits
        })
    };
    assert!(made(1) == made(5));
}
