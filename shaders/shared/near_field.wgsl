// Near surfaces, whose elements are too wide to know their light there: where they cover much of
// the hemisphere of a point, paths find the light that they reflect. Needs shared/trace.wgsl before
// it.

// Whether a hit is nearer than its element is wide, of which there are `side` along an edge of the
// triangle.
fn is_near(hit: Hit, side: u32) -> bool {
    let t = triangles[hit.triangle];
    let count = f32(side);
    // A right triangle with two sides of this width has the area.
    let square = length(cross(t.edge_u, t.edge_v)) / (count * count);
    return hit.distance * hit.distance < square;
}

// Whether paths find the light of as many `near` rays of all.
fn is_covered(near: f32, rays: f32) -> bool {
    return near > MIN_COVERED * rays;
}
