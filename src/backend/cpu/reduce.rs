//! Twin of `shaders/reduce.wgsl`: item buffers to dense rows.

use crate::backend::gpu::layout::Reduction;

/// The dense row, in slots, of hemicube `index`: adds the weight of every pixel to the slot of its
/// visible item. `items` has lines of `reduction.stride` words.
pub fn reduce(
    items: &[u32],
    weights: &[u32],
    slot_of_item: &[u32],
    reduction: Reduction,
    index: u32,
) -> Vec<u32> {
    let Reduction { resolution: n, slots, stride } = reduction;
    let mut row = vec![0; slots as usize];
    for y in 0..3 * n {
        for x in 0..n {
            let item = items[((index * 3 * n + y) * stride + x) as usize];
            row[slot_of_item[item as usize] as usize] += weights[(y * n + x) as usize];
        }
    }
    row
}
