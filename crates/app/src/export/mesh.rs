//! Terrain as triangles: glTF binary and Wavefront OBJ.
//!
//! A regular grid of vertices spans the world, as fine as the number of triangles allows and never finer than the
//! cells. Lengths are metres; x is east, y up, z south, right-handed, with the centre of the world at x = z = 0 and y
//! the elevation, so that meshes of windows fit together. Each square is split along the diagonal whose ends differ
//! less in height, so that diagonal ridges and valleys stay connected. Textures of the same window need no adjustment:
//! u is east and v south from its north-west corner.
//!
//! Sources: Khronos Group, 2021, "glTF 2.0 Specification"; Wavefront Technologies, 1995, "Object Files (.obj)".

use std::io::{self, Write};

use clap::ValueEnum;
use orograph_graph::{Field, NodeError};
use orograph_nodes::raster::GoOn;
use serde_json::json;

use super::vertices::{at_vertices, extent, spacing};

/// The largest number of triangles of a mesh: its file stays below the 4 GiB limit of glTF.
pub const MOST_TRIANGLES: u64 = 50_000_000;

/// A mesh format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MeshFormat {
    /// glTF 2.0 in one binary file
    Glb,
    /// Wavefront OBJ, a text format
    Obj,
}

impl MeshFormat {
    /// The extension of its files.
    #[must_use]
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Glb => "glb",
            Self::Obj => "obj",
        }
    }
}

/// A triangle mesh of a world.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// x, y and z of each vertex in metres.
    pub positions: Vec<[f32; 3]>,
    /// Unit normal of the terrain at each vertex.
    pub normals: Vec<[f32; 3]>,
    /// u to the east and v to the south, 0 to 1, of each vertex.
    pub places: Vec<[f32; 2]>,
    /// Vertices of each triangle, anticlockwise from above.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// The mesh of a height field, of at most `most` triangles (at least two).
    ///
    /// # Errors
    /// [`NodeError::Cancelled`] when `go_on` returns false.
    pub fn of(height: &Field, most: u64, go_on: GoOn<'_>) -> Result<Self, NodeError> {
        let [nx, ny] = squares(height.window().cells, most);
        let grid = at_vertices(height, [nx + 1, ny + 1], go_on)?;
        let (columns, rows) = (nx as usize + 1, ny as usize + 1);
        let (size, [dx, dy], z) = (extent(height), spacing(height, [nx + 1, ny + 1]), grid.plane(0));
        let window = height.window();
        // offset of the north-west corner from the centre of the world, in whole cells: exact for the whole world
        let corner = [0, 1].map(|axis| {
            let middle = 0.5 * (f64::from(window.world.cells[axis]) * window.cell_m());
            f64::from(window.origin[axis]) * window.cell_m() - middle
        });
        let mut mesh = Self {
            positions: Vec::with_capacity(z.len()),
            normals: Vec::with_capacity(z.len()),
            places: Vec::with_capacity(z.len()),
            triangles: Vec::with_capacity(2 * (columns - 1) * (rows - 1)),
        };
        // central differences; one-sided at the edges
        let slope = |at: usize, index: usize, count: usize, stride: usize, d: f64| {
            let (back, on) = (usize::from(index > 0), usize::from(index + 1 < count));
            let rise = f64::from(z[at + on * stride]) - f64::from(z[at - back * stride]);
            rise / ((back + on) as f64 * d)
        };
        for j in 0..rows {
            for i in 0..columns {
                let at = j * columns + i;
                let (x, south) = (i as f64 * dx, j as f64 * dy);
                let (p, q) = (slope(at, i, columns, 1, dx), slope(at, j, rows, columns, dy));
                let length = (1.0 + p * p + q * q).sqrt();
                mesh.positions.push([(x + corner[0]) as f32, z[at], (south + corner[1]) as f32]);
                mesh.normals.push([-p / length, 1.0 / length, -q / length].map(|v| v as f32));
                mesh.places.push([(x / size[0]) as f32, (south / size[1]) as f32]);
            }
        }
        for j in 0..rows - 1 {
            for i in 0..columns - 1 {
                let north = j * columns + i;
                let south = north + columns;
                let falling = (z[north] - z[south + 1]).abs() <= (z[north + 1] - z[south]).abs();
                let [nw, ne, sw, se] = [north, north + 1, south, south + 1].map(|at| at as u32);
                mesh.triangles.extend(if falling {
                    [[nw, sw, se], [nw, se, ne]]
                } else {
                    [[nw, sw, ne], [ne, sw, se]]
                });
            }
        }
        Ok(mesh)
    }

    /// Writes the mesh in a format.
    ///
    /// # Errors
    /// The error of the writer.
    pub fn write(&self, format: MeshFormat, to: &mut dyn Write) -> io::Result<()> {
        match format {
            MeshFormat::Glb => self.write_glb(to),
            MeshFormat::Obj => self.write_obj(to),
        }
    }

    fn write_glb(&self, to: &mut dyn Write) -> io::Result<()> {
        let count = self.positions.len();
        let views = [12 * count, 12 * count, 8 * count, 12 * self.triangles.len()];
        let start = |view: usize| views[..view].iter().sum::<usize>();
        let vertices =
            |view: usize| json!({"buffer": 0, "byteOffset": start(view), "byteLength": views[view], "target": 34962});
        let of_vertices =
            |view: usize, ty: &str| json!({"bufferView": view, "componentType": 5126, "count": count, "type": ty});
        let end = |pick: fn(f32, f32) -> f32, from: f32| {
            self.positions.iter().fold([from; 3], |end, v| [0, 1, 2].map(|axis| pick(end[axis], v[axis])))
        };
        let mut positions = of_vertices(0, "VEC3");
        positions["min"] = json!(end(f32::min, f32::INFINITY));
        positions["max"] = json!(end(f32::max, f32::NEG_INFINITY));
        let scene = json!({
            "asset": {"version": "2.0", "generator": concat!("orograph ", env!("CARGO_PKG_VERSION"))},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0, "name": "land"}],
            "meshes": [{"primitives": [{
                "attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3, "material": 0,
            }]}],
            "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0}}],
            "accessors": [
                positions,
                of_vertices(1, "VEC3"),
                of_vertices(2, "VEC2"),
                {"bufferView": 3, "componentType": 5125, "count": 3 * self.triangles.len(), "type": "SCALAR"},
            ],
            "bufferViews": [
                vertices(0),
                vertices(1),
                vertices(2),
                {"buffer": 0, "byteOffset": start(3), "byteLength": views[3], "target": 34963},
            ],
            "buffers": [{"byteLength": start(4)}],
        });
        let mut text = scene.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let whole = 12 + 8 + text.len() + 8 + start(4);
        let word = |number: usize| u32::try_from(number).map(u32::to_le_bytes).map_err(io::Error::other);
        to.write_all(b"glTF")?;
        to.write_all(&word(2)?)?;
        to.write_all(&word(whole)?)?;
        to.write_all(&word(text.len())?)?;
        to.write_all(b"JSON")?;
        to.write_all(&text)?;
        to.write_all(&word(start(4))?)?;
        to.write_all(b"BIN\0")?;
        for numbers in [&self.positions, &self.normals] {
            numbers.as_flattened().iter().try_for_each(|v| to.write_all(&v.to_le_bytes()))?;
        }
        self.places.as_flattened().iter().try_for_each(|v| to.write_all(&v.to_le_bytes()))?;
        self.triangles.as_flattened().iter().try_for_each(|v| to.write_all(&v.to_le_bytes()))
    }

    fn write_obj(&self, to: &mut dyn Write) -> io::Result<()> {
        writeln!(to, "# metres; x east, y up, z south\no land")?;
        for [x, y, z] in &self.positions {
            writeln!(to, "v {x} {y} {z}")?;
        }
        // the texture origin is the lower left here
        for [u, v] in &self.places {
            writeln!(to, "vt {u} {}", 1.0 - v)?;
        }
        for [x, y, z] in &self.normals {
            writeln!(to, "vn {x} {y} {z}")?;
        }
        for [a, b, c] in self.triangles.iter().map(|corners| corners.map(|corner| corner + 1)) {
            writeln!(to, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}")?;
        }
        Ok(())
    }
}

