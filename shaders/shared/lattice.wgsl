// Cells of a triangle's lattice. Put before the draw shaders.
//
//   side = 2      A position p is in steps along the first side (x) and along the third (y).
//   2 |\          A square of the lattice holds an upright cell and, beyond its diagonal, a flipped
//     |0\         one. Cells count up along y: upright, flipped, upright, …, then the next square
//   1 |--\        along x.
//     |\1|\
//   0 |_\|_\
//     0  1  2

// The three corners of a triangle's lattice.
fn lattice_corner(corner: u32, side: u32) -> vec2f {
    return f32(side) * vec2f(f32(corner == 1u), f32(corner == 2u));
}

// The square that contains a position; positions outside due to rounding are clamped.
fn lattice_square(p: vec2f, side: u32) -> vec2u {
    let i = min(u32(p.x), side - 1u);
    return vec2u(i, min(u32(p.y), side - 1u - i));
}

// Whether the square has a flipped cell: not where its diagonal is the triangle's own side.
fn has_flipped_cell(square: vec2u, side: u32) -> bool {
    return square.x + square.y + 1u < side;
}

// Index of a cell of the square: the upright one, or the flipped one beyond the diagonal.
fn cell_index(square: vec2u, side: u32, beyond: bool) -> u32 {
    return square.x * (2u * side - square.x) + 2u * square.y + u32(beyond);
}
