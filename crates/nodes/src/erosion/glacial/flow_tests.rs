//! Shallow ice against exact solutions: Halfar's dome, Bueler's moving margin, Vialov's profile, the step of Jarosch,
//! Schoof and Anslow; and conservation.

#![expect(clippy::disallowed_methods, reason = "exact solutions are computed independently of the kernel")]

use orograph_graph::{Boundary, Edge, Window, World};

use super::{
    grid::Grid,
    kernels::{Rheology, WEIGHT},
    march::{Ledger, OnHost, Pace, march},
    sheet::Sheet,
};
use crate::{
    numerics::coarse::Coarse,
    testing::{with_job, world},
};

/// Glen's rate factor of the EISMINT experiments and of Bueler et al. (2005), in Pa⁻³ yr⁻¹.
const RATE: f64 = 1e-16;
/// g as in the kernel, so that the exact solutions have the same Γ.
const GAMMA: f64 = 2.0 * RATE * WEIGHT * WEIGHT * WEIGHT / 5.0;

fn sheet(cells: [u32; 2], cell_m: f64, edges: Boundary, rheology: Rheology) -> Sheet {
    let world = World { boundary: edges, ..world(cells[0], cells[1], cell_m) };
    let window = Window::whole(world);
    let grid = Grid::new(&window, &Coarse::new(&window, 1.0)).unwrap();
    Sheet::new(grid, rheology).unwrap()
}

fn glen() -> Rheology {
    Rheology::new(RATE, 0.0, f64::INFINITY)
}

/// Marches with balances that may depend on the place in metres, the thickness and the time.
fn run(sheet: &mut Sheet, pace: Pace, years: f64, balance: impl Fn(f64, f64, f64, f64) -> f64) -> Ledger {
    let grid = sheet.grid;
    let window = Window::whole(world(grid.nx as u32, grid.ny as u32, grid.cell_m[0]));
    let mut pace = pace;
    let mut balances = vec![0.0; grid.len()];
    with_job(window, |job| {
        let renew = |sheet: &Sheet, now: f64, out: &mut [f64]| {
            for (cell, out) in out.iter_mut().enumerate() {
                let [x, y] = window.centre_m(cell % grid.nx, cell / grid.nx);
                *out = balance(x, y, sheet.depth(cell), now);
            }
        };
        march(job, &mut OnHost { sheet, balance: &mut balances, renew }, &mut pace, years)
    })
    .unwrap()
}

fn fill(sheet: &mut Sheet, depth: impl Fn(f64, f64) -> f64) {
    let grid = sheet.grid;
    for j in 0..grid.ny {
        for i in 0..grid.nx {
            let [x, y] = [(i as f64 + 0.5) * grid.cell_m[0], (j as f64 + 0.5) * grid.cell_m[1]];
            sheet.thickness[grid.at(i, j)] = depth(x, y);
        }
    }
    sheet.resurface();
}

/// Bueler et al. (2005), equations 9 and 10: H = H₀ τ^(−α) (1 − (τ^(−β) r / R₀)^(4/3))^(3/7) with τ = t / t₀. `lambda`
/// 0 is Halfar's dome, 5 their test C.
struct Similar {
    lambda: f64,
    height: f64,
    radius: f64,
}

impl Similar {
    fn alpha(&self) -> f64 {
        (2.0 - 4.0 * self.lambda) / 18.0
    }

    fn beta(&self) -> f64 {
        (1.0 + 7.0 * self.lambda) / 18.0
    }

    /// t₀ = (β / Γ) (7/4)³ R₀⁴ / H₀⁷.
    fn start_yr(&self) -> f64 {
        self.beta() / GAMMA * (7.0_f64 / 4.0).powi(3) * self.radius.powi(4) / self.height.powi(7)
    }

    fn depth(&self, r: f64, t: f64) -> f64 {
        let tau = t / self.start_yr();
        let inside = 1.0 - (tau.powf(-self.beta()) * r / self.radius).powf(4.0 / 3.0);
        self.height * tau.powf(-self.alpha()) * inside.max(0.0).powf(3.0 / 7.0)
    }

    fn margin(&self, t: f64) -> f64 {
        self.radius * (t / self.start_yr()).powf(self.beta())
    }
}

/// Distance of the outermost ice thicker than 1 m in a direction from the centre, by cells.
fn reach(sheet: &Sheet, azimuth: f64) -> f64 {
    let grid = sheet.grid;
    let [cx, cy] = [grid.nx as f64 * 0.5, grid.ny as f64 * 0.5];
    let steps = (0..grid.nx * 4).map(|k| f64::from(k as u32) * 0.125);
    let inside = |r: &f64| {
        let (x, y) = (cx + r * azimuth.cos(), cy + r * azimuth.sin());
        (0.0..grid.nx as f64).contains(&x)
            && (0.0..grid.ny as f64).contains(&y)
            && sheet.depth(y as usize * grid.nx + x as usize) > 1.0
    };
    steps.filter(inside).fold(0.0, f64::max) * grid.cell_m[0]
}

