//! Profiles, proportions, crest ends, windows and errors.

use super::{crescents::*, *};
use crate::testing::{generate, outputs_on, with_params, world};

fn slopes(field: &Field) -> impl Iterator<Item = f64> + '_ {
    let (nx, ny, cell_m) = (field.window().nx(), field.window().ny(), field.window().cell_m());
    let h = move |i: usize, j: usize| f64::from(field.samples()[j * nx + i]);
    (1..ny - 1).flat_map(move |j| {
        (1..nx - 1).map(move |i| math::hypot(h(i + 1, j) - h(i - 1, j), h(i, j + 1) - h(i, j - 1)) / (2.0 * cell_m))
    })
}

/// Straight ridges have the requested height, a slip face at repose over H / tan φ, and a mean height of H / 2 on
/// both sides.
#[test]
fn ridges_have_their_height_and_their_slip_face() {
    let window = Window::whole(world(1200, 3, 1.0));
    let land = generate(window, &NODE, "waviness=0,defects=0,azimuth=90,wavelength=300,height=18,repose=33");
    let profile = &land.samples()[1200..2400];
    let most = profile.iter().fold(0.0_f32, |most, h| most.max(*h));
    assert!((17.6..=18.0).contains(&most), "{most}"); // a crest may be half a cell from a centre
    let mean = profile.iter().map(|h| f64::from(*h)).sum::<f64>() / 1200.0;
    assert!((mean - 9.0).abs() < 0.02, "{mean}");
    let slip = math::tan(33.0_f64.to_radians());
    let falling: Vec<f64> = profile.windows(2).map(|pair| f64::from(pair[0] - pair[1])).filter(|d| *d > 0.3).collect();
    let steep = falling.iter().filter(|d| (*d - slip).abs() < 1e-4).count();
    // 27.7 m of 300 m, less the two cells at its ends, four times
    assert!((100..=112).contains(&steep) && falling.iter().all(|d| *d < slip + 1e-4), "{steep}");
}

/// Also on winding ridges, nine tenths of the steep terrain on lee sides is within two degrees of repose, apart
/// from edges, where differences over two cells and the slope along the crest reduce it.
#[test]
fn winding_ridges_slip_at_repose_too() {
    let window = Window::whole(world(700, 700, 2.0));
    for defects in ["0", "1"] {
        let changes = format!("waviness=0.4,wavelength=300,height=18,repose=33,defects={defects}");
        let land = generate(window, &NODE, &changes);
        let angles: Vec<f64> = slopes(&land).map(|s| math::atan(s).to_degrees()).filter(|a| *a > 28.0).collect();
        let near = angles.iter().filter(|a| (*a - 33.0).abs() < 2.0).count();
        assert!(angles.len() > 15_000 && near as f64 > 0.85 * angles.len() as f64, "{near} of {}", angles.len());
    }
}

/// Straight ridges without defects have as many crests on each line along the wind; with defects lines differ, and
/// half-way up the ridges begin and end within the world. Without them none does.
#[test]
fn crests_end_where_there_are_defects() {
    let window = Window::whole(world(800, 800, 5.0));
    for (defects, ends) in [("0", 0..=0), ("0.6", 20..=90)] {
        let changes = format!("waviness=0,azimuth=90,wavelength=300,height=18,defects={defects}");
        let land = generate(window, &NODE, &changes);
        let high = |i: usize, j: usize| land.samples()[j * 800 + i] > 9.0;
        // runs of high ground in a row that meet none in the next one
        let runs = |j: usize| -> Vec<[usize; 2]> {
            let edges: Vec<usize> = (1..800).filter(|&i| high(i, j) != high(i - 1, j)).collect();
            let from = usize::from(high(0, j));
            edges[from..].chunks_exact(2).map(|run| [run[0], run[1]]).collect()
        };
        let lone = |j: usize, next: usize| {
            let inner = |run: &&[usize; 2]| run[0] > 40 && run[1] < 760;
            runs(j).iter().filter(inner).filter(|run| !(run[0]..run[1]).any(|i| high(i, next))).count()
        };
        let found: usize = (40..760).map(|j| lone(j, j + 1) + lone(j, j - 1)).sum();
        assert!(ends.contains(&found), "{defects}: {found}");
    }
}

