//! What each node is shown on in the manual, and what is drawn on it.

use orograph_nodes::numerics::palettes::Palette;

use super::lands::{
    BANK, BROAD_M, CLIFFS, CLIFFS_M, CLOSE_M, HILLS, HOLLOWS, LAYERED, Land, MOUNTAINS, REAL, REAL_M, SCAN, SOFT,
};

/// How a node is shown.
pub(super) struct Subject {
    /// The node.
    pub(super) id: &'static str,
    /// Its arguments.
    pub(super) arguments: &'static str,
    /// Side of the world in metres.
    pub(super) side_m: f64,
    /// The terrain, if it needs one.
    pub(super) land: Land,
    /// The output that is drawn, if not the first raster.
    pub(super) output: Option<&'static str>,
    /// The colours of heights, if not those of a map.
    pub(super) palette: Option<Palette>,
}

impl Subject {
    /// Returns true if the land has the terrain that nodes are wired to.
    pub(super) fn has_base(&self) -> bool {
        self.land.iter().any(|(name, ..)| *name == "base")
    }

    /// Draws another output.
    const fn of(self, output: &'static str) -> Self {
        Self { output: Some(output), ..self }
    }

    /// Draws heights in other colours.
    const fn in_colours(self, palette: Palette) -> Self {
        Self { palette: Some(palette), ..self }
    }
}

const fn shown(id: &'static str, side_m: f64, land: Land, arguments: &'static str) -> Subject {
    Subject { id, arguments, side_m, land, output: None, palette: None }
}

