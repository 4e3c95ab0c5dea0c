//! Terrain on which several nodes are shown.

/// The nodes of a graph: name, kind and arguments. The terrain is the node `base`.
pub(super) type Land = &'static [(&'static str, &'static str, &'static str)];

/// Side of the world of mountains and of hills in metres.
pub(super) const BROAD_M: f64 = 16_384.0;

/// A range cut by rivers.
pub(super) const MOUNTAINS: Land = &[
    ("hills", "Ridged", r#"wavelength: "5 km", octaves: 9, amplitude: "350 m", seed: 4"#),
    (
        "rise",
        "Uplift",
        r#"shape: range, path: [("-3 km", "15 km"), ("20 km", "2 km")], front: "9 km", back: "6 km", rate: "1 mm/yr""#,
    ),
    (
        "base",
        "StreamPower",
        r#"height: "hills", uplift: "rise", reference_rate: "0.4 mm/yr", duration: "2 Myr", headwater_area: "0.3 km²", winding: 0.4, roughness_variation: 0.5"#,
    ),
];

/// Hills of noise.
pub(super) const HILLS: Land =
    &[("base", "Fractal", r#"kind: eroded, wavelength: "6 km", gain: 0.46, amplitude: "800 m", seed: 14"#)];

/// Side of the world of the real model in metres.
pub(super) const REAL_M: f64 = 15_360.0;

/// The elevation model beside the graphs: Big Tujunga in California.
pub(super) const REAL: Land = &[("base", "Import", r#"file: "data/bigtujunga_512_30m.tif", placement: stretch"#)];

/// Side of the world of a third of it, in metres.
pub(super) const CLOSE_M: f64 = 5000.0;

/// Side of the world of the cliffs in metres.
pub(super) const CLIFFS_M: f64 = 1800.0;

/// An escarpment above a plain.
pub(super) const CLIFFS: Land = &[
    ("scarp", "Gradient", "from: 420, to: 0, centre: (800, 900), azimuth: 110, length: 240"),
    ("bent", "Warp", r#"value: "scarp", displacement: 900, wavelength: 800, octaves: 5, seed: 2"#),
    ("broad", "Perlin", "wavelength: 900, octaves: 8, amplitude: 90, seed: 9"),
    ("crags", "Ridged", "wavelength: 300, octaves: 7, amplitude: 60, seed: 5"),
    ("rough", "Combine", r#"a: "bent", b: "broad""#),
    ("steep", "Combine", r#"a: "rough", b: "crags""#),
    ("bare", "Constant", "value: 0"),
    ("base", "Thermal", r#"height: "steep", debris: "bare", rock: 62, tolerance: 0.05"#),
];

/// Hills with the hollows that noise has.
pub(super) const HOLLOWS: Land = &[
    ("broad", "Perlin", r#"wavelength: "4 km", octaves: 4, amplitude: "500 m", seed: 4"#),
    ("fine", "Ridged", r#"wavelength: "1.8 km", octaves: 7, amplitude: "160 m", seed: 2"#),
    ("base", "Combine", r#"a: "broad", b: "fine""#),
];

/// A round hill of soft ground, in a world of 1 km.
pub(super) const SOFT: Land = &[
    ("round", "Shape", "centre: (480, 520), size: (520, 520), softness: 560"),
    ("dome", "Remap", r#"value: "round.mask", from: (0, 1), to: (400, 500), quantity: height"#),
    ("noise", "Perlin", "wavelength: 260, octaves: 7, gain: 0.5, amplitude: 26"),
    ("base", "Combine", r#"a: "dome", b: "noise""#),
];

/// A slope of soft ground, in a world of 1 km.
pub(super) const BANK: Land = &[
    ("fall", "Gradient", "from: 190, to: 20, centre: (500, 500), azimuth: 160, length: 900"),
    ("noise", "Perlin", "wavelength: 300, octaves: 8, gain: 0.5, amplitude: 24, seed: 3"),
    ("base", "Combine", r#"a: "fall", b: "noise""#),
];

/// A scan with wrong values, in a world of 8 km.
pub(super) const SCAN: Land = &[
    ("broad", "Perlin", r#"wavelength: "5 km", octaves: 8, amplitude: "500 m", seed: 9"#),
    ("sparse", "Noise", r#"kind: value, wavelength: 100, octaves: 1, amplitude: "1 m", seed: 2"#),
    ("wrong", "Select", r#"value: "sparse", from: 0.85, falloff: 0.02"#),
    ("spikes", "Remap", r#"value: "wrong", from: (0, 1), to: (0, 45), quantity: height"#),
    ("base", "Combine", r#"a: "broad", b: "spikes""#),
];

/// Ridges cut into layers of rock, in a world of 8 km.
pub(super) const LAYERED: Land = &[
    ("hills", "Ridged", r#"wavelength: "3 km", octaves: 9, amplitude: "160 m", seed: 11"#),
    ("rise", "Uplift", r#"radius: "6 km", rate: "1 mm/yr""#),
    ("base", "StreamPower", r#"height: "hills", uplift: "rise", duration: "1 Myr""#),
];
