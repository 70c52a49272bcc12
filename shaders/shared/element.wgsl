// The element at a position of a triangle. Needs shared/lattice.wgsl before it.

// Per triangle of the scene its first node and the number of cells along an edge, a power of two;
// then the nodes of all quadtrees: INNER + first child, or an element.
@group(2) @binding(0) var<storage, read> quadtrees: array<u32>;

struct InElement {
    element: u32,
    weights: vec2f,       // of its second and third corner
    side: u32,            // elements of its size along an edge of the triangle
}

// Looked up in a lattice of nodes at the deepest level that the quadtree is complete to, then by
// descent; `weights` are those of the triangle's second and third corner.
fn element_at(triangle: u32, weights: vec2f) -> InElement {
    let first = quadtrees[2u * triangle];
    var side = quadtrees[2u * triangle + 1u];
    let at = weights * f32(side);
    let square = lattice_square(at, side);
    var p = at - vec2f(square);
    let beyond = p.x + p.y > 1.0 && has_flipped_cell(square, side);
    if beyond {
        p = 1.0 - p;
    }
    var node = quadtrees[first + cell_index(square, side, beyond)];
    // Reads outside of the array return 0, an element: the descent ends.
    while (node & INNER) != 0u {
        node &= ~INNER;
        side *= 2u;
        if p.x > 0.5 {
            node += 1u;
            p = vec2f(2.0 * p.x - 1.0, 2.0 * p.y);
        } else if p.y > 0.5 {
            node += 2u;
            p = vec2f(2.0 * p.x, 2.0 * p.y - 1.0);
        } else if p.x + p.y > 0.5 {
            node += 3u;
            p = 1.0 - 2.0 * p;
        } else {
            p = 2.0 * p;
        }
        node = quadtrees[node];
    }
    return InElement(node, p, side);
}
