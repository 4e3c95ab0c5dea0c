//! Memory whose allocation may fail.

use std::{
    alloc::{Layout, alloc_zeroed},
    cell::Cell,
    mem::size_of,
};

use crate::{job::NodeError, world};

/// The remedy when there is not enough memory.
pub const REMEDY: &str = "give the world fewer cells, build a part of it, or give the program more memory";

/// The system had no memory for a raster.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is not enough memory for another {}", world::bytes(*.bytes))]
pub struct OutOfMemory {
    /// The requested number of bytes.
    pub bytes: u64,
}

impl OutOfMemory {
    fn of<T>(count: usize) -> Self {
        Self { bytes: (count as u64).saturating_mul(size_of::<T>() as u64) }
    }
}

impl From<OutOfMemory> for NodeError {
    fn from(error: OutOfMemory) -> Self {
        Self::OutOfMemory(error)
    }
}

thread_local! {
    /// Without a destructor and initialized at compile time, so that an allocator may read it.
    static ASKING: Cell<bool> = const { Cell::new(false) };
}

/// Returns true while this thread makes an allocation that may fail. For the program's allocator, which must then
/// return null.
#[must_use]
pub fn is_asking() -> bool {
    ASKING.get()
}

/// Runs an allocation that may fail.
fn asking<T>(allocate: impl FnOnce() -> T) -> T {
    let before = ASKING.replace(true);
    let result = allocate();
    ASKING.set(before);
    result
}

/// Types whose value with all bytes 0 is the number 0.
#[expect(unsafe_code, reason = "a promise that only the types below make")]
/// # Safety
/// All bytes 0 must be a valid value.
pub unsafe trait Zero: Copy {}

macro_rules! zero {
    ($($ty:ty),*) => {
        $(
            #[expect(unsafe_code, reason = "a promise to `zeroed`")]
            // SAFETY: a number or `false` with all bytes 0 is valid.
            unsafe impl Zero for $ty {}
        )*
    };
}

zero!(bool, u8, u16, u32, u64, usize, i8, i16, i32, i64, isize, f32, f64);

#[expect(unsafe_code, reason = "a promise to `zeroed`")]
// SAFETY: valid elements side by side, without bytes in between.
unsafe impl<T: Zero, const N: usize> Zero for [T; N] {}

/// Allocates `count` zeros. The system provides pages when they are first written to, so the allocation itself takes no
/// time.
///
/// # Errors
/// [`OutOfMemory`].
pub fn zeroed<T: Zero>(count: usize) -> Result<Vec<T>, OutOfMemory> {
    let refused = OutOfMemory::of::<T>(count);
    let layout = Layout::array::<T>(count).map_err(|_| refused)?;
    if layout.size() == 0 {
        return with_capacity(0);
    }
    #[expect(unsafe_code, reason = "the standard library has no vector of zeros that may be refused")]
    // SAFETY: the size of the layout is not 0.
    let block = asking(|| unsafe { alloc_zeroed(layout) });
    if block.is_null() {
        return Err(refused);
    }
    #[expect(unsafe_code, reason = "as above")]
    // SAFETY: the block is of the global allocator and of this layout, and its bytes 0 are valid values.
    Ok(unsafe { Vec::from_raw_parts(block.cast(), count, count) })
}

/// Allocates `count` copies of a value.
///
/// # Errors
/// [`OutOfMemory`].
pub fn filled<T: Copy>(count: usize, value: T) -> Result<Vec<T>, OutOfMemory> {
    let mut all = with_capacity(count)?;
    all.resize(count, value);
    Ok(all)
}

/// Copies values.
///
/// # Errors
/// [`OutOfMemory`].
pub fn copied<T: Copy>(values: &[T]) -> Result<Vec<T>, OutOfMemory> {
    let mut all = with_capacity(values.len())?;
    all.extend_from_slice(values);
    Ok(all)
}

/// Collects an iterator of known length.
///
/// # Errors
/// [`OutOfMemory`].
pub fn collected<T>(values: impl ExactSizeIterator<Item = T>) -> Result<Vec<T>, OutOfMemory> {
    let mut all = with_capacity(values.len())?;
    all.extend(values);
    Ok(all)
}

/// An empty vector with capacity for that many values.
///
/// # Errors
/// [`OutOfMemory`].
pub fn with_capacity<T>(count: usize) -> Result<Vec<T>, OutOfMemory> {
    let mut all = Vec::new();
    asking(|| all.try_reserve_exact(count)).map_err(|_| OutOfMemory::of::<T>(count))?;
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_as_asked_for() {
        assert_eq!(zeroed::<f32>(5), Ok(vec![0.0; 5]));
        assert_eq!(zeroed::<[u32; 3]>(2), Ok(vec![[0; 3]; 2]));
        assert_eq!(zeroed::<[u32; 0]>(2), zeroed(2));
        assert_eq!(zeroed::<u8>(0), Ok(Vec::new()));
        assert_eq!(filled(3, f32::INFINITY), Ok(vec![f32::INFINITY; 3]));
        assert_eq!(copied(&[1, 2, 3]), Ok(vec![1, 2, 3]));
        assert_eq!(collected([1, 2, 3].iter().map(|v| v * v)), Ok(vec![1, 4, 9]));
        let mut rows = with_capacity::<u64>(7).expect("little");
        let room = rows.capacity();
        rows.extend(0..7);
        assert_eq!((rows.capacity(), room >= 7), (room, true), "it does not grow");
        let mut grown = zeroed::<u16>(3).expect("little");
        grown.push(9);
        assert_eq!(grown, [0, 0, 0, 9]);
    }

    #[test]
    fn what_cannot_be_had_is_refused_with_its_size() {
        // more addresses than any process has, and more bytes than can be counted
        for (count, bytes) in [(1 << 60, 1 << 62), (usize::MAX, u64::MAX)] {
            let refused = Err(OutOfMemory { bytes });
            assert_eq!(zeroed::<f32>(count).map(|all| all.len()), refused);
            assert_eq!(filled(count, 1.0_f32).map(|all| all.len()), refused);
            assert_eq!(with_capacity::<f32>(count).map(|all| all.len()), refused);
        }
        assert!(!is_asking());
        let error = OutOfMemory { bytes: 3 << 30 };
        assert_eq!(error.to_string(), "there is not enough memory for another 3.0 GiB");
        assert_eq!(NodeError::from(error), NodeError::OutOfMemory(error));
    }
}
