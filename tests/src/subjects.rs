//! The terrain in the pictures of the manual, and what is drawn on it.

/// The terrain for the pictures of the manual: a range cut by rivers, and patches on it.
pub(crate) const PICTURE_LAND: &str = r#"
    "hills": Ridged(wavelength: "6 km", octaves: 10, amplitude: "450 m"),
    "rise": Uplift(radius: "9 km", rate: "1.2 mm/yr"),
    "base": StreamPower(version: 1, height: "hills", uplift: "rise", duration: "2.5 Myr", repose: 38, headwater_variation: 0),
    "other": Perlin(wavelength: "5 km", amplitude: "900 m"),
    "patches": Perlin(wavelength: "4 km", amplitude: "1 m", seed: 3),
    "mask": Select(value: "patches", from: 0.05, falloff: 0.1),
"#;

/// Terrain on which some nodes show what they do.
pub(crate) struct Subject {
    /// Nodes and their arguments.
    pub(crate) nodes: &'static [(&'static str, &'static str)],
    /// Side of the world in metres.
    pub(crate) side_m: f64,
    /// The nodes of a graph that make `base`.
    pub(crate) land: &'static str,
}

/// Nodes that do not show on a range of 16 km.
pub(crate) const SUBJECTS: [Subject; 9] = [
    // mountains that end at a plain
    Subject {
        nodes: &[("Fans", r#"height: "base", size: 1, slope: 14"#)],
        side_m: 5000.0,
        land: r#"
            "hills": Ridged(wavelength: "1.5 km", octaves: 9, amplitude: "150 m"),
            "block": Uplift(shape: range, path: [("-2 km", 0), ("7 km", "1 km")], front: "4 km", back: "4 km", rate: "2 mm/yr"),
            "cut":   StreamPower(version: 20, height: "hills", uplift: "block", reference_rate: "0.25 mm/yr", duration: "1.5 Myr"),
            "plain": Gradient(from: 330, to: 270, centre: (2500, 2500), azimuth: 180, length: "5 km"),
            "base":  Combine(a: "cut", b: "plain", mode: max),
        "#,
    },
    // cliffs above a valley
    Subject {
        nodes: &[
            ("Weathering", r#"height: "base", temperature: -4, duration: 60000"#),
            ("Thermal", r#"height: "base", talus: 33"#),
            ("Landslide", r#"height: "base", repose: 24, rate: 12"#),
        ],
        side_m: 1800.0,
        land: r#"
            "hills": Ridged(wavelength: "1.6 km", octaves: 9, amplitude: "900 m", seed: 5),
            "bare":  Constant(value: 0),
            "base":  Thermal(version: 1, height: "hills", debris: "bare", rock: 62, tolerance: 0.05),
        "#,
    },
    // a hill of soft ground
    Subject {
        nodes: &[
            (
                "HydraulicPipe",
                r#"height: "base", rain: 40, duration: 3600, regolith: 30, entrainment: 0.05, width: 40"#,
            ),
            ("Creep", r#"height: "base", diffusivity: 0.02, duration: 30000"#),
        ],
        side_m: 1000.0,
        land: r#"
            "round": Shape(centre: (480, 520), size: (520, 520), softness: 560),
            "dome":  Remap(value: "round.mask", from: (0, 1), to: (400, 500), quantity: height),
            "noise": Perlin(wavelength: 260, octaves: 7, gain: 0.5, amplitude: 26),
            "base":  Combine(a: "dome", b: "noise"),
        "#,
    },
    // a scan with wrong values
    Subject {
        nodes: &[
            ("Despike", r#"height: "base", radius: 300, threshold: 3"#),
            ("Median", r#"value: "base", radius: 350"#),
        ],
        side_m: 8000.0,
        land: r#"
            "broad":  Perlin(wavelength: "5 km", octaves: 4, amplitude: "500 m", seed: 9),
            "sparse": Noise(version: 2, kind: value, wavelength: 300, octaves: 1, amplitude: "1 m", seed: 2),
            "wrong":  Select(value: "sparse", from: 0.7, falloff: 0.02),
            "spikes": Remap(value: "wrong", from: (0, 1), to: (0, 160), quantity: height),
            "base":   Combine(a: "broad", b: "spikes"),
        "#,
    },
    // a range without its finest forms
    Subject {
        nodes: &[("Sharpen", r#"height: "base", radius: 700, amount: 1.5"#)],
        side_m: 16_384.0,
        land: r#"
            "hills": Ridged(wavelength: "6 km", octaves: 10, amplitude: "450 m"),
            "rise":  Uplift(radius: "9 km", rate: "1.2 mm/yr"),
            "range": StreamPower(version: 1, height: "hills", uplift: "rise", duration: "2.5 Myr", repose: 38, headwater_variation: 0),
            "base":  Blur(value: "range", radius: 450),
        "#,
    },
    // noise, with its hollows
    Subject {
        nodes: &[("Lakes", r#"height: "base", smallest: 0"#), ("Drain", r#"height: "base", cut: 0.4"#)],
        side_m: 8000.0,
        land: r#"
            "broad": Perlin(wavelength: "4 km", octaves: 4, amplitude: "500 m", seed: 4),
            "fine":  Ridged(wavelength: "1.8 km", octaves: 7, amplitude: "160 m", seed: 2),
            "base":  Combine(a: "broad", b: "fine"),
        "#,
    },
    // a cliff in a noisy scan
    Subject {
        nodes: &[("Bilateral", r#"value: "base", radius: 140, contrast: 45"#)],
        side_m: 2500.0,
        land: r#"
            "scarp": Gradient(from: 0, to: 110, centre: (1200, 1300), azimuth: 60, length: 90),
            "broad": Perlin(wavelength: "1.6 km", octaves: 4, amplitude: "160 m", seed: 9),
            "bent":  Warp(value: "scarp", displacement: 260, wavelength: 1300),
            "error": Perlin(wavelength: 110, octaves: 2, amplitude: "45 m", seed: 5),
            "true":  Combine(a: "bent", b: "broad"),
            "base":  Combine(a: "true", b: "error"),
        "#,
    },
    // the valleys of a coarse model
    Subject {
        nodes: &[("Rills", r#"height: "base", coarse: 180, spacing: 180"#)],
        side_m: 2600.0,
        land: r#"
            "hills": Ridged(wavelength: "1.8 km", octaves: 3, amplitude: "420 m", seed: 3),
            "base":  Blur(value: "hills", radius: 90),
        "#,
    },
    // high mountains
    Subject {
        nodes: &[
            ("Glacial", r#"height: "base", ela: 1000, warming: 200, ice_cell: 300"#),
            ("Snow", r#"height: "base", temperature: 11, precipitation: 2"#),
        ],
        side_m: 16_384.0,
        land: r#"
            "hills": Ridged(wavelength: "6 km", octaves: 10, amplitude: "450 m", seed: 8),
            "rise":  Uplift(radius: "9 km", rate: "1.2 mm/yr"),
            "base":  StreamPower(version: 20, height: "hills", uplift: "rise", duration: "2.5 Myr"),
        "#,
    },
];

/// What a node lays on the terrain, drawn over its picture.
pub(crate) struct Cover {
    /// The node.
    pub(crate) id: &'static str,
    /// The output that says how much of it there is.
    pub(crate) output: &'static str,
    /// The value from which it hides the ground.
    pub(crate) full: f32,
    /// Its colour, as 0xRRGGBB.
    pub(crate) colour: u32,
}

/// Nodes whose terrain alone does not show what they do.
pub(crate) const COVERS: [Cover; 5] = [
    Cover { id: "Drain", output: "fill", full: 6.0, colour: 0xd9_c0_8c },
    Cover { id: "Fans", output: "thickness", full: 3.0, colour: 0xd9_c0_8c },
    Cover { id: "Glacial", output: "ice", full: 20.0, colour: 0xe2_ec_f4 },
    Cover { id: "Lakes", output: "depth", full: 4.0, colour: 0x3f_6f_95 },
    Cover { id: "Snow", output: "mask", full: 1.0, colour: 0xfa_fb_fd },
];
