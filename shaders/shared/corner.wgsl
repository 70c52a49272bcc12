// A corner of a triangle, and its view coordinates. Put before the draw shader.

// Vector from the eye, itself in two parts, to a corner. For corners near the eye the first
// difference is exact: small objects keep their shape.
fn from_eye(corner: Corner, eye: vec3f, eye_low: vec3f) -> vec3f {
    return (corner.high - eye) + (corner.low - eye_low);
}

// Whether the eye sees a covered back of the triangle of corner `index`: it is not drawn.
fn shows_covered_back(index: u32, eye: vec3f, eye_low: vec3f) -> bool {
    if corners[index].back_is_covered == 0u {
        return false;
    }
    let first = index - index % 3u;
    let a = from_eye(corners[first], eye, eye_low);
    let b = from_eye(corners[first + 1u], eye, eye_low);
    let c = from_eye(corners[first + 2u], eye, eye_low);
    return dot(a, cross(b - a, c - a)) >= 0.0;
}

// Clip coordinates of a point with view coordinates x, y and w (along the view's axis). Lines from
// tangent `bottom` to 1 fill the viewport; depth near/w is reversed, its far end infinite.
fn clip_position(x: f32, y: f32, w: f32, bottom: f32, near: f32) -> vec4f {
    return vec4f(x, (2.0 * y - (1.0 + bottom) * w) / (1.0 - bottom), near, w);
}
