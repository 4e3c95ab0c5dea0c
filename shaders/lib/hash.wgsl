// Hashes of crates/nodes/src/numerics/noise (`lattice`), equal to those of the CPU bit for bit, as they are integers.

/// A bijective 32-bit mixing function (C. Wellons, 2018, "lowbias32").
fn mix_bits(v: u32) -> u32 {
    var x = v;
    x ^= x >> 16u;
    x *= 0x7feb352du;
    x ^= x >> 15u;
    x *= 0x846ca68bu;
    return x ^ (x >> 16u);
}

/// The part of the hash that depends only on the lattice row.
fn hash_row(row: i32, seed: u32) -> u32 {
    return mix_bits(u32(row) * 0xd8163841u + seed);
}

/// The hash of a lattice point from its column and the hash of its row.
fn hash_point(column: i32, row_hash: u32) -> u32 {
    return mix_bits(u32(column) * 0x8da6b343u + row_hash);
}
