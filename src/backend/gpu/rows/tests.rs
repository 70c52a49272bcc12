//! Faces, depth and the validation of rows.

use glam::DVec3;

use super::*;
use crate::backend::gpu::layout::FIRST_FRONT;
use crate::backend::gpu::test_support::{gpu, read_texture};
use crate::scene::{Material, Scene, Triangle};

/// The item buffer of the last hemicube drawn alone, line by line.
fn items(h: &HemicubeRows) -> Vec<u32> {
    read_texture(&h.gpu, &h.batches.resolutions[0].targets.texture, 0)
}

/// A patch at the origin that faces +z, and small triangles around each given centre, facing the
/// origin or away from it.
fn around_origin(centres: &[(DVec3, bool)]) -> Mesh {
    let mut corners = vec![[DVec3::X, DVec3::Y, -DVec3::X - DVec3::Y].map(|p| p * 0.01)];
    for &(centre, front) in centres {
        let (x, y) = centre.normalize().any_orthonormal_pair();
        let (x, y) = if front { (y, x) } else { (x, y) };
        let small = centre.length() * 0.1;
        corners.push([x, -0.5 * x + 0.9 * y, -0.5 * x - 0.9 * y].map(|p| centre + p * small));
    }
    let triangles = (0..corners.len() as u32)
        .map(|t| Triangle { corners: [3 * t, 3 * t + 1, 3 * t + 2], ..Default::default() });
    let triangles = triangles.collect();
    let materials = vec![Material::grey("grey", 0.5)];
    let scene =
        Scene::new(corners.into_iter().flatten().collect(), triangles, vec!["g".into()], materials);
    Mesh::new(scene.unwrap(), f64::INFINITY).unwrap()
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn faces_look_along_their_frames() {
    let gpu = gpu();
    // Pixels off all symmetries, in each face's own image.
    let pixels = [(40, 11), (9, 20), (50, 7), (30, 26), (13, 13)];
    let patch = NodeId(0);
    let frame = Frame::new(DVec3::Z, rotation(patch));
    let faces = Face::all(&frame);
    let toward = |f: usize| (faces[f].direction(64, pixels[f].0, pixels[f].1), f.is_multiple_of(2));
    let mesh = around_origin(&[0, 1, 2, 3, 4].map(toward));
    let mut h = HemicubeRows::new(&gpu, &mesh, 64).unwrap();
    h.rows(&mesh, &[patch], 1.0).unwrap();
    let items = items(&h);
    for (f, &(x, y)) in pixels.iter().enumerate() {
        let line = Face::rows(f, 64).start + y;
        // Triangle f + 1 has one cell; the patch's own triangle has the first.
        let want = if f.is_multiple_of(2) { FIRST_FRONT + 1 + f as u32 } else { BACK };
        assert_eq!(items[(line * 64 + x) as usize], want, "face {f}");
    }
    // A marker is 0.1 wide at distance 1 or more: below 12 pixels across, so most see nothing.
    let open = items.iter().filter(|&&i| i == OPEN).count();
    assert!(open > 192 * 64 - 5 * 12 * 12 && open < 192 * 64, "{open}");
    assert!(!items.contains(&FIRST_FRONT), "its own triangle is never hit");
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn nearer_of_two_is_seen() {
    let gpu = gpu();
    // Same cone of directions, drawn far first and near first.
    for (near, far) in [(1, 2), (2, 1)] {
        let at = |k: u32| (DVec3::new(0.3, 0.2, 1.0) * if k == near { 1.0 } else { 2.0 }, true);
        let mesh = around_origin(&[at(1), at(2)]);
        let row =
            &HemicubeRows::new(&gpu, &mesh, 64).unwrap().rows(&mesh, &[NodeId(0)], 1.0).unwrap()[0];
        let share =
            |k: u32| row.entries.iter().find(|e| e.element == k).map_or(0, |e| u64::from(e.share));
        // The far one is visible at most by the pixels of the outline.
        assert!(share(near) > 10 * share(far), "{} {}", share(near), share(far));
    }
}

#[test]
fn row_check_rejects_invalid_rows() {
    let total = Row::TOTAL;
    let entries = |counts: &[(u32, u32)]| -> Vec<RowEntry> {
        let entry = |&(slot, count): &(u32, u32)| RowEntry { slot, count, ..Default::default() };
        counts.iter().map(entry).collect()
    };
    let seen = FIRST_FRONT + 1;
    let good = [(OPEN, total - 10), (BACK, 3), (seen, 7)];
    let good = row_of(&entries(&good), NodeId(5)).unwrap();
    assert_eq!((good.escaped, good.backface), (total - 10, 3));
    assert_eq!(good.entries, [Entry { element: 1, share: 7 }]);
    // Nothing written, all bits set, one unit too few, one too many: sums beyond 32 bits count.
    let all = [OPEN, BACK, FIRST_FRONT, seen].map(|slot| (slot, total));
    let bad: [&[(u32, u32)]; 4] =
        [&[], &all, &[(OPEN, total - 10), (BACK, 3), (seen, 6)], &[(OPEN, total), (seen, 1)]];
    for counts in bad {
        let e = row_of(&entries(counts), NodeId(5)).unwrap_err();
        assert!(e.contains("patch 5"), "{e}");
    }
}
