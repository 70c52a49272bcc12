//! `item_buffer.wgsl` and `reduce.wgsl` against their twins, with actual hemicubes.

use super::*;
use crate::backend::cpu::{item_buffer, reduce};
use crate::backend::gpu::layout::Reduction;
use crate::backend::gpu::reduce::stride;
use crate::backend::gpu::test_support::{
    gpu, offsets, picture, read_buffer, read_texture, scene, symbol,
};

/// Each pixel has the twin's item there, or within 1/128 pixel of there; see [`offsets`].
fn compare_items(n: u32, device: &[u32], twins: &[Vec<u32>], what: &str) {
    let wrong: Vec<bool> =
        (0..device.len()).map(|k| twins.iter().all(|twin| twin[k] != device[k])).collect();
    let [a, b] = [device, &twins[0]].map(|i| i.iter().map(|&i| symbol(i)).collect::<Vec<_>>());
    let wrongs = wrong.iter().filter(|w| **w).count();
    assert!(wrongs == 0, "{what}: {wrongs} pixels\n{}", picture(n as usize, &a, &b, &wrong));
    // The test is only significant if few pixels are near an outline.
    let unsure = (0..device.len()).filter(|&k| twins.iter().any(|t| t[k] != twins[0][k])).count();
    assert!(unsure * 5 < device.len(), "{what}: {unsure} of {} pixels may be two", device.len());
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn item_buffer_and_reduce_equal_their_twins() {
    let gpu = gpu();
    let mesh = scene();
    let table = ItemTable::new(&mesh);
    // One word of padding a line and none; strips that end early; more than one workgroup across.
    for n in [8, 30, 64, 72] {
        let mut rows = HemicubeRows::new(&gpu, &mesh, n).unwrap();
        let patches = [mesh.element(0), mesh.element(2), mesh.root(1)];
        let drawn = rows.draw_batch(&mesh, &patches, 0).unwrap().unwrap();
        let order = &rows.draw_list.order;
        let corners = rows.coordinates.corners(mesh.scene(), order);
        let triangles: Vec<_> = order.iter().map(|&t| table.triangles[t as usize]).collect();
        let twin = item_buffer::ItemBuffer { corners: &corners, triangles: &triangles };
        let slots = rows.slots;
        let reduction = Reduction { resolution: n, slots, stride: stride(n) };
        let weights = hemicube::weights(n).unwrap();
        let left: Vec<u32> = read_buffer(&gpu, &rows.batches.reduce.rows);
        assert!(left.iter().all(|&share| share == 0), "rows are 0 for the next batch");
        let mut lines = vec![];
        for (k, &patch) in (0..).zip(&patches) {
            let views = rows.views(&mesh, patch).map(|v| v.face);
            let twins: Vec<Vec<_>> =
                offsets().into_iter().map(|offset| twin.draw(&views, n, offset).pixels).collect();
            let texture = &rows.batches.resolutions[0].targets.texture;
            let items: Vec<u32> = read_texture(&gpu, texture, k);
            compare_items(n, &items, &twins, &format!("{n} pixels, hemicube {k}"));
            for item in [OPEN, BACK] {
                assert!(items.contains(&item), "the scene shows all that there is to see");
            }
            for line in items.chunks(n as usize) {
                lines.extend(line);
                lines.resize(lines.len().next_multiple_of(stride(n) as usize), u32::MAX);
            }
            let twin = reduce::reduce(&lines, &weights, &table.slots, reduction, k);
            let row = &drawn[k as usize];
            let mut device = vec![0; slots as usize];
            (device[OPEN as usize], device[BACK as usize]) = (row.escaped, row.backface);
            for Entry { element, share } in &row.entries {
                device[(FIRST_FRONT + element) as usize] = *share;
            }
            assert_eq!(device, twin, "{n} pixels, hemicube {k}");
        }
    }
}
