//! What texels gather.

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::Arc;

use glam::DVec3;
use radiosity::backend::cpu::RayGather;
use radiosity::gather::{GatherPoint, IrradianceSample, RadiosityField};
use radiosity::light_map::{Atlas, Coordinates, LightMap, Resolution};
use radiosity::scene::Sides;
use radiosity::{
    Error, ErrorKind, Gather, GatheredMesh, Material, Mesh, Rgb, Scene, SceneSettings, Triangle,
};

use crate::common::scenes::{facing_down, facing_up, grey, lamp, standing_block, walls};
use crate::common::{cornell_box, keep_counting, quads};

/// The light of `scene` whose elements all have this radiosity beside what they emit.
fn light(scene: &Arc<Scene>, reflected: f64) -> GatheredMesh {
    let mesh = Mesh::new(scene.clone(), f64::INFINITY).unwrap();
    let radiosity: Vec<Rgb> =
        (0..mesh.element_count()).map(|e| mesh.exitance(e) + reflected).collect();
    GatheredMesh::from_elements(&mesh, &radiosity).unwrap()
}

fn gathered(atlas: Atlas, light: &GatheredMesh, rays: u32) -> LightMap {
    let mut rays = RayGather::new(&light.mesh, rays).unwrap();
    LightMap::gather(atlas, light, &mut rays, keep_counting).unwrap().unwrap()
}

/// In a closed room that has the same radiosity everywhere, so has every point of a map: also at
/// edges and corners, and under a block, where nothing gathers. The block's sides and top count.
#[test]
fn furnace_shows_its_radiosity_at_every_point() {
    let block = standing_block([0.3, 0.61], [0.22, 0.5], 0.0, 0.4);
    let all = walls([0.0; 3], [1.0; 3]).into_iter().chain(block);
    let scene = Arc::new(quads(&all.map(|quad| (quad, grey())).collect::<Vec<_>>()));
    let resolution = Resolution::TexelSize(0.037);
    let atlas = Atlas::new(scene.clone(), resolution, Coordinates::Unwrapped).unwrap();
    let map = gathered(atlas, &light(&scene, 2.0), 16);
    let close = |e: Rgb| e.distance(Rgb::splat(2.0)) < 1e-12;
    const STEPS: u32 = 60;
    for t in 0..scene.triangles().len() {
        for i in 0..=STEPS {
            for j in 0..=STEPS - i {
                let weights = [i, j].map(|k| f64::from(k) / f64::from(STEPS));
                let found = map.irradiance_at(t, weights);
                assert!(close(found), "triangle {t} at {weights:?}: {found}");
            }
        }
    }
    // Every texel has the light or none: two rings around those that are covered.
    assert!(map.irradiance.iter().all(|&e| e == Rgb::ZERO || close(e)));
    let lit = map.irradiance.iter().filter(|&&e| e != Rgb::ZERO).count();
    let count = map.gathered.iter().filter(|&&gathered| gathered).count();
    let covered = (map.coverage() * map.gathered.len() as f64).round() as usize;
    // Some 8 × 8 texels lie under the block.
    assert!((30..100).contains(&(covered - count)), "{covered} {count}");
    let width = map.atlas.width() as usize;
    let near = |k: usize, reach: usize| {
        let (x, y) = (k % width, k / width);
        let rows = y.saturating_sub(reach)..(y + reach + 1).min(map.atlas.height() as usize);
        rows.flat_map(move |y| {
            (x.saturating_sub(reach)..(x + reach + 1).min(width)).map(move |x| [x, y])
        })
        .any(|[x, y]| map.gathered[y * width + x])
    };
    let filled = (0..map.gathered.len()).filter(|&k| near(k, 2)).count();
    assert!(lit >= filled && lit - filled < 100, "{lit} {filled}");
    // Radiosity is half of that where walls reflect a half, on the same texels.
    let radiosity = map.radiosity();
    let same = map.irradiance.iter().zip(&radiosity);
    assert!(same.into_iter().all(|(e, b)| e.distance(2.0 * *b) < 1e-12));
}

