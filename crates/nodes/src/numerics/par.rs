//! Parallel loops, and loops over rows that report progress and can be cancelled.
//!
//! rayon's iterators are generic over the loop's body, so each loop compiles rayon's splitting, joining and stealing
//! again, with several copies of the body. The loops of this crate all end in one call through a pointer per part of a
//! raster (`drive`), so that this is compiled once; within a part the loop is an ordinary one. Each part costs some
//! locking and calls, so parts are rows or hundreds of cells, never single cells.

use std::{
    convert::Infallible,
    ops::ControlFlow,
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
};

use orograph_graph::{Field, Job, NodeError, memory::zeroed};
use rayon::prelude::*;

/// Calls `run(k)` for each k below `count`, in parallel, until a call breaks.
#[inline(never)]
fn drive(count: usize, run: &(dyn Fn(usize) -> ControlFlow<()> + Sync)) {
    let _: ControlFlow<()> = (0..count).into_par_iter().try_for_each(run);
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Calls `run(k, part)` for each part, in parallel.
///
/// # Errors
/// An error of `run`, after which no further part begins.
pub fn each<P: Send, E: Send>(
    parts: impl IntoIterator<Item = P>,
    run: impl Fn(usize, P) -> Result<(), E> + Sync,
) -> Result<(), E> {
    let parts: Vec<Mutex<Option<P>>> = parts.into_iter().map(|part| Mutex::new(Some(part))).collect();
    let failure = Mutex::new(None);
    drive(parts.len(), &|k| {
        let done = match lock(&parts[k]).take() {
            Some(part) => run(k, part),
            None => Ok(()),
        };
        match done {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                *lock(&failure) = Some(error);
                ControlFlow::Break(())
            }
        }
    });
    failure.into_inner().unwrap_or_else(PoisonError::into_inner).map_or(Ok(()), Err)
}

/// As [`each`], with a buffer that parts use one after another: `run(room, k, part)`.
///
/// # Errors
/// As [`each`].
pub fn each_with<S: Send, P: Send, E: Send>(
    parts: impl IntoIterator<Item = P>,
    room: impl Fn() -> S + Sync,
    run: impl Fn(&mut S, usize, P) -> Result<(), E> + Sync,
) -> Result<(), E> {
    let rooms = Mutex::new(Vec::new());
    each(parts, |k, part| {
        let free = lock(&rooms).pop();
        let mut own = free.unwrap_or_else(&room);
        run(&mut own, k, part)?;
        lock(&rooms).push(own);
        Ok(())
    })
}

/// Returns the results of both functions, which run side by side where a thread is free.
pub fn both<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    rayon::join(a, b)
}

/// As [`each`], for loops that cannot fail.
pub fn all<P: Send>(parts: impl IntoIterator<Item = P>, run: impl Fn(usize, P) + Sync) {
    let Ok(()) = each(parts, |k, part| {
        run(k, part);
        Ok::<_, Infallible>(())
    });
}

/// Returns `of(k, part)` for each part, in order.
///
/// # Errors
/// As [`each`].
pub fn collect<P: Send, R: Send, E: Send>(
    parts: impl IntoIterator<Item = P>,
    of: impl Fn(usize, P) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    collect_with(parts, || (), |(), k, part| of(k, part))
}

/// As [`collect`], with a buffer that parts use one after another: `of(room, k, part)`.
///
/// # Errors
/// As [`each`].
pub fn collect_with<S: Send, P: Send, R: Send, E: Send>(
    parts: impl IntoIterator<Item = P>,
    room: impl Fn() -> S + Sync,
    of: impl Fn(&mut S, usize, P) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    let parts: Vec<P> = parts.into_iter().collect();
    let mut results: Vec<Option<R>> = parts.iter().map(|_| None).collect();
    each_with(parts.into_iter().zip(&mut results), room, |room, k, (part, result)| {
        *result = Some(of(room, k, part)?);
        Ok(())
    })?;
    Ok(results.into_iter().flatten().collect())
}