/// Squares along x and y: nearly square, no more than the cells, with two triangles each, within `most`.
fn squares([nx, ny]: [u32; 2], most: u64) -> [u32; 2] {
    let budget = (most.min(MOST_TRIANGLES) / 2).max(1);
    if u64::from(nx) * u64::from(ny) <= budget {
        return [nx, ny];
    }
    let share = (budget as f64 * f64::from(nx) / f64::from(ny)).sqrt() as u32;
    let across = share.clamp(1, nx.min(u32::try_from(budget).unwrap_or(u32::MAX)));
    let down = u32::try_from(budget / u64::from(across)).unwrap_or(u32::MAX).clamp(1, ny);
    [across, down]
}

#[cfg(test)]
mod tests {
    use orograph_graph::Window;
    use orograph_nodes::numerics::math;

    use super::*;
    use crate::testing::field;

    fn hills() -> Field {
        field([60, 40], 25.0, |x, y| 80.0 * math::sin(x / 170.0) * math::cos(y / 110.0) + 300.0)
    }

    fn mesh(height: &Field, most: u64) -> Mesh {
        Mesh::of(height, most, &|| true).expect("not stopped")
    }

    #[test]
    fn a_mesh_keeps_to_its_number_of_triangles() {
        for most in [2, 3, 7, 100, 2399, 4800, 1_000_000] {
            let count = mesh(&hills(), most).triangles.len() as u64;
            assert!(count <= most && count <= 4800, "{count} of {most}");
            assert!(most < 100 || count * 10 >= most.min(4800) * 9, "{count} of {most}");
        }
        assert_eq!(squares([5000, 3], 200), [100, 1]);
        assert_eq!(squares([3, 5000], 200), [1, 100]);
    }

