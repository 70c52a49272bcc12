// What a gather draws: one face of a hemicube, or the tile of a light. Put before its draw shaders.

const MAX_EXPLICIT_LIGHTS: u32 = 8u;

struct RadianceView {
    eye: vec3f,           // the point, from the middle of the scene, in units of its size
    near: f32,            // near plane, same unit
    right: vec3f,         // dot products with these three are clip x, y and w
    bottom: f32,          // tangent of the lowest line's elevation: -1 or 0
    up: vec3f,
    light: u32,           // the light that a tile looks for
    forward: vec3f,
    light_count: u32,     // how many lights have tiles of their own
    eye_low: vec3f,       // what rounding took off the eye
    padding: u32,
    lights: array<u32, MAX_EXPLICIT_LIGHTS>,   // and which: their exitance is not counted here
}