/// As [`collect`], for functions that cannot fail.
pub fn collect_all<P: Send, R: Send>(parts: impl IntoIterator<Item = P>, of: impl Fn(usize, P) -> R + Sync) -> Vec<R> {
    let Ok(results) = collect(parts, |k, part| Ok::<_, Infallible>(of(k, part)));
    results
}

/// Returns the number of cells per part if the loop does not choose: the same for any number of threads, with enough
/// parts for many threads.
fn cells_of_a_part(count: usize) -> usize {
    count.div_ceil(256).clamp(256, 1 << 14)
}

/// Returns a field of `value(cell)` for each cell of the job's window, row by row; progress goes through `share`.
///
/// # Errors
/// [`NodeError::Cancelled`], or not enough memory.
pub fn field(job: &Job<'_>, share: [f32; 2], value: &(dyn Fn(usize) -> f32 + Sync)) -> Result<Field, NodeError> {
    let mut out = zeroed(job.window().len())?;
    let nx = job.window().nx();
    rows_within(job, share, &mut out, |j, row| {
        row.iter_mut().enumerate().for_each(|(i, out)| *out = value(j * nx + i));
    })?;
    Ok(Field::new(job.window(), out))
}

/// Returns `value(k)` for each k below `count`.
pub fn map<T: Clone + Default + Send>(count: usize, value: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let mut out = vec![T::default(); count];
    let size = cells_of_a_part(count);
    all(out.chunks_mut(size), |part, out| (part * size..).zip(out).for_each(|(k, out)| *out = value(k)));
    out
}

/// Returns `value(cell)` for each cell.
pub fn map_of<A: Sync, T: Clone + Default + Send>(from: &[A], value: impl Fn(&A) -> T + Sync) -> Vec<T> {
    let mut out = vec![T::default(); from.len()];
    change_with(&mut out, from, |out, from| *out = value(from));
    out
}

/// Calls `change(cell)` for each cell.
pub fn change<A: Send>(cells: &mut [A], change: impl Fn(&mut A) + Sync) {
    let size = cells_of_a_part(cells.len());
    all(cells.chunks_mut(size), |_, cells| cells.iter_mut().for_each(&change));
}

/// Calls `change(cell, other)` for each cell and the cell at the same place in `with`.
pub fn change_with<A: Send, B: Sync>(cells: &mut [A], with: &[B], change: impl Fn(&mut A, &B) + Sync) {
    let size = cells_of_a_part(cells.len());
    all(cells.chunks_mut(size).zip(with.chunks(size)), |_, (cells, with)| {
        cells.iter_mut().zip(with).for_each(|(cell, other)| change(cell, other));
    });
}

/// Calls `change(k, cell)` for each cell and its index.
pub fn change_at<A: Send>(cells: &mut [A], change: impl Fn(usize, &mut A) + Sync) {
    let size = cells_of_a_part(cells.len());
    all(cells.chunks_mut(size), |part, cells| (part * size..).zip(cells).for_each(|(k, cell)| change(k, cell)));
}

/// Returns the number of cells for which `counts` is true.
pub fn count<A: Sync>(cells: &[A], counts: impl Fn(&A) -> bool + Sync) -> usize {
    let part = |_, cells: &[A]| cells.iter().map(|cell| usize::from(counts(cell))).sum::<usize>();
    collect_all(cells.chunks(cells_of_a_part(cells.len())), part).into_iter().sum()
}

/// Returns true if `is` is true for any cell.
pub fn any<A: Sync>(cells: &[A], is: impl Fn(&A) -> bool + Sync) -> bool {
    each(cells.chunks(cells_of_a_part(cells.len())), |_, cells| if cells.iter().any(&is) { Err(()) } else { Ok(()) })
        .is_err()
}