/// Volume to 1 %, margin to one cell along every direction, thickness to 1 % of the centre's over the dome without the
/// outermost two cells.
fn assert_similar(sheet: &Sheet, exact: &Similar, t: f64) {
    let grid = sheet.grid;
    let (n, d) = (grid.nx, grid.cell_m[0]);
    let (mut volume, mut expected, mut worst, mut sum, mut count) = (0.0, 0.0, 0.0_f64, 0.0, 0.0);
    for j in 0..n {
        for i in 0..n {
            let r = (i as f64 + 0.5 - n as f64 / 2.0).hypot(j as f64 + 0.5 - n as f64 / 2.0) * d;
            let (found, truth) = (sheet.depth(j * n + i), exact.depth(r, t));
            volume += found;
            expected += truth;
            if truth > 0.0 {
                sum += (found - truth).abs();
                count += 1.0;
            }
            if r < exact.margin(t) - 2.0 * d {
                worst = worst.max((found - truth).abs());
            }
        }
    }
    let centre = exact.depth(0.0, t);
    let reaches: Vec<f64> = (0..64).map(|k| reach(sheet, f64::from(k) * std::f64::consts::TAU / 64.0)).collect();
    let (low, high) = reaches.iter().fold((f64::MAX, 0.0_f64), |(low, high), r| (low.min(*r), high.max(*r)));
    println!(
        "volume {:.5}, mean error {:.4} and worst {:.4} of {centre:.0} m, margin {:.0} to {:.0} m for {:.0} m (cells of {d:.0} m)",
        volume / expected,
        sum / count / centre,
        worst / centre,
        low,
        high,
        exact.margin(t)
    );
    assert!((volume / expected - 1.0).abs() < 0.01, "volume {}", volume / expected);
    assert!(worst < 0.01 * centre, "worst {worst} of {centre}");
    // the outer sides of cells with ice, whose centres are half a cell nearer
    let [low, high] = [low, high].map(|reach| reach - 0.5 * d);
    assert!(low > exact.margin(t) - d && high < exact.margin(t) + d, "{low} {high} {}", exact.margin(t));
}

/// A dome of 3600 m and 750 km (Halfar 1983; Bueler et al. 2005, test B) spreads for 25 000 years.
#[test]
fn a_dome_spreads_as_halfar_says() {
    let exact = Similar { lambda: 0.0, height: 3600.0, radius: 750e3 };
    let mut ice = sheet([81, 81], 25e3, Boundary::all(Edge::Wall), glen());
    let half = 81.0 * 25e3 / 2.0;
    let start = exact.start_yr();
    assert!((start - 422.45).abs() < 1.0, "{start}");
    fill(&mut ice, |x, y| exact.depth((x - half).hypot(y - half), start));
    let before = ice.total_m();
    let ledger = run(&mut ice, Pace::new(10.0, 0.01, 500.0), 25_000.0, |_, _, _, _| 0.0);
    println!("{ledger:?}");
    assert!((ice.total_m() / before - 1.0).abs() < 1e-9, "nothing is lost");
    assert_similar(&ice, &exact, start + 25_000.0);
    // no preferred direction: equal under exchange of the axes within what the factors' order costs
    let n = 81;
    let skew = (0..n * n).map(|k| (ice.depth(k) - ice.depth(k % n * n + k / n)).abs()).fold(0.0, f64::max);
    println!("skew {skew:.3} m");
    assert!(skew < 5.0, "{skew}");
}

/// Test C of Bueler et al. (2005): it grows from nothing by the balance m = 5 H / t, and its margin moves.
#[test]
fn a_growing_dome_has_buelers_margin() {
    let exact = Similar { lambda: 5.0, height: 3600.0, radius: 750e3 };
    let end = exact.start_yr();
    assert!((end - 15_208.0).abs() < 40.0, "{end}");
    let mut ice = sheet([81, 81], 25e3, Boundary::all(Edge::Wall), glen());
    let half = 81.0 * 25e3 / 2.0;
    let begin = 0.3 * end;
    fill(&mut ice, |x, y| exact.depth((x - half).hypot(y - half), begin));
    let r = |x: f64, y: f64| (x - half).hypot(y - half);
    let ledger = run(&mut ice, Pace::new(10.0, 0.01, 50.0), end - begin, |x, y, _, now| {
        5.0 / (begin + now) * exact.depth(r(x, y), begin + now)
    });
    println!("{ledger:?}");
    assert_similar(&ice, &exact, end);
}

