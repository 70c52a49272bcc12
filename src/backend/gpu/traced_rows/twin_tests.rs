//! `row_rays.wgsl` and `compact_rows.wgsl` against their twins; and the same bits for any division
//! of patches into calls.

use glam::{DVec3, Vec3};
use rustc_hash::FxHashSet;

use super::*;
use crate::backend::cpu::twins::compact_rows::compact_rows;
use crate::backend::cpu::twins::ray_arrays::RayArrays;
use crate::backend::cpu::twins::row_rays::amount;
use crate::backend::cpu::twins::shift::Shift;
use crate::backend::cpu::twins::trace::turned;
use crate::backend::gpu::layout::{NOTHING, ROW_ENTRIES_HEADER_BYTES, TEXELS_PER_LINE};
use crate::backend::gpu::test_support::{
    gpu, on_sides, read_buffer, room_with_doubled_leaf, traced_scenes,
};
use crate::backend::gpu::traced_scene::TracedArrays;
use crate::sampling::hash::split_mix64_nth;

/// Rows with counts that the tests can read and write.
fn open_rows(gpu: &Gpu, mesh: &Mesh, rays: u32) -> TracedRows {
    use wgpu::BufferUsages as Usage;
    let mut rows = TracedRows::new(gpu, mesh, rays).unwrap();
    let usage = Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST;
    let bytes = u64::from(CompactedRows::MAX_BATCH * rows.slots.max(1024)) * 16;
    rows.buffers.counts = gpu.memory().buffer("test", bytes, usage).unwrap();
    rows
}

impl TracedRows {
    fn settings(&self, rays: u32) -> RowSettings {
        let unit = passed_unit(rays.max(1)) as f32;
        RowSettings { rays, slots: self.slots, unit, entries: self.buffers.compacted.entries }
    }
}

fn sorted(mut entries: Vec<RowEntry>) -> Vec<RowEntry> {
    entries.sort_unstable_by_key(|e| (e.patch_, e.slot));
    entries
}

/// Patches of several sizes on triangles all over the mesh.
fn patches(mesh: &Mesh) -> Vec<NodeId> {
    let elements = (0..6).map(|k| mesh.element(k * mesh.element_count() / 6));
    elements.chain([mesh.root(0)]).collect()
}

/// The number of hits of each slot is that of the twin, except for rays that rounding may deflect;
/// and the sum of transmittances is its sum, up to one unit per ray.
#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn row_rays_equal_their_twin() {
    let gpu = gpu();
    let (mut open, mut back, mut dimmed) = (0, 0, 0);
    for (name, mesh) in traced_scenes() {
        // Some lanes idle; directions in two lines of their texture.
        let count = TEXELS_PER_LINE + 500;
        let mut rows = open_rows(&gpu, &mesh, count);
        let lights = Lights::new(mesh.shared_scene());
        let (arrays, quadtrees) = (TracedArrays::new(&lights), quadtrees(&mesh));
        let directions = local_directions(&HemisphereSamples::new(count).unwrap());
        let twin = RayArrays {
            scene: &arrays,
            quadtrees: &quadtrees,
            elements: &[],
            directions: &directions,
        };
        let mut traced: Vec<TracedPatch> =
            patches(&mesh).iter().map(|&patch| rows.traced_patch(&mesh, patch)).collect();
        traced.push(above_own_triangle(&twin, traced[0], count));
        let settings = rows.settings(count);
        let entries = rows.entries(&traced, settings, 0, <[_]>::to_vec).unwrap().unwrap();
        let slots = settings.slots as usize;
        for (k, patch) in (0..).zip(&traced) {
            let what = format!("{name}, patch {k}");
            let expected = twin.row_rays(patch, &settings);
            let channels = expected.len() / slots;
            let mut actual = vec![0; expected.len()];
            for entry in entries.iter().filter(|entry| entry.patch_ == k) {
                actual[entry.slot as usize] = entry.count;
                for channel in 1..channels {
                    actual[channel * slots + entry.slot as usize] = entry.passed[channel - 1];
                }
            }
            assert_eq!(actual[..slots].iter().sum::<u32>(), count, "{what}");
            check_counts(&what, &twin, patch, &settings, &actual);
            (open, back) = (open + actual[OPEN as usize], back + actual[BACK as usize]);
            dimmed += (0..slots * usize::from(channels > 1))
                .filter(|&k| actual[slots + k] > 0 && actual[slots + k] != actual[2 * slots + k])
                .count();
        }
        // Counts are zero for the next batch.
        let counts: Vec<u32> = read_buffer(&gpu, &rows.buffers.counts);
        assert!(counts.iter().all(|&count| count == 0), "{name}");
    }
    println!("{open} rays hit nothing, {back} backs; {dimmed} slots lie behind coloured glass");
    assert!(open > 0 && back > 0 && dimmed > 0);
}

