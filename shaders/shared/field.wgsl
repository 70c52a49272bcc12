// The radiosity that surfaces reflect. Needs shared/element.wgsl before it.

const ELEMENTS_A_LINE: u32 = 2048u;   // of their texture

@group(2) @binding(1) var elements: texture_2d<f32>;   // reflected radiosity at corners

// Reflected radiosity at a position of a triangle, by the weights of its second and third corner:
// linear between the corners of the element, which are in three lines.
fn reflected(triangle: u32, weights: vec2f) -> vec3f {
    let at = element_at(triangle, weights);
    let at_a = vec2u(at.element % ELEMENTS_A_LINE, at.element / ELEMENTS_A_LINE * 3u);
    let a = textureLoad(elements, at_a, 0).rgb;
    let b = textureLoad(elements, at_a + vec2u(0u, 1u), 0).rgb;
    let c = textureLoad(elements, at_a + vec2u(0u, 2u), 0).rgb;
    return a + (b - a) * at.weights.x + (c - a) * at.weights.y;
}