/// Form factor from a point to a rectangle parallel to it whose corners are `x` and `y` away along
/// its sides, at height `h` (Howell 2010, "A Catalog of Radiation Heat Transfer Configuration
/// Factors", B-3).
fn to_rectangle([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], h: f64) -> f64 {
    let corner = |x: f64, y: f64| {
        let (x, y) = (x / h, y / h);
        let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
        (x / p * (y / p).atan() + y / q * (x / q).atan()) / (2.0 * PI)
    };
    corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0)
}

/// A floor of 2 × 1 on the lower left of the texture, below a small lamp in a corner: every texel
/// has the light of the point that its centre shows.
#[test]
fn texels_have_the_light_of_their_places() {
    let text = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nv 1.5 0.6 0.5\nv 1.5 0.9 0.5\nv 1.9 0.9 0.5\n\
        v 1.9 0.6 0.5\nvt 0 0\nvt 0.8 0\nvt 0.8 0.4\nvt 0 0.4\nvt 0.8 0.8\nvt 0.8 0.9\nvt 0.9 0.9\n\
        vt 0.9 0.8\nusemtl floor\nf 1/1 2/2 3/3 4/4\nusemtl lamp\nf 5/5 6/6 7/7 8/8\n";
    let mut settings = SceneSettings::default();
    settings.texture_coordinates = true;
    settings.sides = Sides::Front;
    settings.emit.push(("lamp".into(), Rgb::new(1.0, 2.0, 3.0)));
    let scene = Arc::new(settings.read("a.obj", text.as_bytes(), &[]).unwrap());
    let atlas = Atlas::new(scene.clone(), Resolution::Pixels(50), Coordinates::Given).unwrap();
    let map = gathered(atlas, &light(&scene, 0.0), 64);
    for (k, &found) in map.irradiance.iter().enumerate() {
        // The floor is 40 texels wide and ends 30 rows from the top.
        let (column, row) = (k % 50, k / 50);
        if column >= 40 || row < 30 {
            continue;
        }
        assert!(map.gathered[k]);
        let x = (column as f64 + 0.5) / 20.0;
        let y = (49.5 - row as f64) / 20.0;
        let factor = to_rectangle([1.5 - x, 1.9 - x], [0.6 - y, 0.9 - y], 0.5);
        let wanted = PI * Rgb::new(1.0, 2.0, 3.0) * factor;
        // Points lie 1e-4 texels, 5e-6, above the floor, of half a unit: some 1e-5 of four times
        // that, by the fourth power of the height.
        assert!(
            found.distance(wanted) < 1e-4 * wanted.length(),
            "{column} {row}: {found} {wanted}"
        );
    }
}

/// A plate with a lamp above it: its two sides have texels of their own.
#[test]
fn each_side_of_a_plate_has_its_own_light() {
    let both = Material { sides: Sides::Both, ..grey() };
    let plate = (facing_up([0.0, 1.0], [0.0, 1.0], 0.0), both);
    let above = (facing_down([0.2, 0.8], [0.2, 0.8], 0.7), lamp([1.0; 3]));
    let scene = Arc::new(quads(&[plate, above]).resolve_sides());
    assert_eq!(scene.triangles().len(), 6);
    let atlas = Atlas::new(scene.clone(), Resolution::Pixels(64), Coordinates::Auto).unwrap();
    let map = gathered(atlas, &light(&scene, 0.0), 64);
    for t in 0..6 {
        let found = map.irradiance_at(t, [1.0 / 3.0; 2]).x;
        let is_upper = scene.material(t).exitance == Rgb::ZERO && scene.normal(t) == DVec3::Z;
        assert_eq!(found > 0.1, is_upper, "triangle {t}: {found}");
        assert_eq!(found == 0.0, !is_upper, "triangle {t}: {found}");
    }
}

/// Light that is noise, even from 0.5 to 1.5, by the bits of a point's position.
struct Noise;