/// A patch slightly above another, whose own triangle, which no ray hits, is the first in front of
/// it.
fn above_own_triangle(twin: &RayArrays, patch: TracedPatch, rays: u32) -> TracedPatch {
    let direction = |k: u32| twin.direction(k, patch.normal, patch.rotation);
    let hit = |k: u32| twin.intersect(&patch, direction(k)).1.triangle;
    let first = (0..rays).map(hit).find(|&triangle| triangle != NOTHING).unwrap();
    let own_triangle = twin.scene.triangles[first as usize].index;
    let lifted = Vec3::from(patch.position) + 1e-3 * Vec3::from(patch.normal);
    TracedPatch { position: lifted.to_array(), own_triangle, ..patch }
}

/// Checks that counts and sums of transmittances are those of the twin's rays, shifted or not.
fn check_counts(
    what: &str,
    twin: &RayArrays,
    patch: &TracedPatch,
    settings: &RowSettings,
    actual: &[u32],
) {
    let slots = settings.slots as usize;
    let (mut low, mut high) = (vec![0; actual.len()], vec![0; actual.len()]);
    let mut unsure = 0;
    let shifts = Shift::all();
    for ray in 0..settings.rays {
        let direction = twin.direction(ray, patch.normal, patch.rotation);
        let possible = |shift: &Shift| {
            let position_low = (Vec3::from(patch.position_low) + shift.origin).to_array();
            let patch = TracedPatch { position_low, ..*patch };
            twin.cast_ray(&patch, shift.direction(direction))
        };
        let mut results: Vec<(u32, Vec3)> = shifts.iter().map(possible).collect();
        results.sort_by_key(|&(slot, _)| slot);
        let is_sure = results[0].0 == results[results.len() - 1].0;
        unsure += u32::from(!is_sure);
        for at_slot in results.chunk_by(|a, b| a.0 == b.0) {
            let slot = at_slot[0].0 as usize;
            let shares = at_slot.iter().map(|&(_, share)| share);
            let max = shares.clone().fold(Vec3::ZERO, Vec3::max);
            let min = shares.fold(Vec3::ONE, Vec3::min);
            high[slot] += 1;
            low[slot] += u32::from(is_sure);
            for channel in 1..actual.len() / slots {
                let at = channel * slots + slot;
                high[at] += amount(max[channel - 1], settings) + 1;
                let min = amount(min[channel - 1], settings).saturating_sub(1);
                low[at] += if is_sure { min } else { 0 };
            }
        }
    }
    for (k, &n) in actual.iter().enumerate() {
        let (slot, row, low, high) = (k % slots, k / slots, low[k], high[k]);
        let is_possible = (low..=high).contains(&n);
        assert!(is_possible, "{what}, slot {slot} of row {row}: {n}, not {low} to {high}");
    }
    // Some hundred sides of triangles and elements, a radian long each, are within 2⁻²⁰ of 2e-4 of
    // all rays.
    assert!(unsure * 200 < settings.rays, "{what}: {unsure} rays are unsure");
}

