//! Twin of `shaders/shared/gather_state.wgsl`: the state of each point of a gather between passes.

use bytemuck::{Pod, Zeroable};

use crate::backend::gpu::layout::{
    self, GatherSettings, LANES, PointState, RankedLight, RaySums, Visible,
};

/// Index of the sun in the visibilities of a point.
pub const SUN: usize = layout::SUN as usize;

impl PointState {
    /// The lights that rays are cast to, or that are sampled by rays over the hemisphere.
    pub fn ranked(&self) -> &[RankedLight] {
        &self.lights[..self.light_count as usize]
    }
}

/// What rays add to the state of a point, in one half.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct HalfSums {
    pub rays: RaySums,
    /// By light and sun.
    pub visible: [Visible; SUN + 1],
}

impl HalfSums {
    /// The sums of one half of a point.
    pub fn of(state: &PointState, half: usize) -> HalfSums {
        HalfSums { rays: state.rays[half], visible: state.visible[half] }
    }

    /// Adds all terms; of the largest rays the maximum.
    pub fn add(&mut self, other: HalfSums) {
        let largest = self.rays.largest.max(other.rays.largest);
        let near_largest = self.rays.near_largest.max(other.rays.near_largest);
        let terms = bytemuck::cast_slice::<HalfSums, f32>(std::slice::from_ref(&other));
        let sums = bytemuck::cast_slice_mut::<HalfSums, f32>(std::slice::from_mut(self));
        sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
        (self.rays.largest, self.rays.near_largest) = (largest, near_largest);
    }
}

/// Range of rays of a pass over a point in `state` that has cast `total` of them before: in the
/// first pass all of them, in two halves; then the same number again, as the second half. Start,
/// start of the second half, and end.
pub fn range(total: u32, state: &PointState, settings: &GatherSettings) -> [u32; 3] {
    let [start, middle, end] =
        if state.pending == 3 { [0, total / 2, total] } else { [total, total, 2 * total] };
    let from = start + settings.first;
    [from, middle, (from + settings.pass_rays).min(end)]
}

/// The state of a point after one pass: `ray` gives what each ray adds, by its number and half.
pub fn cast_rays(
    total: u32,
    state: &PointState,
    settings: &GatherSettings,
    ray: impl Fn(u32, usize) -> HalfSums,
) -> PointState {
    let [from, middle, to] = range(total, state, settings);
    let mut lanes = [[HalfSums::default(); LANES as usize]; 2];
    for k in from..to {
        let half = usize::from(k >= middle);
        lanes[half][((k - from) % LANES) as usize].add(ray(k, half));
    }
    let mut after = *state;
    for (half, lanes) in lanes.into_iter().enumerate() {
        let mut sums = HalfSums::of(state, half);
        sums.add(added_up(lanes, HalfSums::add));
        (after.rays[half], after.visible[half]) = (sums.rays, sums.visible);
    }
    after
}

/// The sum over all lanes, in the order of the shader.
pub fn added_up<T: Copy>(mut lanes: [T; LANES as usize], add: impl Fn(&mut T, T)) -> T {
    let mut step = lanes.len() / 2;
    while step > 0 {
        for lane in 0..step {
            let other = lanes[lane + step];
            add(&mut lanes[lane], other);
        }
        step /= 2;
    }
    lanes[0]
}
