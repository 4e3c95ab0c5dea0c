//! Cells in the order of their heights, for peaks and for the flood.

/// Cells with a height from the highest to the lowest, equal ones by number: a radix sort in three passes.
pub(super) fn from_the_top(heights: &[f32]) -> Vec<u32> {
    // the order-preserving number of a height, inverted
    let key = |cell: u32| {
        let bits = heights[cell as usize].to_bits();
        if bits >> 31 == 0 { !(bits | 1 << 31) } else { bits }
    };
    let mut order: Vec<u32> = (0..heights.len() as u32).filter(|&cell| heights[cell as usize].is_finite()).collect();
    let mut sorted = vec![0_u32; order.len()];
    for shift in [0, 11, 22] {
        let digit = |cell: u32| (key(cell) >> shift & 0x7ff) as usize;
        let mut starts = vec![0_usize; 2049];
        order.iter().for_each(|&cell| starts[digit(cell) + 1] += 1);
        (1..2049).for_each(|at| starts[at] += starts[at - 1]);
        for &cell in &order {
            let place = &mut starts[digit(cell)];
            sorted[*place] = cell;
            *place += 1;
        }
        std::mem::swap(&mut order, &mut sorted);
    }
    order
}

/// The same cells from the lowest to the highest, equal ones by number.
pub(super) fn from_the_bottom<'a>(heights: &'a [f32], order: &'a [u32]) -> impl Iterator<Item = u32> + 'a {
    let is_level = |a: &u32, b: &u32| heights[*a as usize].to_bits() == heights[*b as usize].to_bits();
    order.chunk_by(is_level).rev().flatten().copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_in_the_order_of_their_heights() {
        let heights = [3.0, -1.0, f32::NAN, 7.5, -1.0, 0.0, -0.0, -9.0];
        let order = from_the_top(&heights);
        assert_eq!(order, [3, 0, 5, 6, 1, 4, 7]);
        assert_eq!(from_the_bottom(&heights, &order).collect::<Vec<_>>(), [7, 1, 4, 6, 5, 0, 3]);
    }
}