/// Returns true if `is` is true for any cell and the cell at the same place in `with`.
pub fn any_with<A: Sync, B: Sync>(cells: &[A], with: &[B], is: impl Fn(&A, &B) -> bool + Sync) -> bool {
    let size = cells_of_a_part(cells.len());
    let part = |_, (cells, with): (&[A], &[B])| {
        if cells.iter().zip(with).any(|(cell, other)| is(cell, other)) { Err(()) } else { Ok(()) }
    };
    each(cells.chunks(size).zip(with.chunks(size)), part).is_err()
}

/// Sorts floating-point numbers in their total order.
pub fn sort(samples: &mut [f32]) {
    samples.par_sort_unstable_by(f32::total_cmp);
}

/// Sorts keys.
pub fn sort_keys<K: Ord + Send>(keys: &mut [K]) {
    keys.par_sort_unstable();
}

/// Calls `row(j, samples)` for each row of `out`, in parallel, checking for cancellation at each row. `share` is the
/// start and end of this part of the job's progress.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn rows_within(
    job: &Job<'_>,
    share: [f32; 2],
    out: &mut [f32],
    row: impl Fn(usize, &mut [f32]) + Sync,
) -> Result<(), NodeError> {
    rows_by(job, share, out, &row)
}

/// [`rows_within`] without generic parameters, so that it is compiled once.
fn rows_by(
    job: &Job<'_>,
    share: [f32; 2],
    out: &mut [f32],
    row: &(dyn Fn(usize, &mut [f32]) + Sync),
) -> Result<(), NodeError> {
    let nx = job.window().nx();
    let count = out.len().div_ceil(nx.max(1));
    let done = AtomicUsize::new(0);
    each(out.chunks_mut(nx.max(1)), |j, samples| {
        row(j, samples);
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        if done.is_multiple_of(64) || done == count {
            job.advance(share[0] + (share[1] - share[0]) * done as f32 / count as f32)
        } else {
            job.check()
        }
    })
}

/// As [`rows_within`], for rows that are the whole job.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn rows(job: &Job<'_>, out: &mut [f32], row: impl Fn(usize, &mut [f32]) + Sync) -> Result<(), NodeError> {
    rows_by(job, [0.0, 1.0], out, &row)
}

/// Computes a raster row by row in the memory of another, whose samples each row contains at first; in new memory if
/// the other is still used elsewhere.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn rows_from(
    job: &Job<'_>,
    share: [f32; 2],
    from: &mut Vec<f32>,
    kept: bool,
    row: impl Fn(usize, &mut [f32]) + Sync,
) -> Result<Vec<f32>, NodeError> {
    let mut out = if kept { from.clone() } else { std::mem::take(from) };
    rows_by(job, share, &mut out, &row)?;
    Ok(out)
}

/// Calls `band(j, rows)` for each band of `height` rows of `out` (the last may have fewer rows), in parallel, where j
/// is the band's first row. For kernels that keep state from row to row.
///
/// # Errors
/// The error of `band`, or [`NodeError::Cancelled`].
pub fn bands_within(
    job: &Job<'_>,
    share: [f32; 2],
    height: usize,
    out: &mut [f32],
    band: impl Fn(usize, &mut [f32]) -> Result<(), NodeError> + Sync,
) -> Result<(), NodeError> {
    bands_by(job, share, height, out, &band)
}

/// A function of a band's first row and its samples.
type Band<'a> = dyn Fn(usize, &mut [f32]) -> Result<(), NodeError> + Sync + 'a;

/// [`bands_within`] without generic parameters, so that it is compiled once.
fn bands_by(job: &Job<'_>, share: [f32; 2], height: usize, out: &mut [f32], band: &Band<'_>) -> Result<(), NodeError> {
    let size = job.window().nx().max(1) * height.max(1);
    let count = out.len().div_ceil(size);
    let done = AtomicUsize::new(0);
    each(out.chunks_mut(size), |k, rows| {
        band(k * height, rows)?;
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        job.advance(share[0] + (share[1] - share[0]) * done as f32 / count as f32)
    })
}
