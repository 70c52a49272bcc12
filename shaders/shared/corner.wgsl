// A corner of a triangle, and where a view has it. Put before the draw shaders.

// A corner in two parts that add up to it.
struct Corner {
    high: vec3f,          // from the middle of the scene, in units of its size
    padding: u32,
    low: vec3f,           // what rounding took off
    padding_2: u32,
}

// From the eye, itself in two parts, to a corner. Of corners near the eye the first difference is
// exact: nothing is too small to be seen.
fn from_eye(corner: Corner, eye: vec3f, eye_low: vec3f) -> vec3f {
    return (corner.high - eye) + (corner.low - eye_low);
}

// Clip coordinates of a point with view coordinates x, y and w (along the view's axis). Lines from
// tangent `bottom` to 1 fill the viewport; depth near/w is reversed, its far end infinite.
fn clip_position(x: f32, y: f32, w: f32, bottom: f32, near: f32) -> vec4f {
    return vec4f(x, (2.0 * y - (1.0 + bottom) * w) / (1.0 - bottom), near, w);
}