/// No ray passes through a side that two triangles share: in a closed room every ray has a hit,
/// though all are cast to sides.
#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn no_ray_goes_through_a_shared_side() {
    let (gpu, mesh) = (gpu(), room_with_doubled_leaf());
    let (arrays, quadtrees) =
        (TracedArrays::new(&Lights::new(mesh.shared_scene())), quadtrees(&mesh));
    let mut cast = 0;
    for patch in patches(&mesh) {
        let from = mesh.viewpoint(patch);
        let mut rows = open_rows(&gpu, &mesh, 64);
        let traced = rows.traced_patch(&mesh, patch);
        // Along the tangents and the normal that the device computes from these.
        let [x, y, z] =
            [Vec3::X, Vec3::Y, Vec3::Z].map(|v| turned(v, traced.normal.into(), traced.rotation));
        let local = |to: DVec3| {
            let d = to.normalize().as_vec3();
            [d.dot(x), d.dot(y), d.dot(z), 0.0]
        };
        let directions: Vec<[f32; 4]> = on_sides(&mesh, 40)
            .into_iter()
            .map(|side| local(side - from))
            .filter(|direction| direction[2] > 0.01)
            .collect();
        let count = directions.len() as u32;
        rows.directions = vec![(count, gpu.memory().lines("directions", &directions).unwrap())];
        let settings = rows.settings(count);
        let entries = rows.entries(&[traced], settings, 0, <[_]>::to_vec).unwrap().unwrap();
        assert_eq!(entries.iter().map(|entry| entry.count).sum::<u32>(), count);
        let open = entries.iter().find(|entry| entry.slot == OPEN);
        assert!(open.is_none(), "{patch:?}: {open:?} of {count}");
        let twin = RayArrays {
            scene: &arrays,
            quadtrees: &quadtrees,
            elements: &[],
            directions: &directions,
        };
        assert_eq!(twin.row_rays(&traced, &settings)[OPEN as usize], 0, "{patch:?}");
        cast += count;
    }
    assert!(cast > 5000, "{cast}");
}

/// Entries are exactly the slots that are not 0, and these are reset to 0; beyond the capacity no
/// entry is written, but all are counted.
#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn compact_rows_equals_its_twin() {
    let gpu = gpu();
    for (name, mesh) in traced_scenes() {
        let mut rows = open_rows(&gpu, &mesh, 1000);
        // The number of slots of the mesh, one for each lane, and several for almost all lanes.
        for slots in [rows.slots, 256, 1001] {
            compare_entries(&format!("{name}, {slots} slots"), &gpu, &mut rows, slots);
        }
    }
}

