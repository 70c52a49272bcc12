//! The walls of a box.

/// Walls of a box from `low` to `high`, seen from inside: x low and high, y, z.
pub fn walls(low: [f64; 3], high: [f64; 3]) -> [[[f64; 3]; 4]; 6] {
    let ([a, b, c], [x, y, z]) = (low, high);
    [
        [[a, b, c], [a, y, c], [a, y, z], [a, b, z]],
        [[x, b, c], [x, b, z], [x, y, z], [x, y, c]],
        [[a, b, c], [a, b, z], [x, b, z], [x, b, c]],
        [[a, y, c], [x, y, c], [x, y, z], [a, y, z]],
        [[a, b, c], [x, b, c], [x, y, c], [a, y, c]],
        [[a, b, z], [a, y, z], [x, y, z], [x, b, z]],
    ]
}
