//! Water surfaces as triangles: the areas that lines bound, such as lakes, flat at their levels.
//!
//! The rings of an area are cut into slabs at the rows of their vertices; between two rows the inside is a series of
//! trapezoids, found by the even-odd rule (M. de Berg et al. 2008, Computational Geometry, chapter 6). Both sides of a
//! row have the same vertices, so that no gaps open between slabs. Coordinates are those of the meshes of heights.

use std::collections::HashMap;

use orograph_graph::{Line, Lines, Window};

use super::mesh::Mesh;

/// Returns the surfaces of all areas as one mesh. Returns None if there are none.
#[must_use]
pub fn mesh_of_areas(lines: &Lines, window: &Window) -> Option<Mesh> {
    let mut mesh = Mesh::default();
    for (area, rings) in lines.rings() {
        Surface { mesh: &mut mesh, window, level_m: area.level_m, places: HashMap::new() }.add(rings);
    }
    (!mesh.triangles.is_empty()).then_some(mesh)
}

/// The surface of one area in progress.
struct Surface<'a> {
    mesh: &'a mut Mesh,
    window: &'a Window,
    level_m: f64,
    /// The vertices by the bits of their positions.
    places: HashMap<[u64; 2], u32>,
}

/// An edge of a ring, from north to south; level ones are left out.
#[derive(Clone, Copy)]
struct Side {
    north: [f64; 2],
    south: [f64; 2],
}

impl Side {
    fn at(&self, y: f64) -> f64 {
        if y <= self.north[1] {
            self.north[0]
        } else if y >= self.south[1] {
            self.south[0]
        } else {
            let share = (y - self.north[1]) / (self.south[1] - self.north[1]);
            self.north[0] + (self.south[0] - self.north[0]) * share
        }
    }
}