fn compare_entries(what: &str, gpu: &Gpu, rows: &mut TracedRows, slot_count: u32) {
    let patches: Vec<TracedPatch> = vec![Default::default(); 40];
    let counts = random_counts(patches.len(), slot_count as usize, rows.has_panes);
    let on_device = rows.buffers.counts.clone();
    let write = || gpu.queue.write_buffer(&on_device, 0, bytemuck::cast_slice(&counts));
    write();
    // No ray is cast.
    let settings = RowSettings { slots: slot_count, ..rows.settings(0) };
    let actual = rows.entries(&patches, settings, 0, <[_]>::to_vec).unwrap().unwrap();
    // Rows come in any order, the entries of each in the order of slots.
    let in_rows = actual.chunk_by(|a, b| a.patch_ == b.patch_);
    assert_eq!(in_rows.clone().count(), patches.len(), "{what}");
    assert!(in_rows.into_iter().all(|row| row.is_sorted_by_key(|e| e.slot)), "{what}");
    let mut left = counts.clone();
    let expected = compact_rows(&mut left, &settings, rows.has_panes);
    assert!(expected.len() > 2 * patches.len());
    assert!(words(&sorted(actual)) == words(&sorted(expected.clone())), "{what}");
    let on_device = || read_buffer::<u32>(gpu, &on_device);
    assert!(on_device()[..left.len()] == left && left.iter().all(|&n| n == 0), "{what}");

    // Capacity for two thirds of them; the memory beyond keeps its zeros.
    let room = expected.len() * 2 / 3;
    let nothing = vec![0; size_of_val(&expected[..])];
    gpu.queue.write_buffer(&rows.buffers.compacted.list, ROW_ENTRIES_HEADER_BYTES, &nothing);
    write();
    let settings = RowSettings { entries: room as u32, ..settings };
    assert!(rows.entries(&patches, settings, 0, |_| ()).unwrap().is_none(), "{what}");
    let actual: Vec<u32> = read_buffer(gpu, &rows.buffers.compacted.list);
    assert_eq!(actual[0] as usize, expected.len(), "{what}");
    let actual: &[RowEntry] =
        bytemuck::cast_slice(&actual[ROW_ENTRIES_HEADER_BYTES as usize / 4..]);
    let (written, beyond) = actual[..expected.len()].split_at(room);
    let expected: FxHashSet<[u32; 8]> = expected.iter().map(|e| bytemuck::cast(*e)).collect();
    let is_expected = |e: &RowEntry| expected.contains::<[u32; 8]>(&bytemuck::cast(*e));
    assert!(written.iter().all(is_expected), "{what}");
    assert!(words(beyond).iter().all(|&n| n == 0), "{what}: beyond its end");
    assert!(on_device().iter().all(|&n| n == 0), "{what}");
}

/// Random counts in a third of the slots of each row, including the first and the last; sums of
/// transmittances where there are rays.
fn random_counts(rows: usize, slots: usize, has_panes: bool) -> Vec<u32> {
    let random = |k: usize| split_mix64_nth(k as u64) as u32;
    let mut counts = vec![];
    for row in 0..rows {
        let first = row * slots;
        let count = |slot: usize| match slot == 0 || slot == slots - 1 {
            false if !random(first + slot).is_multiple_of(3) => 0,
            _ => random(first + slot + 1).max(1),
        };
        let rays: Vec<u32> = (0..slots).map(count).collect();
        counts.extend(&rays);
        for channel in 1..if has_panes { 4 } else { 1 } {
            let passed = |(slot, &rays): (usize, &u32)| match rays {
                0 => 0,
                _ => random((channel * rows + row) * slots + slot),
            };
            counts.extend(rays.iter().enumerate().map(passed));
        }
    }
    counts
}

fn words(entries: &[RowEntry]) -> &[u32] {
    bytemuck::cast_slice(entries)
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn rows_have_the_same_bits_in_any_batches() {
    let gpu = gpu();
    for (name, mesh) in traced_scenes() {
        let mut rows = TracedRows::new(&gpu, &mesh, 1000).unwrap();
        let patches: Vec<NodeId> = (0..mesh.element_count()).map(|e| mesh.element(e)).collect();
        let all = rows.rows(&mesh, &patches, 1.0).unwrap();
        assert!(rows.rows(&mesh, &patches, 1.0).unwrap() == all, "{name}: again");
        for k in (0..patches.len()).step_by(7) {
            let alone = rows.rows(&mesh, &patches[k..=k], 1.0).unwrap();
            assert!(alone == all[k..=k], "{name}: patch {k} alone");
        }
        // Batches that exceed the capacity are made in two.
        rows.buffers.compacted.entries = mesh.element_count() as u32 + FIRST_FRONT;
        assert!(rows.rows(&mesh, &patches, 1.0).unwrap() == all, "{name}: in halves");
        rows.buffers.patches_at_once = 3;
        assert!(rows.rows(&mesh, &patches, 1.0).unwrap() == all, "{name}: three at once");
    }
}
