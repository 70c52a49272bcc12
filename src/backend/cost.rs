//! Cost of a row by hemicubes and by rays, for the choice of a bake.
//!
//! ```text
//! hemicube               hemicube + triangle · T + pixel · 3 N²      T triangles, N pixels an edge
//! N² rays on the device  device_row + device_ray_level · (1 + log₂ T) · N² · RAYS_AT_EQUAL_ERROR
//! N² rays on the CPU     ray_level · (1 + log₂ T) · N² · RAYS_AT_EQUAL_ERROR
//! ```
//!
//! A device processes all triangles in its vertex stage, however few the pixels; a ray descends one
//! more level of a tree with twice the triangles. So hemicubes are for many pixels and few
//! triangles. No clock is read: the choice is the same on every run.
//!
//! `RADIOSITY_BENCH=full cargo bench --bench error_model -- rows [SCENE.obj …]` measures the
//! constants by least squares of relative errors.

use super::adapter::AdapterKind;
use super::row_maker::RowMaker;

/// Time of the parts of a row, on the processors of one kind of adapter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowCost {
    /// A hemicube, for any content: five views set up, a row reduced and read back; s.
    pub hemicube: f64,
    /// A triangle of the scene, on those of the five faces that may see it; s.
    pub triangle: f64,
    /// A pixel, drawn and reduced; s.
    pub pixel: f64,
    /// A row by rays on the device, for any number of rays; s.
    pub device_row: f64,
    /// A ray on the device, on each level of a binary tree of the triangles; s.
    pub device_ray_level: f64,
    /// A ray on the CPU, on each level of that tree; s.
    pub ray_level: f64,
}

/// Number of rays of a row with the error of a hemicube, over N²: 1.3 to 2.0 in the Cornell box, a
/// furnished room and a hall, at 16 to 128 pixels; their geometric mean.
pub const RAYS_AT_EQUAL_ERROR: f64 = 1.7;

/// Minimum number of triangles in the cost of rays on a device: an H200 takes 1.0 ns per ray (38
/// triangles) to 1.2 ns (4 010).
pub const MIN_DEVICE_TRIANGLES: usize = 8192;

impl RowCost {
    /// The cost for an adapter of `kind`; that of the fastest for unknown kinds.
    pub fn of(kind: AdapterKind) -> RowCost {
        // Lavapipe (Mesa 22.3) on two cores of an AMD EPYC server: the Cornell box, each triangle
        // cut into 1 to 4096, at 16 to 256 pixels. The error of hemicubes is up to a half, that of
        // rays up to a factor of two. Rays on it: `docs/data/device.tsv`.
        let software = RowCost {
            hemicube: 1.8e-4,
            triangle: 1.3e-7,
            pixel: 5.8e-9,
            device_row: 1e-3,
            device_ray_level: 3.5e-7,
            ray_level: 8.5e-9,
        };
        // NVIDIA H200 (Vulkan, driver 580) beside 16 cores: rooms of 38 and 4 010 triangles, 64 to
        // 256 pixels (`docs/data/device.tsv`). The error of hemicubes is a tenth, that of rays on
        // the device a third.
        let discrete = RowCost {
            hemicube: 7.9e-5,
            triangle: 1.4e-8,
            pixel: 3.9e-10,
            device_row: 6e-6,
            device_ray_level: 8e-11,
            ray_level: 2.5e-9,
        };
        match kind {
            AdapterKind::Cpu => software,
            AdapterKind::DiscreteGpu | AdapterKind::VirtualGpu | AdapterKind::Other => discrete,
            // Not measured: an eighth of the other's rays, a tenth of its pixels, and two cores.
            AdapterKind::IntegratedGpu => RowCost {
                pixel: 3.9e-9,
                device_row: 1e-5,
                device_ray_level: 6.4e-10,
                ray_level: software.ray_level,
                ..discrete
            },
        }
    }

    /// Seconds of a hemicube with `resolution` pixels along an edge of its top face, in a scene of
    /// `triangles` triangles.
    pub fn hemicube_seconds(&self, triangles: usize, resolution: u32) -> f64 {
        let pixels = 3.0 * f64::from(resolution).powi(2);
        self.hemicube + self.triangle * triangles as f64 + self.pixel * pixels
    }

    /// Seconds of `rays` rays.
    pub fn ray_seconds(&self, triangles: usize, rays: f64) -> f64 {
        self.ray_level * tree_levels(triangles) * rays
    }

    /// Seconds of a row of `rays` rays on the device.
    pub fn device_ray_seconds(&self, triangles: usize, rays: f64) -> f64 {
        let levels = tree_levels(triangles.max(MIN_DEVICE_TRIANGLES));
        self.device_row + self.device_ray_level * levels * rays
    }

