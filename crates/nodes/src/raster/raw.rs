//! Raw samples without a header: `.r16` is little-endian `u16` codes, `.r32` little-endian `f32` numbers.
//!
//! The sidecar gives the shape; without one, the file must be a square.

use orograph_graph::memory::collected;

use super::{Coding, Problem, Raster, Sidecar, claimed_cells};

/// Decodes 16-bit codes.
pub(super) fn read_r16(bytes: &[u8], sidecar: Option<&Sidecar>) -> Result<Raster, Problem> {
    let (columns, rows) = shape(bytes, 2, sidecar)?;
    let samples = collected(bytes.chunks_exact(2).map(|b| f32::from(u16::from_le_bytes([b[0], b[1]]))))?;
    let mut raster = Raster::new(columns, rows, samples);
    raster.coding = Some(Coding { full: 65_535, range: sidecar.and_then(|s| s.range) });
    raster.cell = sidecar.and_then(Sidecar::cell);
    Ok(raster)
}

/// Decodes 32-bit numbers.
pub(super) fn read_r32(bytes: &[u8], sidecar: Option<&Sidecar>) -> Result<Raster, Problem> {
    let (columns, rows) = shape(bytes, 4, sidecar)?;
    let samples = collected(bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])))?;
    let mut raster = Raster::new(columns, rows, samples);
    raster.cell = sidecar.and_then(Sidecar::cell);
    Ok(raster)
}

fn shape(bytes: &[u8], per_cell: u64, sidecar: Option<&Sidecar>) -> Result<(usize, usize), Problem> {
    let held = bytes.len() as u64;
    let (columns, rows) = match sidecar.and_then(|s| s.columns.zip(s.rows)) {
        Some(shape) => shape,
        None => {
            let side = (held / per_cell).isqrt();
            if side == 0 || side * side * per_cell != held {
                return Err(Problem::NoShape { bytes: held, per_cell });
            }
            (side, side)
        }
    };
    let cells = claimed_cells(columns, rows, per_cell, held, 1)?;
    if cells as u64 * per_cell != held {
        return Err(Problem::damaged(format!(
            "its sidecar says {columns} x {rows} cells of {per_cell} bytes, but it has {held} bytes"
        )));
    }
    Ok((columns as usize, rows as usize))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_needs_no_sidecar() {
        let bytes: Vec<u8> = [0_u16, 1, 256, 65_535].iter().flat_map(|v| v.to_le_bytes()).collect();
        let raster = read_r16(&bytes, None).unwrap();
        assert_eq!((raster.columns, raster.rows), (2, 2));
        assert_eq!(raster.samples, [0.0, 1.0, 256.0, 65_535.0]);
        assert_eq!(raster.decoded([-100.0, 500.0]).samples[3], 500.0);
        assert!(matches!(read_r16(&bytes[..6], None), Err(Problem::NoShape { bytes: 6, per_cell: 2 })));
        assert!(matches!(read_r32(&[], None), Err(Problem::NoShape { .. })));
    }

    #[test]
    fn a_sidecar_tells_the_shape_and_is_checked() {
        let bytes: Vec<u8> = [1.5_f32, f32::NAN, -2.0].iter().flat_map(|v| v.to_le_bytes()).collect();
        let sidecar = |columns, rows| Sidecar { columns: Some(columns), rows: Some(rows), ..Sidecar::default() };
        let raster = read_r32(&bytes, Some(&sidecar(3, 1))).unwrap();
        assert_eq!((raster.columns, raster.rows, raster.voids()), (3, 1, 1));
        assert!(matches!(read_r32(&bytes, Some(&sidecar(2, 1))), Err(Problem::Damaged(_))));
        assert!(matches!(read_r32(&bytes, Some(&sidecar(30_000, 30_000))), Err(Problem::Lying { .. })));
        assert!(matches!(read_r32(&bytes, Some(&sidecar(0, 1))), Err(Problem::Empty { .. })));
    }
}