impl Gather for Noise {
    fn gather(
        &mut self,
        _: &RadiosityField,
        points: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error> {
        let sample = |point: &GatherPoint| {
            let bits = point.position.to_array().map(f64::to_bits);
            let seed = bits.iter().fold(0, |seed: u64, bits| seed.rotate_left(21) ^ bits);
            let irradiance = Rgb::splat(0.5 + fastrand::Rng::with_seed(seed).f64());
            IrradianceSample { irradiance, ..IrradianceSample::default() }
        };
        Ok(points.iter().map(sample).collect())
    }
}

/// A tube of sixteen sides that is smooth all around, so that its charts meet somewhere: texels on
/// either side of a cut found another light, and what is shown is the same.
#[test]
fn charts_of_a_smooth_surface_meet_without_a_seam() {
    const SIDES: u32 = 16;
    let point = |k: u32, z: f64| {
        let angle = 2.0 * PI * f64::from(k) / f64::from(SIDES);
        DVec3::new(angle.cos(), angle.sin(), z)
    };
    let positions = (0..SIDES).flat_map(|k| [point(k, 0.0), point(k, 2.0)]).collect();
    let side = |k: u32| {
        let [a, b] = [2 * k, 2 * ((k + 1) % SIDES)];
        [[a, b, b + 1], [a, b + 1, a + 1]]
    };
    let tube = |corners| Triangle { corners, group: 0, material: 0, smoothing: Some(1) };
    let triangles = (0..SIDES).flat_map(side).map(tube).collect();
    let scene = Scene::new(positions, triangles, vec!["tube".into()], vec![grey()]).unwrap();
    let scene = Arc::new(scene);
    let resolution = Resolution::TexelSize(0.05);
    let atlas = Atlas::new(scene.clone(), resolution, Coordinates::Unwrapped).unwrap();
    let map = LightMap::gather(atlas, &light(&scene, 0.0), &mut Noise, keep_counting);
    let map = map.unwrap().unwrap();
    let (mut squares, mut count, mut cuts) = (0.0, 0.0, 0);
    for k in 0..SIDES as usize {
        // Triangle 2 k has a side from corner 1 to 2, and 2 k + 3 the same from corner 0 to 2.
        let next = (2 * k + 3) % (2 * SIDES as usize);
        let [a, b] = [map.atlas.coordinates(2 * k)[1], map.atlas.coordinates(next)[0]];
        if a.distance(b) < 1e-3 {
            continue;
        }
        cuts += 1;
        for i in 0..=200 {
            let share = f64::from(i) / 200.0;
            let one = map.irradiance_at(2 * k, [1.0 - share, share]);
            let other = map.irradiance_at(next, [0.0, share]);
            squares += (one.x - other.x).powi(2);
            count += 1.0;
        }
    }
    assert!(cuts > 0, "the tube is cut somewhere");
    // Noise even in ±0.5 has a mean square of 1/12. Of four texels, that is 4/9 on average: the
    // sides differ by √(2 · 4/9 / 12) = 0.27. Of that, a fifth is left: what is at the ends of
    // cuts, and what texels that do not lie side by side cannot both show.
    let left: f64 = (squares / count).sqrt();
    assert!(left < 0.27 / 5.0, "{left}");
}

#[test]
fn the_same_light_gives_the_same_bits_and_can_be_stopped() {
    let scene = Arc::new(cornell_box(f64::INFINITY).scene().resolve_sides());
    let atlas = Atlas::new(scene.clone(), Resolution::Pixels(64), Coordinates::Auto).unwrap();
    let light = light(&scene, 1.0);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| gathered(atlas.clone(), &light, 16))
    };
    let (one, two) = (run(1), run(2));
    assert!(one.irradiance == two.irradiance && one.gathered == two.gathered);
    let mut rays = RayGather::new(&light.mesh, 16).unwrap();
    let stop = |_, _| ControlFlow::Break(());
    assert!(LightMap::gather(atlas.clone(), &light, &mut rays, stop).unwrap().is_none());
    let other = Arc::new(quads(&[(facing_up([0.0, 1.0], [0.0, 1.0], 0.0), grey())]));
    let other = self::light(&other, 1.0);
    let e = LightMap::gather(atlas, &other, &mut rays, keep_counting).unwrap_err();
    assert!(e.kind() == ErrorKind::Setting && e.to_string().contains("another scene"), "{e}");
}