#[test]
fn a_barchan_is_a_crescent_nowhere_steeper_than_repose() {
    let slip = math::tan(33.0_f64.to_radians());
    let crescent = Crescent { centre: [0.0; 2], height_m: 10.0, turn: [1.0, 0.0], skew: 0.0 };
    assert!((crescent.height(0.0, 0.0, slip) - 10.0).abs() < 1e-9);
    assert!((crescent.height(5.0, 0.0, slip) - (10.0 - 5.0 * slip)).abs() < 1e-9);
    assert_eq!(crescent.height(-60.0, 0.0, slip), 0.0);
    // the ends of the horns, 11 heights apart
    assert!(crescent.height(53.0, 50.0, slip) > 0.0 && crescent.height(30.0, 0.0, slip) == 0.0);
    let h = |u: f64, v: f64| crescent.height(u, v, slip);
    for (a, b) in (-180..300).flat_map(|a| (-140..=140).map(move |b| (0.4 * f64::from(a), 0.4 * f64::from(b)))) {
        let steep = math::hypot(h(a + 0.01, b) - h(a - 0.01, b), h(a, b + 0.01) - h(a, b - 0.01)) / 0.02;
        assert!(steep < slip * 1.02, "({a}, {b}): {}", math::atan(steep).to_degrees());
        assert!(h(a, b) == 0.0 || math::hypot(a, b) < REACH * 10.0);
    }
}

/// Field data: barchans are about a tenth as high as their horns are apart (P. Hersen, 2004), also the skewed ones;
/// their sizes spread over a factor of ten, most are small, and swarms alternate with bare ground.
#[test]
fn barchans_differ_and_keep_their_proportions() {
    let params = Params::read(&with_params(&NODE, "form=barchan,wavelength=600,height=36"));
    let slip = math::tan(33.0_f64.to_radians());
    let crescents = |octave: u32| -> Vec<Crescent> {
        let lattice = Lattice { octave, wide_m: 600.0 / f64::from(1 << octave), seed: 9 };
        let squares = (0..40).flat_map(|line| (0..40).map(move |column| [column, line]));
        squares.filter_map(|square| params.crescent(&lattice, square)).collect()
    };
    let all: Vec<Crescent> = (0..OCTAVES).flat_map(crescents).collect();
    let mut heights: Vec<f64> = all.iter().map(|crescent| crescent.height_m).collect();
    heights.sort_by(f64::total_cmp);
    let at = |share: f64| heights[(share * (heights.len() - 1) as f64) as usize];
    assert!(at(1.0) <= 36.0 && at(0.99) > 6.0 * at(0.05) && at(0.5) < 0.45 * at(0.99), "{} {}", at(0.05), at(0.99));
    for crescent in all.iter().take(200) {
        let h = crescent.height_m;
        // where it ends across the wind
        let wide = (0..200)
            .map(|k| 0.1 * f64::from(k))
            .filter(|v| (-100..200).any(|u| crescent.height(0.1 * f64::from(u) * h, v * h, slip) > 0.02 * h));
        let half = wide.fold(0.0, f64::max);
        assert!((0.085..0.125).contains(&(1.0 / (2.0 * half))), "{half}");
    }
    // counts in blocks of five squares vary more than those of independent draws
    let first = crescents(0);
    let mut counts = [0.0_f64; 64];
    for crescent in &first {
        let [x, y] = crescent.centre.map(|metres| ((metres / 3000.0) as usize).min(7));
        counts[y * 8 + x] += 1.0;
    }
    let mean = counts.iter().sum::<f64>() / 64.0;
    let variance = counts.iter().map(|count| (count - mean) * (count - mean)).sum::<f64>() / 64.0;
    assert!(variance > 1.4 * mean * (1.0 - mean / 25.0), "{variance} {mean}");
}

#[test]
fn a_window_has_the_dunes_of_the_whole() {
    for form in ["transverse", "barchan"] {
        let changes = format!("form={form},wavelength=900,height=50");
        let whole = Window::whole(world(131, 97, 60.0));
        let land = generate(whole, &NODE, &changes);
        let part = Window { origin: [17, 31], cells: [83, 40], ..whole };
        assert_eq!(land.crop(&part), generate(part, &NODE, &changes));
        assert_ne!(land, generate(whole, &NODE, &format!("{changes},seed=1")));
        assert!(land.range(0).is_some_and(|(low, high)| low >= 0.0 && high > 25.0 && high <= 50.0));
    }
}

#[test]
fn dunes_too_high_are_refused() {
    let params = with_params(&NODE, "form=barchan,wavelength=90,height=20");
    let error = outputs_on(Window::whole(world(8, 8, 10.0)), &NODE, &params, &[]);
    assert!(matches!(error, Err(NodeError::Failed { hint: Some(hint), .. }) if hint.contains("height: 10")));
}
