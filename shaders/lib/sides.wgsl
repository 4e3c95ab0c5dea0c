// The sides of the world; see crates/nodes/src/numbers.rs.

const SIDE_OPEN: u32 = 0u;
const SIDE_BASE: u32 = 1u;
const SIDE_WALL: u32 = 2u;
const SIDE_PERIODIC: u32 = 3u;