impl Surface<'_> {
    fn add(&mut self, rings: &[Line]) {
        let mut sides: Vec<Side> = Vec::new();
        let mut rows: Vec<f64> = Vec::new();
        for ring in rings {
            rows.extend(ring.vertices.iter().map(|vertex| vertex.position_m[1]));
            let pairs = ring.vertices.windows(2).map(|pair| [pair[0].position_m, pair[1].position_m]);
            sides.extend(pairs.filter(|[a, b]| a[1] != b[1]).map(|[a, b]| {
                let (north, south) = if a[1] < b[1] { (a, b) } else { (b, a) };
                Side { north, south }
            }));
        }
        rows.sort_by(f64::total_cmp);
        rows.dedup();
        sides.sort_by(|a, b| a.north[1].total_cmp(&b.north[1]).then(a.north[0].total_cmp(&b.north[0])));

        // the trapezoids of each slab, west to east, and the vertices on each row
        let mut slabs: Vec<Vec<[[f64; 2]; 2]>> = Vec::new();
        let mut points: Vec<Vec<f64>> = vec![Vec::new(); rows.len()];
        let (mut open, mut next): (Vec<Side>, usize) = (Vec::new(), 0);
        for (row, pair) in rows.windows(2).enumerate() {
            open.retain(|side| side.south[1] > pair[0]);
            while sides.get(next).is_some_and(|side| side.north[1] <= pair[0]) {
                open.push(sides[next]);
                next += 1;
            }
            let mut crossings: Vec<[f64; 2]> = open.iter().map(|side| [side.at(pair[0]), side.at(pair[1])]).collect();
            crossings.sort_by(|a, b| (a[0] + a[1]).total_cmp(&(b[0] + b[1])));
            for at in 0..2 {
                points[row + at].extend(crossings.iter().map(|crossing| crossing[at]));
            }
            slabs.push(crossings.as_chunks().0.to_vec());
        }
        for points in &mut points {
            points.sort_by(f64::total_cmp);
            points.dedup();
        }
        for (row, slab) in slabs.into_iter().enumerate() {
            for [west, east] in slab {
                let mut chain = |at: usize| -> Vec<(f64, u32)> {
                    let within = points[row + at].iter().filter(|x| (west[at]..=east[at]).contains(x));
                    within.map(|&x| (x, self.vertex([x, rows[row + at]]))).collect()
                };
                let (north, south) = (chain(0), chain(1));
                self.fill(&north, &south);
            }
        }
    }

    /// Adds the triangles between two rows of vertices.
    fn fill(&mut self, north: &[(f64, u32)], south: &[(f64, u32)]) {
        let (mut i, mut j) = (0, 0);
        while i + 1 < north.len() || j + 1 < south.len() {
            let to_north = match (north.get(i + 1), south.get(j + 1)) {
                (Some(north), Some(south)) => north.0 <= south.0,
                (north, _) => north.is_some(),
            };
            if to_north {
                self.mesh.triangles.push([north[i].1, south[j].1, north[i + 1].1]);
                i += 1;
            } else {
                self.mesh.triangles.push([north[i].1, south[j].1, south[j + 1].1]);
                j += 1;
            }
        }
    }

    /// Returns the vertex at a position in metres from the north-west corner.
    fn vertex(&mut self, position_m: [f64; 2]) -> u32 {
        let (mesh, window, level_m) = (&mut *self.mesh, self.window, self.level_m);
        let (size, metres) = (window.world.size, |cells: u32| f64::from(cells) * window.cell_m());
        *self.places.entry(position_m.map(f64::to_bits)).or_insert_with(|| {
            let [x, z] = [0, 1].map(|axis| (position_m[axis] - 0.5 * size[axis]) as f32);
            mesh.positions.push([x, level_m as f32, z]);
            mesh.normals.push([0.0, 1.0, 0.0]);
            mesh.places
                .push([0, 1].map(|axis| {
                    ((position_m[axis] - metres(window.origin[axis])) / metres(window.cells[axis])) as f32
                }));
            mesh.positions.len() as u32 - 1
        })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use orograph_graph::{Area, Vertex, World};

    use super::*;

    fn ring(corners: &[[f64; 2]]) -> Line {
        let vertex = |&position_m: &[f64; 2]| Vertex { position_m, ..Vertex::default() };
        let vertices = corners.iter().chain(corners.first()).map(vertex).collect();
        Line { order: 1, downstream: None, vertices }
    }

    /// A lake with an island, whose shore has a step; and a slanting one.
    fn lakes() -> Lines {
        let outer = [[10.0, 10.0], [10.0, 60.0], [70.0, 60.0], [70.0, 20.0], [40.0, 20.0], [40.0, 10.0]];
        let island = [[20.0, 30.0], [30.0, 30.0], [30.0, 50.0], [20.0, 50.0]];
        let slanting = [[80.0, 10.0], [75.0, 40.0], [95.0, 60.0]];
        let area = |rings, level_m| Area { rings, level_m, ..Area::default() };
        Lines {
            areas: vec![area(2, 5.0), area(1, 7.0)],
            ..Lines::open(vec![ring(&outer), ring(&island), ring(&slanting)])
        }
    }

    #[test]
    fn surfaces_are_flat_face_up_and_have_the_area_of_the_rings() {
        let world = World { size: [100.0, 80.0], cells: [10, 8], ..World::default() };
        let mesh = mesh_of_areas(&lakes(), &Window::whole(world)).expect("water");
        let mut areas: BTreeMap<u32, f64> = BTreeMap::new();
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize].map(f64::from));
            assert!(a[1] == b[1] && b[1] == c[1]);
            // anticlockwise from above: x east, z south
            let doubled = (c[0] - a[0]) * (b[2] - a[2]) - (b[0] - a[0]) * (c[2] - a[2]);
            assert!(doubled > 0.0, "{triangle:?}");
            *areas.entry(a[1] as u32).or_default() += 0.5 * doubled;
        }
        // 60 x 50 less the step and the island; half of the cross product of the slanting one's sides
        assert_eq!(areas, BTreeMap::from([(5, 3000.0 - 300.0 - 200.0), (7, 0.5 * 700.0)]));
        assert!(mesh.positions.contains(&[-40.0, 5.0, -30.0]), "the middle of the world is at 0");
    }

    /// Every edge inside a surface belongs to two triangles: there are no vertices on the sides of others.
    #[test]
    fn surfaces_have_no_gaps() {
        let world = World { size: [100.0, 80.0], cells: [10, 8], ..World::default() };
        let mesh = mesh_of_areas(&lakes(), &Window::whole(world)).expect("water");
        let mut edges: BTreeMap<[u32; 2], usize> = BTreeMap::new();
        for [a, b, c] in &mesh.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *edges.entry([*from.min(to), *from.max(to)]).or_default() += 1;
            }
        }
        let on_ring = |[from, to]: [u32; 2]| {
            let [from, to] = [from, to].map(|at| mesh.positions[at as usize].map(f64::from));
            lakes().lines.iter().flat_map(|line| line.vertices.windows(2).map(<[Vertex]>::to_vec)).any(|pair| {
                let [a, b] = [0, 1].map(|at: usize| [pair[at].position_m[0] - 50.0, pair[at].position_m[1] - 40.0]);
                let off = |p: [f64; 3]| ((b[0] - a[0]) * (p[2] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])).abs();
                off(from) < 1e-3 && off(to) < 1e-3
            })
        };
        for (edge, count) in edges {
            assert!(count == 2 || count == 1 && on_ring(edge), "{edge:?} {count}");
        }
        assert_eq!(mesh_of_areas(&Lines::default(), &Window::whole(world)), None);
    }
}
