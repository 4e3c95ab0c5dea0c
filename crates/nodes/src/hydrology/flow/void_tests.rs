//! Tests of water at voids.

use orograph_graph::World;

use super::tests::{area_that_leaves, flow_with, hills, noise, receivers};
use crate::{numerics::routing::reference, prelude::*, testing};

/// Where the terrain is known: not in discs of 90 m, nor in a corner.
fn discs(world: World) -> Field {
    testing::field(world, |x, y| {
        let off = |at: f64| at.rem_euclid(300.0) - 150.0;
        let in_disc = off(x) * off(x) + off(y) * off(y) < 8100.0;
        if in_disc || x + y < 200.0 { 0.2 } else { 0.8 }
    })
}

/// Voids drain like the sea, and cells beside them like those of an open side.
#[test]
fn water_leaves_at_voids_and_beside_them() {
    for height in [hills(testing::world(90, 70, 10.0)), noise(testing::world(60, 50, 10.0))] {
        let (nx, len) = (height.window().nx(), height.samples().len());
        let data = discs(height.window().world);
        let is_void = |cell: usize| data.samples()[cell] < 0.5;
        let around = |cell: usize| reference::neighbours(nx, len, cell).map(|(_, next)| next);
        let is_pit = |cell: usize| around(cell).all(|next| height.samples()[next] >= height.samples()[cell]);
        let leaves = |cell: usize| is_void(cell) || is_pit(cell) && around(cell).any(is_void);
        let ends = |cell: usize| leaves(cell) || reference::on_border(nx, len, cell);
        for changes in
            ["", "depressions=fill", "routing=d_infinity", "routing=mfd", "depressions=breach,breach_depth=5"]
        {
            let drained = flow_with(&[("height", &height), ("data", &data)], changes);
            if !changes.contains("breach") {
                assert!(drained.filled == reference::priority_flood(nx, height.samples(), ends), "{changes}");
            }
            for cell in (0..len).filter(|&cell| leaves(cell)) {
                assert_eq!((drained.direction[cell], drained.depth[cell]), (-1.0, 0.0), "{changes}");
            }
            let (left, all) = (f64::from(area_that_leaves(&drained)), len as f64 * 100.0);
            assert!((left / all - 1.0).abs() < 1e-4, "{changes}: {left} of {all}");
        }
        // no water passes a void: what drains a known cell is known
        let drained = flow_with(&[("height", &height), ("data", &data)], "");
        let receivers = receivers(&height, &drained.direction);
        assert!(receivers.iter().enumerate().all(|(cell, to)| to.is_none() || !is_void(cell)));
        let cells = reference::accumulate(&receivers).expect("no circles");
        assert!((0..len).all(|cell| drained.area[cell] == cells[cell] as f32 * 100.0));
    }
}

/// A mask that is one everywhere, wired or not, changes nothing; nothing drains where all is unknown.
#[test]
fn a_whole_mask_changes_nothing() {
    let height = hills(testing::world(40, 30, 10.0));
    let without = flow_with(&[("height", &height)], "");
    let whole = Field::constant(*height.window(), 1.0);
    let with = flow_with(&[("height", &height), ("data", &whole)], "");
    assert!(without.direction == with.direction && without.filled == with.filled);
    let none = Field::constant(*height.window(), f32::NAN);
    let with = flow_with(&[("height", &height), ("data", &none)], "");
    assert!(with.direction.iter().all(|&to| to == -1.0) && with.area.iter().all(|&area| area == 100.0));
}
