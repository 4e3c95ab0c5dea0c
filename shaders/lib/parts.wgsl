// Lines that a workgroup solves, each of them in up to PARTS parts of one invocation. It needs `cells_of_line`.

const LINES = 8u;
const PARTS = 32u;

fn part_length() -> u32 { return max((cells_of_line() + PARTS - 1u) / PARTS, 2u); }

fn parts_of_line() -> u32 { return (cells_of_line() + part_length() - 1u) / part_length(); }
