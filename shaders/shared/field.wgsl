// The radiosity that surfaces reflect, and their reflectance. Needs shared/element.wgsl before it.

// Reflected radiosity at corners; with the element's reflectance, a channel at each of them.
@group(2) @binding(1) var elements: texture_2d<f32>;

struct OnElement {
    radiosity: vec3f,     // reflected
    reflectance: vec3f,   // mean over the element
    side: u32,            // elements of its size along an edge of the triangle
}

// The field at a position of a triangle, by the weights of its second and third corner: linear
// between the corners of the element, which are in three lines.
fn field_at(triangle: u32, weights: vec2f) -> OnElement {
    let at = element_at(triangle, weights);
    let at_a = vec2u(at.element % TEXELS_PER_LINE, at.element / TEXELS_PER_LINE * 3u);
    let a = textureLoad(elements, at_a, 0);
    let b = textureLoad(elements, at_a + vec2u(0u, 1u), 0);
    let c = textureLoad(elements, at_a + vec2u(0u, 2u), 0);
    let radiosity = a.rgb + (b.rgb - a.rgb) * at.weights.x + (c.rgb - a.rgb) * at.weights.y;
    return OnElement(radiosity, vec3f(a.a, b.a, c.a), at.side);
}