    /// Two adjacent windows have the positions of the whole and share an edge.
    #[test]
    fn meshes_of_windows_fit_together() {
        let whole = hills();
        let half = |west: u32| whole.crop(&Window { origin: [west, 0], cells: [30, 40], ..*whole.window() });
        let ends = |height: &Field| {
            let mesh = mesh(height, 1_000_000);
            let x = mesh.positions.iter().map(|[x, ..]| *x);
            [x.clone().fold(f32::INFINITY, f32::min), x.fold(f32::NEG_INFINITY, f32::max)]
        };
        assert_eq!([ends(&whole), ends(&half(0)), ends(&half(30))], [[-750.0, 750.0], [-750.0, 0.0], [0.0, 750.0]]);
    }

    /// The triangles cover the world once, all facing up: their shadows sum to its area.
    #[test]
    fn triangles_face_up_and_cover_the_world() {
        let mesh = mesh(&hills(), 3000);
        let mut area = 0.0;
        for corners in &mesh.triangles {
            let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize].map(f64::from));
            // the y component of (b - a) x (c - a)
            let twice = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2]);
            assert!(twice > 0.0);
            area += 0.5 * twice;
        }
        assert!((area / (1500.0 * 1000.0) - 1.0).abs() < 1e-6, "{area}"); // positions are single precision
    }

    #[test]
    fn a_plane_has_its_normal() {
        let mesh = mesh(&field([300, 300], 2.0, |x, y| 0.75 * x - 0.5 * y), 5000);
        let length = (1.0 + 0.75 * 0.75 + 0.5 * 0.5_f32).sqrt();
        let expected = [-0.75 / length, 1.0 / length, 0.5 / length];
        let side = mesh.positions.len().isqrt();
        // not at the edge, where the outermost cells extend half outside
        for normal in (2..side - 2).flat_map(|j| &mesh.normals[j * side + 2..(j + 1) * side - 2]) {
            assert!(normal.iter().zip(expected).all(|(got, expected)| (got - expected).abs() < 1e-5), "{normal:?}");
        }
    }

    /// The file, decoded as the specification requires.
    #[test]
    fn gltf_reads_back() {
        let mesh = mesh(&hills(), 1000);
        let mut file = Vec::new();
        mesh.write(MeshFormat::Glb, &mut file).expect("written to memory");
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().expect("four bytes")) as usize;
        assert_eq!((&file[..4], word(4), word(8)), (b"glTF".as_slice(), 2, file.len()));
        let text = word(12);
        assert_eq!((&file[16..20], text % 4), (b"JSON".as_slice(), 0));
        let scene: serde_json::Value = serde_json::from_slice(&file[20..20 + text]).expect("JSON");
        let number = |value: &serde_json::Value| value.as_u64().expect("a whole number") as usize;
        let binary = 20 + text;
        assert_eq!((&file[binary + 4..binary + 8], word(binary) % 4), (b"BIN\0".as_slice(), 0));
        let data = &file[binary + 8..];
        assert_eq!(scene["buffers"][0]["byteLength"], data.len());
        let attributes = &scene["meshes"][0]["primitives"][0]["attributes"];
        let numbers = |accessor: &serde_json::Value| -> Vec<[u8; 4]> {
            let accessor = &scene["accessors"][number(accessor)];
            let view = &scene["bufferViews"][number(&accessor["bufferView"])];
            let [start, len] = ["byteOffset", "byteLength"].map(|name| number(&view[name]));
            let per = match accessor["type"].as_str().expect("a name") {
                "VEC3" => 3,
                "VEC2" => 2,
                _ => 1,
            };
            assert_eq!(number(&accessor["count"]) * per * 4, len);
            assert_eq!(start % 4, 0);
            data[start..start + len].chunks_exact(4).map(|bytes| bytes.try_into().expect("four bytes")).collect()
        };
        let reals = |accessor| numbers(accessor).into_iter().map(f32::from_le_bytes).collect::<Vec<_>>();
        assert_eq!(reals(&attributes["POSITION"]), mesh.positions.as_flattened());
        assert_eq!(reals(&attributes["NORMAL"]), mesh.normals.as_flattened());
        assert_eq!(reals(&attributes["TEXCOORD_0"]), mesh.places.as_flattened());
        let corners: Vec<u32> = numbers(&json!(3)).into_iter().map(u32::from_le_bytes).collect();
        assert_eq!(corners, mesh.triangles.as_flattened());
        let highest = mesh.positions.iter().map(|v| v[1]).fold(f32::MIN, f32::max);
        assert_eq!(scene["accessors"][0]["max"][1].as_f64().expect("a number") as f32, highest);
    }

    #[test]
    fn obj_has_a_line_for_each_element() {
        let mesh = mesh(&hills(), 500);
        let mut file = Vec::new();
        mesh.write(MeshFormat::Obj, &mut file).expect("written to memory");
        let text = String::from_utf8(file).expect("a text");
        let lines = |start: &str| text.lines().filter(|line| line.starts_with(start)).count();
        assert_eq!(
            [lines("v "), lines("vt "), lines("vn "), lines("f ")],
            [mesh.positions.len(), mesh.positions.len(), mesh.positions.len(), mesh.triangles.len()]
        );
        assert!(text.contains("\nvt 0 1\n") && text.contains("\nf 1/1/1 "), "the first vertex is north-west");
    }
}