/// Ice with a balance m = 0.3 m/yr that ends at the side of the world, L = 1500 km from its divide, has Vialov's
/// profile (1958): m x = Γ s⁵ |s'|³, so s^(8/3) = 2 (m / Γ)^(1/3) (L^(4/3) − x^(4/3)). To 1 % but for the six cells at
/// the margin, where the profile is vertical.
#[test]
fn a_steady_sheet_has_vialovs_profile() {
    let (n, d) = (60, 25e3);
    let mut ice =
        sheet([n, 3], d, Boundary { west: Edge::Wall, east: Edge::Base, north: Edge::Wall, south: Edge::Wall }, glen());
    run(&mut ice, Pace::new(10.0, 0.01, 500.0), 200_000.0, |_, _, _, _| 0.3);
    let length = f64::from(n) * d;
    let mut worst = 0.0_f64;
    for i in 0..n as usize {
        let x = (i as f64 + 0.5) * d;
        let truth =
            (2.0_f64 * (0.3 / GAMMA).powf(1.0 / 3.0) * (length.powf(4.0 / 3.0) - x.powf(4.0 / 3.0))).powf(3.0 / 8.0);
        let found = ice.depth(60 + i);
        if i < 54 {
            worst = worst.max((found / truth - 1.0).abs());
        }
        if i % 10 == 0 || i > 55 {
            println!("{x:.0} {found:.1} {truth:.1}");
        }
    }
    println!("worst {worst:.4}");
    assert!(worst < 0.01, "{worst}");
}

/// The steady ice of Jarosch, Schoof and Anslow (2013) over a step of 500 m in the bed at 7 km: the volume converges to
/// the exact one with the first power of the cells, as the paper's own schemes do, and does not miss the step's.
#[test]
fn ice_over_a_step_conserves_mass() {
    let (b0, xs, xm, m0) = (500.0_f64, 7_000.0_f64, 20_000.0_f64, 2.0_f64);
    // m(x) = (n m₀ / x_m^(2n−1)) x^(n−1) |x_m − x|^(n−1) (x_m − 2 x), whose integral is q = m₀ x^n |x_m − x|^n /
    // x_m^(2n−1)
    let balance = |x: f64| 3.0 * m0 / xm.powi(5) * x * x * (xm - x) * (xm - x) * (xm - 2.0 * x);
    // Γ s⁵ |s'|³ = q gives s^(8/3) = (8/3) k (P(x_m) − P(x)) below the step, with P = x_m x² / 2 − x³ / 3
    let k = (m0 / (GAMMA * xm.powi(5))).powf(1.0 / 3.0);
    let primitive = |x: f64| xm * x * x / 2.0 - x * x * x / 3.0;
    let below = |x: f64| (8.0 / 3.0 * k * (primitive(xm) - primitive(x))).powf(3.0 / 8.0);
    // above, the thickness at the edge is what the flux needs as the surface slope grows without bound: it starts at 0
    // over the edge where the ice below is lower than the step
    let at_edge = (below(xs) - b0).max(0.0);
    let above = |x: f64| (at_edge.powf(8.0 / 3.0) + 8.0 / 3.0 * k * (primitive(xs) - primitive(x))).powf(3.0 / 8.0);
    let mut before = f64::MAX;
    for (d, tolerance) in [(200.0, 0.015), (100.0, 0.008), (50.0, 0.005)] {
        let n = (22_000.0 / d) as u32;
        let mut ice = sheet(
            [n, 3],
            d,
            Boundary { west: Edge::Wall, east: Edge::Wall, north: Edge::Wall, south: Edge::Wall },
            glen(),
        );
        let columns = n as usize;
        ice.set_bed(|cell| if ((cell % columns) as f64 + 0.5) * d < xs { b0 } else { 0.0 });
        let ledger =
            run(&mut ice, Pace::new(5.0, 0.01, 200.0), 600_000.0, |x, _, _, _| if x < xm { balance(x) } else { -2.0 });
        let truth = |x: f64| {
            if x < xs {
                above(x)
            } else if x < xm {
                below(x)
            } else {
                0.0
            }
        };
        let mut volumes = [0.0; 2];
        for i in 0..columns {
            let x = (i as f64 + 0.5) * d;
            volumes[0] += ice.depth(columns + i) * d;
            volumes[1] += truth(x) * d;
        }
        let error = (volumes[0] / volumes[1] - 1.0).abs();
        println!("cells of {d} m: {error:.5}, {ledger:?}");
        assert!(error < tolerance && error < before, "{error} on cells of {d} m");
        before = error;
    }
}
