//! Raw samples without a header: `.r16` is little-endian `u16` codes, `.r32` little-endian `f32` numbers.
//!
//! The sidecar gives the shape; without one, the file must be a square.

use std::io::Read;

use orograph_graph::memory::zeroed;

use super::{
    Coding, GoOn, Problem, Sidecar, claimed_cells,
    reader::{Each, Head, Reader, Rows, Source},
};

/// Opens 16-bit codes.
pub(super) fn open_r16<'a>(source: Source<'a>, sidecar: Option<&Sidecar>) -> Result<Reader<'a>, Problem> {
    let mut head = head(source.length, 2, sidecar)?;
    head.coding = Some(Coding { full: 65_535, range: sidecar.and_then(|s| s.range) });
    let numbers = Numbers { source, head: head.clone(), number: |b: [u8; 2]| f32::from(u16::from_le_bytes(b)) };
    Ok(Reader { head, rows: Box::new(numbers) })
}

/// Opens 32-bit numbers.
pub(super) fn open_r32<'a>(source: Source<'a>, sidecar: Option<&Sidecar>) -> Result<Reader<'a>, Problem> {
    let mut head = head(source.length, 4, sidecar)?;
    head.assumes_voids = sidecar.is_none();
    let numbers = Numbers { source, head: head.clone(), number: f32::from_le_bytes };
    Ok(Reader { head, rows: Box::new(numbers) })
}

/// Returns the head of a file of `held` bytes.
pub(super) fn head(held: u64, per_cell: u64, sidecar: Option<&Sidecar>) -> Result<Head, Problem> {
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
    let mut head = Head::new(columns as usize, rows as usize);
    sidecar.into_iter().for_each(|sidecar| sidecar.locate(&mut head));
    Ok(head)
}

/// Numbers of `N` bytes each, row by row.
pub(super) struct Numbers<'a, const N: usize> {
    pub(super) source: Source<'a>,
    pub(super) head: Head,
    pub(super) number: fn([u8; N]) -> f32,
}

impl<const N: usize> Rows for Numbers<'_, N> {
    fn read(mut self: Box<Self>, _: GoOn<'_>, each: &mut Each<'_>) -> Result<(), Problem> {
        let Head { columns, rows, .. } = self.head;
        let most = self.head.block_rows();
        let (mut bytes, mut samples) = (zeroed(most * columns * N)?, zeroed(most * columns)?);
        for first in (0..rows).step_by(most) {
            let count = most.min(rows - first) * columns;
            let bytes = &mut bytes[..count * N];
            self.source.bytes.read_exact(bytes).map_err(|error| Problem::truncated(error.to_string()))?;
            for (sample, bytes) in samples.iter_mut().zip(bytes.as_chunks::<N>().0) {
                *sample = (self.number)(*bytes);
            }
            each(first, &mut samples[..count])?;
        }
        Ok(())
    }

    fn bytes(&self) -> u64 {
        (self.head.block_rows() * self.head.columns * (N + size_of::<f32>())) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::memory;
    use super::*;

    fn read_r16(bytes: &[u8], sidecar: Option<&Sidecar>) -> Result<super::super::Raster, Problem> {
        open_r16(memory(bytes), sidecar)?.raster(&|| true)
    }

    fn read_r32(bytes: &[u8], sidecar: Option<&Sidecar>) -> Result<super::super::Raster, Problem> {
        open_r32(memory(bytes), sidecar)?.raster(&|| true)
    }
    #[test]
    fn a_square_needs_no_sidecar() {
        let bytes: Vec<u8> = [0_u16, 1, 256, 65_535].iter().flat_map(|v| v.to_le_bytes()).collect();
        let raster = read_r16(&bytes, None).unwrap();
        assert_eq!((raster.head.columns, raster.head.rows), (2, 2));
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
        assert_eq!((raster.head.columns, raster.head.rows, raster.voids.cells), (3, 1, 1));
        assert!(matches!(read_r32(&bytes, Some(&sidecar(2, 1))), Err(Problem::Damaged(_))));
        assert!(matches!(read_r32(&bytes, Some(&sidecar(30_000, 30_000))), Err(Problem::Lying { .. })));
        assert!(matches!(read_r32(&bytes, Some(&sidecar(0, 1))), Err(Problem::Empty { .. })));
    }
}
