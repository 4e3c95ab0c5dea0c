//! Heights in single or double precision, and their total order.

/// A height that flow is routed on.
pub trait Elevation: Copy + PartialOrd + Send + Sync + 'static {
    /// A pass between two cells: height and link number, ordered as one integer.
    type Pass: Copy + Ord + Send + Sync;

    /// Returns the pass over a link between two heights: the higher of them, with ties broken by the link's number.
    fn pass(self, other: Self, link: u32) -> Self::Pass;

    /// Returns the height of a pass.
    fn pass_height(pass: Self::Pass) -> Self;

    /// Returns the link number of a pass.
    fn pass_link(pass: Self::Pass) -> u32;

    /// Computes a row of receivers by steepest descent, see [`super::receivers::d8`].
    fn d8_row(around: [&[Self]; 9], codes: &mut [u8]);

    /// Computes the links of a row that may be lowest passes, see the module `passes`.
    fn passes_row(heights: [&[Self]; 3], labels: [&[u32]; 3], links: &mut [u8]);

    /// A height above every other.
    const TOP: Self;

    /// Returns the drop to another height times a factor.
    fn slope(self, lower: Self, per_distance: f64) -> f64;
}

macro_rules! elevation {
    ($float:ty, $bits:ty, $pass:ty, $d8_row:path, $passes_row:path) => {
        impl Elevation for $float {
            type Pass = $pass;

            const TOP: Self = Self::INFINITY;

            #[inline(always)]
            fn pass(self, other: Self, link: u32) -> $pass {
                // order-preserving integers: negative numbers have all bits flipped, others the sign bit
                let ordered = |height: Self| {
                    let bits = height.to_bits();
                    let sign = 1 << (<$bits>::BITS - 1);
                    if bits & sign == 0 { bits | sign } else { !bits }
                };
                <$pass>::from(ordered(self).max(ordered(other))) << 32 | <$pass>::from(link)
            }

            #[inline(always)]
            fn pass_height(pass: $pass) -> Self {
                let bits = (pass >> 32) as $bits;
                let sign = 1 << (<$bits>::BITS - 1);
                Self::from_bits(if bits & sign == 0 { !bits } else { bits ^ sign })
            }

            #[inline(always)]
            fn pass_link(pass: $pass) -> u32 {
                pass as u32
            }

            #[inline(always)]
            fn d8_row(around: [&[Self]; 9], codes: &mut [u8]) {
                $d8_row(around, codes);
            }

            #[inline(always)]
            fn passes_row(heights: [&[Self]; 3], labels: [&[u32]; 3], links: &mut [u8]) {
                $passes_row(heights, labels, links);
            }

            #[inline(always)]
            fn slope(self, lower: Self, per_distance: f64) -> f64 {
                f64::from((self - lower) * per_distance as $float)
            }
        }
    };
}

elevation!(f32, u32, u64, super::receivers::d8_row_single, super::passes::passes_row_single);
elevation!(f64, u64, u128, super::receivers::d8_row_double, super::passes::passes_row_double);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_are_ordered_by_height_then_number_and_keep_both() {
        let heights = [-1e30_f32, -2.5, -0.0, 0.0, 1e-30, 7.25, 1e30];
        for (at, &height) in heights.iter().enumerate() {
            let pass = height.pass(-f32::INFINITY, 9);
            assert_eq!(f32::pass_height(pass).to_bits(), height.to_bits());
            assert_eq!(f32::pass_link(pass), 9);
            assert!(pass < height.pass(height, 10));
            assert!(heights[at + 1..].iter().all(|&above| pass < above.pass(height, 0)));
        }
        let pass = (-3.0_f64).pass(1234.5678, u32::MAX);
        assert_eq!((f64::pass_height(pass), f64::pass_link(pass)), (1234.5678, u32::MAX));
    }
}