/// Nodes in the order of the manual.
pub(super) const SUBJECTS: &[Subject] = &[
    shown("Constant", 1000.0, &[], "value: 250"),
    shown("Crater", 60_000.0, &[], r#"diameter: "26 km", smallest: 700, cover: 0.1, seed: 3"#)
        .in_colours(Palette::Desert),
    shown("Diffused", BROAD_M, &[], "correlation: 1000, octaves: 1"),
    shown("Dunes", 7000.0, &[], "").in_colours(Palette::Desert),
    shown("Faults", 30_000.0, &[], "faults: 150, throw: 500, spread: 25, length: 24000, seed: 2"),
    shown("Fractal", BROAD_M, &[], r#"kind: eroded, wavelength: "6 km", gain: 0.48, amplitude: "1.2 km", seed: 2"#),
    shown("Gradient", BROAD_M, &[], "form: radial, from: 900, to: 0, length: 7000"),
    shown(
        "Island",
        BROAD_M,
        &[
            ("hills", "Fractal", r#"kind: eroded, wavelength: "6 km", gain: 0.46, amplitude: "800 m", seed: 14"#),
            ("base", "Combine", r#"a: "hills", b: 900"#),
        ],
        r#"height: "base", slope: 2500, irregularity: 0.8, seed: 3"#,
    ),
    shown("Noise", BROAD_M, &[], "amplitude: 900, seed: 4"),
    shown(
        "Paint",
        BROAD_M,
        HILLS,
        r#"height: "base", strokes: [(tool: raise, radius: 2600, strength: 1200, hardness: 0, points: [(4000, 11000), (7000, 9000), (11000, 8800)]), (tool: lower, radius: 1600, strength: 900, hardness: 0, points: [(5000, 4000), (9000, 4600), (13000, 3000)])]"#,
    ),
    shown("Path", BROAD_M, &[], "points: [(1500, 3000), (at: (8000, 9000), width: 900), (14500, 12000)], width: 300"),
    shown("Perlin", BROAD_M, &[], "amplitude: 900, seed: 3"),
    shown("Range", BROAD_M, &[], "height: 3000, front: 3000, back: 4000, spacing: 3500, seed: 8"),
    shown("Ridged", 24_000.0, &[], ""),
    shown(
        "Route",
        REAL_M,
        REAL,
        r#"height: "base", path: [(1500, 13500), (13000, 2500)], spacing: 40, grade: 0.1, width: 100"#,
    ),
    shown("Shape", BROAD_M, &[], "figure: ellipse, size: (6000, 10000), azimuth: 30"),
    shown("Spectral", 20_000.0, &[], "relief: 350, beta: 3, seed: 5"),
    shown("Volcano", BROAD_M, &[], "height: 1900, gullies: 0.45"),
    shown("Import", REAL_M, &[], r#"file: "data/bigtujunga_512_30m.tif", placement: stretch"#),
    shown("Clamp", BROAD_M, HILLS, r#"value: "base", low: -120, high: 260, knee: 40"#),
    shown(
        "Combine",
        BROAD_M,
        &[
            ("base", "Fractal", r#"kind: eroded, wavelength: "6 km", gain: 0.46, amplitude: "800 m", seed: 14"#),
            ("cone", "Volcano", "centre: (9000, 8000), height: 1500, radius: 6000, gullies: 0.4"),
        ],
        r#"a: "base", b: "cone", mode: smooth_max, radius: 150"#,
    ),
    shown(
        "Curve",
        BROAD_M,
        HILLS,
        r#"value: "base", points: [(-900, -60), (-60, 0), (20, 280), (160, 330), (220, 560), (1000, 700)]"#,
    ),
    shown(
        "Match",
        BROAD_M,
        &[
            ("noise", "Perlin", r#"wavelength: "5 km", amplitude: "700 m", seed: 12"#),
            ("base", "Combine", r#"a: "noise", b: 1200"#),
            ("real", "Import", r#"file: "data/bigtujunga_512_30m.tif", placement: stretch"#),
        ],
        r#"value: "base", reference: "real""#,
    ),
    shown(
        "Normalise",
        BROAD_M,
        &[("base", "Fractal", r#"kind: eroded, wavelength: "6 km", gain: 0.46, amplitude: "250 m", seed: 14"#)],
        r#"value: "base", measure: percentiles, to: (200, 1500)"#,
    ),
    shown("Remap", REAL_M, REAL, r#"value: "base", from: (600, 1900), to: (2, 14), quantity: scalar"#),
    shown(
        "Bilateral",
        2500.0,
        &[
            ("scarp", "Gradient", "from: 0, to: 110, centre: (1200, 1300), azimuth: 60, length: 90"),
            ("broad", "Perlin", r#"wavelength: "1.6 km", octaves: 7, amplitude: "160 m", seed: 9"#),
            ("bent", "Warp", r#"value: "scarp", displacement: 260, wavelength: 1300"#),
            ("error", "Perlin", r#"wavelength: 40, octaves: 2, amplitude: "22 m", seed: 5"#),
            ("true", "Combine", r#"a: "bent", b: "broad""#),
            ("base", "Combine", r#"a: "true", b: "error""#),
        ],
        r#"value: "base", radius: 60, contrast: 30"#,
    ),
    shown("Blur", REAL_M, REAL, r#"value: "base", radius: 250"#),
    shown(
        "Carve",
        8000.0,
        &[("base", "Fractal", r#"kind: eroded, wavelength: "6 km", gain: 0.46, amplitude: "420 m", seed: 21"#)],
        r#"height: "base", path: [(600, 600), (2900, 2600), (4300, 4600), (4500, 6200), (4200, 8200)], width: 160, depth: 60, bank: 600"#,
    ),
    shown("Despike", 8000.0, SCAN, r#"height: "base", radius: 200, threshold: 3"#),
    shown("Drain", 8000.0, HOLLOWS, r#"height: "base", cut: 0.4"#),
    shown("Median", 8000.0, SCAN, r#"value: "base", radius: 200"#),
    shown(
        "Morphology",
        BROAD_M,
        &[
            ("patches", "Perlin", r#"wavelength: "4 km", amplitude: "1 m", seed: 3"#),
            ("mask", "Select", r#"value: "patches", from: 0.05, falloff: 0"#),
        ],
        r#"value: "mask", radius: 250"#,
    ),
    shown("Resample", REAL_M, REAL, r#"value: "base", cell: 480, interpolation: cells"#),
    shown(
        "Sharpen",
        REAL_M,
        &[
            ("model", "Import", r#"file: "data/bigtujunga_512_30m.tif", placement: stretch"#),
            ("base", "Blur", r#"value: "model", radius: 120"#),
        ],
        r#"height: "base", radius: 200, amount: 1.5"#,
    ),
    shown(
        "Smear",
        4000.0,
        &[
            ("patches", "Perlin", r#"wavelength: 420, octaves: 8, gain: 0.6, amplitude: "1 m", seed: 3"#),
            ("snow", "Select", r#"value: "patches", from: 0.12, falloff: 0.1"#),
        ],
        r#"value: "snow", azimuth: 70, length: 700, side: ahead"#,
    ),
    shown("SmoothLines", BROAD_M, &[], r#"lines: "path.lines", course: 4000, profile: 4000"#),
    shown(
        "Terrace",
        6000.0,
        &[("base", "Fractal", r#"kind: eroded, wavelength: "6 km", gain: 0.44, amplitude: "520 m", seed: 31"#)],
        r#"height: "base", step: 90, sharpness: 5"#,
    ),
    shown("Tile", REAL_M, REAL, r#"value: "base", margin: 4000"#),
    shown("Transform", REAL_M, REAL, r#"value: "base", rotation: 30, stretch: 0.6, outside: level, level: 700"#),
    shown(
        "Warp",
        BROAD_M,
        &[("base", "Dunes", "wavelength: 2400, height: 240, waviness: 0.1, defects: 0.2")],
        r#"value: "base", displacement: 8000, wavelength: 7000"#,
    ),
    shown("Aspect", REAL_M, REAL, r#"height: "base""#),
    shown("Buffer", BROAD_M, &[], r#"lines: "path.lines", width: 800, edge: 600"#),
    shown(
        "Components",
        BROAD_M,
        &[
            ("patches", "Perlin", r#"wavelength: "2.5 km", gain: 0.6, amplitude: "1 m", seed: 3"#),
            ("mask", "Select", r#"value: "patches", from: 0.12, falloff: 0"#),
        ],
        r#"selection: "mask", least_area: "1.5 km²""#,
    ),
    shown("Curvature", REAL_M, REAL, r#"height: "base", radius: 250, kind: tangential"#),
    shown("Distance", BROAD_M, MOUNTAINS, r#"lines: "streams.lines", limit: 1200"#),
    shown("Occlusion", REAL_M, REAL, r#"height: "base""#).of("sky"),
    shown("Position", REAL_M, REAL, r#"height: "base", radius: 600"#),
    shown(
        "Roughness",
        REAL_M,
        &[
            ("smooth", "Perlin", r#"wavelength: "6 km", octaves: 5, amplitude: "600 m", seed: 1"#),
            ("rough", "Ridged", r#"wavelength: "1.5 km", amplitude: "500 m", seed: 2"#),
            ("places", "Perlin", r#"wavelength: "9 km", octaves: 3, amplitude: "1 m", seed: 3"#),
            ("where", "Select", r#"value: "places", from: 0, falloff: 0.1"#),
            ("base", "Combine", r#"a: "smooth", b: "rough", mask: "where""#),
        ],
        r#"height: "base", radius: 150"#,
    ),
    shown("Select", REAL_M, REAL, r#"value: "base", from: 900, to: 1300, falloff: 60"#),
    shown("Slope", REAL_M, REAL, r#"height: "base""#),
    shown("Sun", REAL_M, REAL, r#"height: "base""#),
    shown("Wetness", REAL_M, REAL, r#"flow: "flow.flow""#),
    shown(
        "Blend",
        REAL_M,
        &[
            ("base", "Import", r#"file: "data/bigtujunga_512_30m.tif", placement: stretch"#),
            ("rock", "Ramp", r#"value: "base""#),
            ("white", "Ramp", r##"value: "base", palette: stops, stops: [(0, "#f4f6f8")]"##),
            ("snow", "Snow", r#"height: "base", temperature: 14, precipitation: 2"#),
        ],
        r#"below: "rock", above: "white", mask: "snow.mask""#,
    ),
    shown("Hillshade", REAL_M, REAL, r#"height: "base", altitude: 30"#),
    shown(
        "Landcover",
        REAL_M,
        REAL,
        r#"height: "base", area: "flow.area", tree_line: 1500, grass_line: 2100, bare_from: 34, bare_to: 50"#,
    ),
    shown("NormalMap", REAL_M, REAL, r#"height: "base""#),
    shown("Ramp", REAL_M, REAL, r#"value: "base""#),
    shown(
        "Splat",
        REAL_M,
        &[
            ("base", "Import", r#"file: "data/bigtujunga_512_30m.tif", placement: stretch"#),
            ("steep", "Slope", r#"height: "base", from: 28, to: 90, falloff: 8"#),
            ("high", "Select", r#"value: "base", from: 1700, to: 5000, falloff: 150"#),
        ],
        r#"second: "steep.mask", third: "high""#,
    ),
    shown(
        "Flexure",
        120_000.0,
        &[(
            "base",
            "Volcano",
            r#"centre: ("60 km", "60 km"), height: 6000, radius: "40 km", gully_spacing: "6 km", caldera_radius: 1500"#,
        )],
        r#"load: "base", elastic_thickness: 15000"#,
    ),
    shown("Outcrop", 8000.0, LAYERED, r#"height: "base", strata: "strata.strata""#),
    shown("Rock", 40_000.0, &[("base", "Perlin", r#"wavelength: "12 km", amplitude: "1.2 km""#)], r#"height: "base""#),
    shown("Stratify", 8000.0, LAYERED, r#"height: "base", dip: 8, count: 6, fold_height: 300"#),
    shown(
        "Uplift",
        40_000.0,
        &[],
        r#"shape: range, path: [("-5 km", "28 km"), ("18 km", "22 km"), ("45 km", "6 km")], front: "14 km", back: "3 km", rate: "1 mm/yr", variation: 0.5"#,
    ),
    shown("Basins", BROAD_M, MOUNTAINS, r#"flow: "flow.flow", smallest: 4e6"#),
    shown("Flow", BROAD_M, MOUNTAINS, r#"height: "base""#),
    shown("Lakes", 8000.0, HOLLOWS, r#"height: "base", smallest: 0"#),
    shown("Rivers", BROAD_M, MOUNTAINS, r#"flow: "flow.flow", channel_area: 5e5, width: 60"#),
    shown("Snow", REAL_M, REAL, r#"height: "base", temperature: 14, precipitation: 2"#),
    shown("Steepness", BROAD_M, MOUNTAINS, r#"flow: "flow.flow", channel_area: 5e5"#),
    shown("Creep", 1000.0, SOFT, r#"height: "base", diffusivity: 0.02, duration: 30000"#),
    shown(
        "Fans",
        5000.0,
        &[
            ("hills", "Ridged", r#"wavelength: "1.5 km", octaves: 9, amplitude: "150 m""#),
            (
                "block",
                "Uplift",
                r#"shape: range, path: [("-2 km", 0), ("7 km", "1 km")], front: "4 km", back: "4 km", rate: "2 mm/yr""#,
            ),
            (
                "cut",
                "StreamPower",
                r#"height: "hills", uplift: "block", reference_rate: "0.25 mm/yr", duration: "1.5 Myr""#,
            ),
            ("plain", "Gradient", r#"from: 330, to: 270, centre: (2500, 2500), azimuth: 180, length: "5 km""#),
            ("base", "Combine", r#"a: "cut", b: "plain", mode: max"#),
        ],
        r#"height: "base", size: 1, slope: 14"#,
    ),
    shown("Glacial", BROAD_M, MOUNTAINS, r#"height: "base", ela: 900, warming: 100, ice_cell: 75"#),
    shown(
        "HydraulicPipe",
        1000.0,
        BANK,
        r#"height: "base", rain: 40, duration: 3600, regolith: 30, entrainment: 0.05, width: 40"#,
    ),
    shown("Landslide", CLIFFS_M, CLIFFS, r#"height: "base", repose: 28, rate: 5"#),
    shown(
        "Rills",
        CLOSE_M,
        &[
            ("model", "Import", r#"file: "data/bigtujunga_512_30m.tif", placement: stretch"#),
            ("near", "Transform", r#"value: "model", pivot: (1500, 1500), stretch: 3"#),
            ("base", "Resample", r#"value: "near", cell: 180"#),
        ],
        r#"height: "base", coarse: 180, spacing: 180"#,
    ),
    shown(
        "StreamPower",
        BROAD_M,
        &[
            ("base", "Ridged", r#"wavelength: "6 km", octaves: 10, amplitude: "450 m", seed: 4"#),
            ("rise", "Uplift", r#"radius: "9 km", rate: "1.2 mm/yr""#),
        ],
        r#"height: "base", uplift: "rise", duration: "2 Myr""#,
    ),
    shown("Thermal", CLIFFS_M, CLIFFS, r#"height: "base", talus: 33, debris: "bare", rock: 56"#),
    shown("Weathering", CLIFFS_M, CLIFFS, r#"height: "base", temperature: -4, duration: 60000"#),
];

/// What a node lays on the terrain, drawn over its picture.
pub(super) struct Cover {
    /// The node.
    pub(super) id: &'static str,
    /// The output that says how much of it there is.
    pub(super) output: &'static str,
    /// The value from which it hides the ground.
    pub(super) full: f32,
    /// Its colour, as 0xRRGGBB.
    pub(super) colour: u32,
}

/// Nodes whose terrain alone does not show what they do.
pub(super) const COVERS: &[Cover] = &[
    Cover { id: "Drain", output: "fill", full: 25.0, colour: 0xe8_cf_9a },
    Cover { id: "Fans", output: "thickness", full: 25.0, colour: 0xe8_cf_9a },
    Cover { id: "Glacial", output: "ice", full: 20.0, colour: 0xa9_cb_e3 },
    Cover { id: "Lakes", output: "depth", full: 12.0, colour: 0x3f_6f_95 },
    Cover { id: "Landslide", output: "deposit", full: 12.0, colour: 0xd9_b9_8c },
    Cover { id: "Rivers", output: "cover", full: 0.4, colour: 0x3f_6f_95 },
    Cover { id: "Snow", output: "mask", full: 1.0, colour: 0xfa_fb_fd },
    Cover { id: "Weathering", output: "debris", full: 6.0, colour: 0xe8_cf_9a },
];
