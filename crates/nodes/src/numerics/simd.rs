//! Run-time choice of the SIMD level, with the same bytes at every level.
//!
//! A kernel is an ordinary loop over slices, written without branches so that the compiler can vectorise it. `simd!`
//! compiles it once per instruction set and calls the widest one of the machine. Rust never contracts or reorders
//! floating-point operations, so every version gives the same bits; a test in the workspace's suite compares them.
//!
//! Two things keep a loop from being vectorised well, and show as `vgather` and as scalar instructions in its code. In
//! `if q > 0.0 { a[i] } else { b[i] }` the compiler may select an address: load both numbers first, or select bits. In
//! arrays of slices it loses their lengths: give each slice its own name and its own `[..n]`.
//!
//! The environment variable [`VARIABLE`] selects a narrower instruction set than that of the machine.
//!
//! With `RUSTFLAGS="--cfg orograph_baseline"` kernels are compiled only for the baseline, which nearly halves the
//! compile time of this crate: for work on a kernel, not for releases.

use std::{
    str::FromStr,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU8, Ordering},
    },
};

/// The environment variable that names the widest instruction set to use: `baseline`, `avx2` or `avx512`.
pub const VARIABLE: &str = "OROGRAPH_SIMD";

/// An instruction set that kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Level {
    /// The baseline of the target (SSE2 on x86-64, NEON on 64-bit Arm).
    Baseline = 1,
    /// AVX2 with FMA, 8 lanes.
    Avx2 = 2,
    /// AVX-512 F, BW, DQ and VL, 16 lanes.
    Avx512 = 3,
}

impl FromStr for Level {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "baseline" => Ok(Self::Baseline),
            "avx2" => Ok(Self::Avx2),
            "avx512" => Ok(Self::Avx512),
            _ => Err(format!("`{VARIABLE}={text}` names no instruction set; use `baseline`, `avx2` or `avx512`")),
        }
    }
}

static LEVEL: AtomicU8 = AtomicU8::new(0);

/// Returns the instruction set that the environment selects. Returns None if it selects none.
///
/// # Errors
/// If the variable has another value.
pub fn asked() -> Result<Option<Level>, String> {
    match std::env::var_os(VARIABLE) {
        Some(text) if !text.is_empty() => text.to_string_lossy().parse().map(Some),
        _ => Ok(None),
    }
}

/// Returns the widest instruction set that may be used: that of the machine, or the narrower one that the environment
/// selects.
#[must_use]
pub fn widest() -> Level {
    match asked() {
        Ok(Some(level)) => level.min(detected()),
        _ => detected(),
    }
}

/// Returns the widest instruction set of this machine.
#[must_use]
pub fn detected() -> Level {
    #[cfg(all(target_arch = "x86_64", not(orograph_baseline)))]
    {
        let avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
        if avx2
            && is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
        {
            return Level::Avx512;
        }
        if avx2 {
            return Level::Avx2;
        }
    }
    Level::Baseline
}

/// Returns the instruction set in use.
#[must_use]
#[inline]
pub fn level() -> Level {
    match LEVEL.load(Ordering::Relaxed) {
        3 => Level::Avx512,
        2 => Level::Avx2,
        1 => Level::Baseline,
        _ => {
            let level = widest();
            LEVEL.store(level as u8, Ordering::Relaxed);
            level
        }
    }
}

/// Runs a function with at most the given instruction set, to compare results. The level is process-wide, so calls from
/// several threads run one after the other.
pub fn at<T>(level: Level, run: impl FnOnce() -> T) -> T {
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    /// Restores the widest level, even if the run panics.
    struct Restore;
    impl Drop for Restore {
        fn drop(&mut self) {
            LEVEL.store(widest() as u8, Ordering::Relaxed);
        }
    }
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let _restore = Restore;
    LEVEL.store(level.min(widest()) as u8, Ordering::Relaxed);
    run()
}

/// Compiles a function for each instruction set and dispatches at run time.
///
/// Functions that it calls in its inner loops must be `#[inline(always)]` to be compiled with it. It may be generic
/// over types with one bound each.
macro_rules! simd {
    ($(#[$meta:meta])* $vis:vis fn $name:ident $(<$($of:ident: $bound:path),+>)? ($($arg:ident: $ty:ty),* $(,)?)
        $(-> $ret:ty)? $body:block) => {
        $(#[$meta])*
        $vis fn $name $(<$($of: $bound),+>)? ($($arg: $ty),*) $(-> $ret)? {
            #[inline(always)]
            fn kernel $(<$($of: $bound),+>)? ($($arg: $ty),*) $(-> $ret)? $body

            #[cfg(all(target_arch = "x86_64", not(orograph_baseline)))]
            {
                #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma")]
                fn avx512 $(<$($of: $bound),+>)? ($($arg: $ty),*) $(-> $ret)? {
                    kernel $(::<$($of),+>)? ($($arg),*)
                }
                #[target_feature(enable = "avx2,fma")]
                fn avx2 $(<$($of: $bound),+>)? ($($arg: $ty),*) $(-> $ret)? {
                    kernel $(::<$($of),+>)? ($($arg),*)
                }
                #[expect(unsafe_code, reason = "calling a function compiled for features found at run time")]
                match $crate::numerics::simd::level() {
                    // SAFETY: `level` is at most that of this machine, which `detected` returns.
                    $crate::numerics::simd::Level::Avx512 => return unsafe { avx512 $(::<$($of),+>)? ($($arg),*) },
                    // SAFETY: as above.
                    $crate::numerics::simd::Level::Avx2 => return unsafe { avx2 $(::<$($of),+>)? ($($arg),*) },
                    $crate::numerics::simd::Level::Baseline => {}
                }
            }
            kernel $(::<$($of),+>)? ($($arg),*)
        }
    };
}
pub(crate) use simd;

#[cfg(test)]
mod tests {
    simd! {
        /// Doubles.
        fn double(out: &mut [f32], source: &[f32]) {
            for (o, s) in out.iter_mut().zip(source) {
                *o = s * 2.0;
            }
        }
    }

    #[test]
    fn the_dispatched_kernel_runs() {
        let mut out = [0.0; 37];
        double(&mut out, &[1.5; 37]);
        assert_eq!(out, [3.0; 37]);
        assert!(super::level() <= super::detected());
        assert_eq!(super::at(super::Level::Baseline, super::level), super::Level::Baseline);
    }
}
