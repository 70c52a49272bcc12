//! What the fuzz target `texture` does with an input, and the replay of its corpus.
//!
//! An input is a byte of options, three places in texture space, and an image of any kind.

use radiosity::glam::DVec2;
use radiosity::io::read_scene;
use radiosity::scene::texture::TextureMap;

/// A triangle that has the image for its texture; options come before its name.
const OBJ: &str = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n";

/// Bytes of a place: u and v.
const PLACE: usize = 16;

/// Reads the image, and looks at it at the places and between them. Answers whether it was taken;
/// panics where a texture breaks its promises.
pub fn try_texture(input: &[u8]) -> bool {
    let Some((head, image)) = input.split_at_checked(1 + 3 * PLACE) else { return false };
    let clamp = if head[0] & 1 == 0 { "" } else { "-clamp on " };
    let library = format!("newmtl a\nKd 0.5 1 0.25\nmap_Kd {clamp}-s 1 -1 -o 0.5 i.tga\n");
    let files = [("m.mtl", library.as_bytes()), ("i.tga", image)];
    let scene = read_scene("it.obj", OBJ.as_bytes(), &files).expect("an image is never an error");
    let Some(textures) = scene.textures(0) else { return false };
    let map = textures.reflectance.as_ref().expect("the one that it has");
    let [width, height] = map.texture.size();
    assert!(width > 0 && height > 0 && u64::from(width) * u64::from(height) <= 1 << 27);
    let corners = [0, 1, 2].map(|k| place(&head[1 + k * PLACE..][..PLACE]));
    check(map, corners);
    // Most numbers of any bits are far from each other.
    if corners.iter().all(|uv| uv.is_finite()) {
        check(map, corners.map(|uv| 8.0 * (uv - uv.floor())));
        check(map, corners.map(|uv| 1.0 + 1e-7 * (uv - uv.floor())));
    }
    true
}

/// Two numbers of any bits.
fn place(bytes: &[u8]) -> DVec2 {
    let number = |k: usize| f64::from_le_bytes(std::array::from_fn(|b| bytes[8 * k + b]));
    DVec2::new(number(0), number(1))
}

/// Colours are those of texels, times the factor, or between them.
fn check(map: &TextureMap, corners: [DVec2; 3]) {
    let means = [map.mean(corners), map.whole_mean(), map.texture.mean(corners, true)];
    for colour in corners.into_iter().map(|uv| map.at(uv)).chain(means) {
        // Means are sums of millions of texels at most, rounded to 24 bits at each level.
        let in_range = colour.min_element() >= 0.0 && colour.max_element() <= 1.0 + 1e-5;
        assert!(in_range, "{colour} of {corners:?}");
    }
}
