//! The coverage of cells by lines, such as rivers, so that they can be drawn on a terrain.

use orograph_graph::{Edge, Field, Lines, Vertex, Window};
use orograph_nodes::numerics::segment::Cells;

/// Minimum width of a drawn line in cells; thinner ones would be invisible.
const LEAST: f64 = 1.2;

/// The fraction of each cell of a window that lines cover, with soft edges; each line is as wide as it is in the world,
/// but at least about a cell.
#[must_use]
pub fn coverage(lines: &Lines, window: &Window) -> Field {
    let mut cover = vec![0.0_f32; window.len()];
    for line in &lines.lines {
        for pair in line.vertices.windows(2) {
            segment(&mut cover, window, &pair[0], &pair[1]);
        }
    }
    Field::new(*window, cover)
}

/// Draws one piece of a line; the largest coverage of a cell counts.
fn segment(cover: &mut [f32], window: &Window, from: &Vertex, to: &Vertex) {
    let cell_m = window.cell_m();
    let [start, end] = [from, to].map(|end| 0.5 * (end.width_m / cell_m).max(LEAST));
    let boundary = window.world.boundary;
    let sides = [[boundary.west, boundary.east], [boundary.north, boundary.south]];
    let wraps = sides.map(|sides| sides == [Edge::Periodic; 2]);
    let cells = Cells { counts: window.world.cells.map(i64::from), wraps, cell_m };
    // the position of a cell in the window
    let place = |cell: i64, axis: usize| {
        let at = cell - i64::from(window.origin[axis]);
        (0..i64::from(window.cells[axis])).contains(&at).then_some(at as usize)
    };
    cells.near([from.position_m, to.position_m], (start.max(end) + 0.5) * cell_m, |[i, j], distance_m, t| {
        if let (Some(column), Some(row)) = (place(i, 0), place(j, 1)) {
            let inside = start + (end - start) * t - distance_m / cell_m + 0.5;
            let cell = &mut cover[row * window.nx() + column];
            *cell = cell.max(inside.clamp(0.0, 1.0) as f32);
        }
    });
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Line, World};

    use super::*;

    fn line(points: &[[f64; 2]], width_m: f64) -> Lines {
        let vertices = points.iter().map(|at| Vertex { position_m: *at, width_m, ..Vertex::default() }).collect();
        Lines::open(vec![Line { order: 1, downstream: None, vertices }])
    }

    #[test]
    fn lines_are_at_least_a_cell_wide_and_else_true_to_scale() {
        let window = Window::whole(World { size: [320.0, 160.0], cells: [32, 16], ..World::default() });
        let row = |field: &Field, j: usize| field.plane(0)[j * 32 + 12];
        let thin = coverage(&line(&[[0.0, 85.0], [320.0, 85.0]], 1.0), &window);
        let near = |j: usize, v: f32| (row(&thin, j) - v).abs() < 1e-6;
        assert!(near(6, 0.0) && near(7, 0.1) && near(8, 1.0) && near(9, 0.1) && near(10, 0.0));
        let wide = coverage(&line(&[[0.0, 85.0], [320.0, 85.0]], 50.0), &window);
        assert_eq!([4, 5, 6, 8, 10, 11, 12].map(|j| row(&wide, j)), [0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0]);
        // a part of the world has the same coverage
        let part = Window { origin: [10, 4], cells: [7, 9], ..window };
        assert_eq!(coverage(&line(&[[30.0, 20.0], [200.0, 150.0]], 15.0), &part), {
            coverage(&line(&[[30.0, 20.0], [200.0, 150.0]], 15.0), &window).crop(&part)
        });
    }

    #[test]
    fn lines_beyond_the_world_are_cut_or_wrapped() {
        let world = World { size: [80.0, 80.0], cells: [8, 8], ..World::default() };
        let across = line(&[[65.0, 45.0], [105.0, 45.0]], 10.0);
        let columns = |world: World| -> Vec<usize> {
            let cover = coverage(&across, &Window::whole(world));
            (0..8).filter(|i| cover.plane(0)[4 * 8 + i] > 0.9).collect()
        };
        assert_eq!(columns(world), [6, 7]);
        assert_eq!(columns(World { boundary: Boundary::all(Edge::Periodic), ..world }), [0, 1, 2, 6, 7]);
    }
}
