//! Run-time choice of the SIMD width, with the same bytes at every width.
//!
//! A kernel is an ordinary loop over slices, written without branches so that the compiler can vectorise it. `simd!`
//! compiles it once per instruction set and calls the widest that the machine has. Rust never contracts or reorders
//! floating-point operations, so every version gives the same bits; a test in the workspace's suite compares them.

use std::sync::atomic::{AtomicU8, Ordering};

/// An instruction set that kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Level {
    /// What the target always has (SSE2 on x86-64, NEON on 64-bit Arm).
    Baseline = 1,
    /// AVX2 with FMA, 8 lanes.
    Avx2 = 2,
    /// AVX-512 F, BW, DQ and VL, 16 lanes.
    Avx512 = 3,
}

static LEVEL: AtomicU8 = AtomicU8::new(0);

/// The widest instruction set of this machine.
#[must_use]
pub fn detected() -> Level {
    #[cfg(target_arch = "x86_64")]
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

/// The instruction set in use.
#[must_use]
#[inline]
pub fn level() -> Level {
    match LEVEL.load(Ordering::Relaxed) {
        3 => Level::Avx512,
        2 => Level::Avx2,
        1 => Level::Baseline,
        _ => {
            let level = detected();
            LEVEL.store(level as u8, Ordering::Relaxed);
            level
        }
    }
}

/// Lowers the instruction set in use, to compare results; never raises it above what the machine has.
pub fn limit(level: Level) {
    LEVEL.store(level.min(detected()) as u8, Ordering::Relaxed);
}

/// Compiles a function for each instruction set and dispatches at run time.
///
/// Functions that it calls in its inner loops must be `#[inline(always)]` to be compiled along with it. It may be generic
/// over types with one bound each.
macro_rules! simd {
    ($(#[$meta:meta])* $vis:vis fn $name:ident $(<$($of:ident: $bound:path),+>)? ($($arg:ident: $ty:ty),* $(,)?)
        $(-> $ret:ty)? $body:block) => {
        $(#[$meta])*
        $vis fn $name $(<$($of: $bound),+>)? ($($arg: $ty),*) $(-> $ret)? {
            #[inline(always)]
            fn kernel $(<$($of: $bound),+>)? ($($arg: $ty),*) $(-> $ret)? $body

            #[cfg(target_arch = "x86_64")]
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
                match $crate::simd::level() {
                    // SAFETY: `level` is at most what `detected` found on this machine.
                    $crate::simd::Level::Avx512 => return unsafe { avx512 $(::<$($of),+>)? ($($arg),*) },
                    // SAFETY: as above.
                    $crate::simd::Level::Avx2 => return unsafe { avx2 $(::<$($of),+>)? ($($arg),*) },
                    $crate::simd::Level::Baseline => {}
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
    }
}