    /// The one of `makers` that makes a row in the least time, with the error of a hemicube of
    /// `resolution`.
    pub fn cheapest(
        &self,
        makers: impl IntoIterator<Item = RowMaker>,
        triangles: usize,
        resolution: u32,
    ) -> Option<RowMaker> {
        // For smaller scenes, the cost of rays grows faster with the number of triangles than that
        // of hemicubes, and adding triangles could favour hemicubes again.
        let triangles = triangles.max(512);
        let rays = RAYS_AT_EQUAL_ERROR * f64::from(resolution).powi(2);
        let seconds = |maker: &RowMaker| match maker {
            RowMaker::Hemicubes => self.hemicube_seconds(triangles, resolution),
            RowMaker::DeviceRays => self.device_ray_seconds(triangles, rays),
            RowMaker::Rays => self.ray_seconds(triangles, rays),
        };
        makers.into_iter().min_by(|a, b| seconds(a).total_cmp(&seconds(b)))
    }
}

/// Levels of a binary tree with this number of leaves: 1 + log₂ of their number, linear between
/// powers of two. Sums and products have the same bits on all machines, logarithms may not.
pub fn tree_levels(leaves: usize) -> f64 {
    let leaves = leaves.max(1);
    let doublings = leaves.ilog2();
    f64::from(doublings) + leaves as f64 / (1u64 << doublings) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const KINDS: [AdapterKind; 5] = [
        AdapterKind::DiscreteGpu,
        AdapterKind::IntegratedGpu,
        AdapterKind::VirtualGpu,
        AdapterKind::Other,
        AdapterKind::Cpu,
    ];

    fn cheapest(kind: AdapterKind, triangles: usize, resolution: u32) -> RowMaker {
        let makers = [RowMaker::Hemicubes, RowMaker::DeviceRays, RowMaker::Rays];
        RowCost::of(kind).cheapest(makers, triangles, resolution).unwrap()
    }

    #[test]
    fn software_draws_few_triangles_at_many_pixels_and_casts_otherwise() {
        let cheapest = |triangles, resolution| cheapest(AdapterKind::Cpu, triangles, resolution);
        for resolution in [64, 128, 256] {
            assert_eq!(cheapest(32, resolution), RowMaker::Hemicubes, "{resolution}");
        }
        for resolution in [16, 32, 64] {
            assert_eq!(cheapest(128_000, resolution), RowMaker::Rays, "{resolution}");
        }
        assert_eq!(cheapest(4000, 32), RowMaker::Rays);
        assert_eq!(cheapest(4000, 256), RowMaker::Hemicubes);
    }

    #[test]
    fn hardware_casts_rays_where_there_are_many_triangles() {
        for kind in KINDS.into_iter().filter(|&kind| kind != AdapterKind::Cpu) {
            for resolution in [32, 64, 128, 256] {
                assert_eq!(cheapest(kind, 128_000, resolution), RowMaker::DeviceRays, "{kind}");
            }
        }
        // Without rays on the device, hemicubes are drawn as long as triangles are few.
        let discrete = RowCost::of(AdapterKind::DiscreteGpu);
        let others = [RowMaker::Hemicubes, RowMaker::Rays];
        assert_eq!(discrete.cheapest(others, 4000, 64), Some(RowMaker::Hemicubes));
        assert_eq!(discrete.cheapest(others, 100_000_000, 32), Some(RowMaker::Rays));
        assert_eq!(discrete.cheapest([], 4000, 64), None);
    }

    #[test]
    fn more_triangles_never_bring_hemicubes_back_nor_more_pixels_rays() {
        let casts = |kind, triangles, resolution| {
            cheapest(kind, triangles, resolution) != RowMaker::Hemicubes
        };
        let counts = |k: u32| (1.15f64.powi(k as i32)) as usize;
        for kind in KINDS {
            for resolution in (16..=512).step_by(2) {
                let by_triangles: Vec<bool> =
                    (0..150).map(|k| casts(kind, counts(k), resolution)).collect();
                assert!(by_triangles.is_sorted(), "{kind}, {resolution}: {by_triangles:?}");
            }
            for k in 0..150 {
                let by_pixels = (8..=256).map(|half| casts(kind, counts(k), 2 * half));
                assert!(by_pixels.rev().is_sorted(), "{kind}, {} triangles", counts(k));
            }
        }
    }

    #[test]
    fn levels_are_those_of_powers_of_two_and_lines_between_them() {
        let found = [0, 1, 2, 3, 4, 6, 8, 1 << 20].map(tree_levels);
        assert_eq!(found, [1.0, 1.0, 2.0, 2.5, 3.0, 3.5, 4.0, 21.0]);
    }
}
