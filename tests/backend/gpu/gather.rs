//! Gathering with rays on the device: against closed forms, against rays on the CPU, and against
//! itself.

use glam::DVec3;
use radiosity::backend::gpu::TracedGather;
use radiosity::form_factor::closed_form::point_to_polygon;
use radiosity::gather::{GatherPoint, IrradianceSample, RadiosityField};
use radiosity::scene::SkyDistribution;
use radiosity::{ErrorKind, Gather, Gpu, Material, Mesh, Rgb, Scene, Sky, Sun, Triangle};

use crate::common::device_rays::{ROUNDING, Rays, same_as_on_the_cpu};
use crate::common::fakes::GivenRadiosity;
use crate::common::scenes::{Quad, facing_down, facing_up, grey, lamp};
use crate::common::{cornell_box, cube, gpu, quads};

/// What `places` see of `light` by `n` rays.
fn gather_all(
    light: &GivenRadiosity,
    gpu: &Gpu,
    n: u32,
    places: &[GatherPoint],
) -> Vec<IrradianceSample> {
    let mut gather = TracedGather::new(gpu, &light.mesh, n).unwrap();

    gather.gather(&light.sources(), places).unwrap()
}

/// Exitance of all lamps, W/m².
const LAMP: [f64; 3] = [1.0, 2.0, 3.0];

/// A scene in which nothing reflects light.
fn dark(quad_list: &[(Quad, Material)]) -> GivenRadiosity {
    GivenRadiosity::new(Mesh::new(quads(quad_list), f64::INFINITY).unwrap(), |_, _| Rgb::ZERO)
}

/// A place that looks along `normal`.
fn place(position: [f64; 3], normal: [f64; 3]) -> GatherPoint {
    let (position, normal) = (DVec3::from_array(position), DVec3::from_array(normal));
    GatherPoint { position, normal: normal.normalize(), near: 1e-5 }
}

fn factor(place: &GatherPoint, corners: &[[f64; 3]]) -> f64 {
    let corners: Vec<DVec3> = corners.iter().copied().map(DVec3::from_array).collect();
    point_to_polygon(place.position, place.normal, &corners)
}

/// The Cornell box in elements of unequal depths: every third is split, and every fifth of what
/// comes of it. Values jump from element to element, so that a wrong one is seen.
fn uneven_box() -> GivenRadiosity {
    let mesh = cornell_box(60.0);
    let third: Vec<usize> = (0..mesh.element_count()).step_by(3).collect();
    let mesh = mesh.split(&third).unwrap();
    let fifth: Vec<usize> = (0..mesh.element_count()).step_by(5).collect();
    GivenRadiosity::new(mesh.split(&fifth).unwrap(), |e, p| {
        Rgb::new(1.0 + p.x / 600.0, 1.0 + p.y / 600.0, 1.0 + (e % 7) as f64 / 7.0)
    })
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn device_gathers_as_the_cpu_does() {
    let (gpu, light) = (gpu(), uneven_box());
    let lamp = light.mesh.scene().materials().iter().map(|m| m.exitance.max_element());
    let peak = 3.0 + lamp.fold(0.0, f64::max);
    let points = light.places(200, 0.01);
    for (count, noise) in [(2, f64::INFINITY), (64, f64::INFINITY), (64, 0.02), (8192, 0.02)] {
        let points = if count > 64 { &points[..20] } else { &points };
        same_as_on_the_cpu(
            &gpu,
            &light.sources(),
            points,
            Rays { count, noise, many_lights: false },
            peak,
        );
    }
}

/// Skies and suns, wide lights, many lights, small ones and those of many triangles: as on the CPU.
#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn device_gathers_all_kinds_of_light() {
    let gpu = gpu();
    let clear = SkyDistribution::cie(12).unwrap();
    let (up, towards_sun) = (DVec3::Z, DVec3::new(0.3, 0.2, 0.9));
    let sun = Sun { direction: towards_sun, irradiance: Rgb::new(3.0, 2.0, 1.0) };
    let sky = Sky::new(clear, Rgb::new(0.5, 0.7, 1.0), up, towards_sun).unwrap();
    let sky = sky.with_sun(sun).unwrap();
    let floor = facing_up([-2.0, 2.0], [-2.0, 2.0], 0.0);
    let table = [facing_up([0.2, 0.9], [0.1, 0.8], 0.5), facing_down([0.2, 0.9], [0.1, 0.8], 0.5)];
    let ceiling = facing_down([-2.0, 2.0], [-2.0, 2.0], 2.0);
    let furniture: Vec<(Quad, Material)> =
        [floor, table[0], table[1]].map(|quad| (quad, grey())).into();
    let lamps = |count: i32, size: f64| {
        let at = move |k: i32| [f64::from(k % 5) * 0.7 - 1.5, f64::from(k / 5) * 0.8 - 1.4];
        (0..count)
            .map(at)
            .map(move |[x, y]| (facing_down([x, x + size], [y, y + size], 1.9), lamp(LAMP)))
    };
    let scenes = [
        ("a clear sky with a sun", quads(&furniture).with_sky(sky).unwrap()),
        ("a uniform sky", quads(&furniture).with_sky(Rgb::new(1.0, 0.5, 0.2)).unwrap()),
        ("a ceiling that shines", quads(&[&furniture[..], &[(ceiling, lamp(LAMP))]].concat())),
        (
            "twenty lights",
            quads(&furniture.iter().cloned().chain(lamps(20, 0.3)).collect::<Vec<_>>()),
        ),
        (
            "a tiny light",
            quads(&furniture.iter().cloned().chain(lamps(1, 1e-3)).collect::<Vec<_>>()),
        ),
    ];
    for (name, scene) in scenes {
        println!("{name}");
        let mesh = Mesh::new(scene, 0.5).unwrap();
        let light =
            GivenRadiosity::new(mesh, |e, p| Rgb::splat(0.2 + 0.1 * (e % 3) as f64) + p.x.abs());
        let points = light.places(100, 1e-4);
        for (count, noise) in [(256, f64::INFINITY), (64, 0.01)] {
            let rays = Rays { count, noise, many_lights: name == "twenty lights" };
            same_as_on_the_cpu(&gpu, &light.sources(), &points, rays, 8.0);
        }
    }
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn furnace_irradiance_is_even() {
    let gpu = gpu();
    // One material and shared corners: the walls are one light, which surrounds every place.
    let cube = cube(&Material::grey("furnace", 0.5));
    let mut material = cube.materials()[0].clone();
    material.exitance = Rgb::ONE;
    let one = |t: &Triangle| Triangle { material: 0, ..*t };
    let triangles = cube.triangles().iter().map(one).collect();
    let groups = cube.groups().to_vec();
    let cube = Scene::new(cube.positions().to_vec(), triangles, groups, vec![material]).unwrap();
    let light = GivenRadiosity::new(Mesh::new(cube, 0.2).unwrap(), |_, _| Rgb::ONE);
    for g in gather_all(&light, &gpu, 64, &light.places(50, 1e-4)) {
        assert!((g.irradiance - 2.0).abs().max_element() < ROUNDING, "{g:?}");
        assert_eq!((g.escaped, g.backface), (0.0, 0.0));
    }
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn direct_light_is_the_closed_form() {
    let gpu = gpu();
    // A square overhead under a ceiling, one edge on the horizon's far side, one cut by it.
    let overhead = facing_down([-0.5, 0.5], [-0.5, 0.5], 2.0);
    let ceiling = facing_down([-9.0, 9.0], [-9.0, 9.0], 2.001);
    let wall = [[4.0, -0.5, -0.5], [4.0, -0.5, 0.5], [4.0, 0.5, 0.5], [4.0, 0.5, -0.5]];
    let light = dark(&[(overhead, lamp(LAMP)), (ceiling, grey()), (wall, lamp(LAMP))]);
    let places = [
        place([0.0; 3], [0.0, 0.0, 1.0]),
        place([0.3, 0.2, 1.0], [0.2, 0.1, 1.0]),
        // The wall's lower half is below the horizon.
        place([2.5, 0.1, 0.0], [0.0, 0.0, 1.0]),
        // Grazing: the overhead square is 4 degrees above the horizon, seen at 0.2 over 3 from it.
        place([-2.9, 0.0, 1.8], [0.0, 0.0, 1.0]),
        place([0.0, -3.0, 0.0], [0.0, -1.0, 0.1]),
        // Far off: a square of 1/100.
        place([-90.0, 3.0, -50.0], [1.0, 0.0, 0.5]),
    ];
    for (place, got) in places.iter().zip(gather_all(&light, &gpu, 64, &places)) {
        let factors = [&overhead, &wall].map(|q| factor(place, q));
        // What could give less than 1e-3 of it all is left to the rays over the hemisphere.
        let least = 1e-3 * factors.iter().sum::<f64>();
        let want = lamp(LAMP).exitance * factors.iter().filter(|&&f| f > least).sum::<f64>();
        // Every ray to the light arrives: the closed form as it is, and rays meet what is left.
        let left = lamp(LAMP).exitance * factors.iter().filter(|&&f| f <= least).sum::<f64>();
        let off = (got.direct - want).max_element();
        let a_ray = 3.0 * LAMP[2] / 64.0;
        let most = if left == Rgb::ZERO { 0.0 } else { left.max_element() + a_ray };
        // Where the light grazes the surface, terms of up to a half cancel: some roundings of them.
        let within = ROUNDING * want.max_element() + 2e-7 * LAMP[2];
        assert!(off > -within && off < within + most, "{place:?}: {got:?} {want}");
        assert_eq!(got.direct, got.irradiance);
    }
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn half_hidden_light_matches_clipped_polygon() {
    let gpu = gpu();
    // Shadows with an edge parallel to the light's, and at angles to it; places at and off its
    // axis.
    let square = facing_down([-0.5, 0.5], [-0.5, 0.5], 2.0);
    let mut worst = [0f64; 3];
    for k in 0..60usize {
        let (at, angle) = (f64::from(k as u32 % 20) * 0.045 - 0.43, f64::from(k as u32 / 20) * 0.4);
        // Half way up, the blocker's edge at half the distance that it hides the light from.
        let (along, across) =
            (DVec3::new(-angle.sin(), angle.cos(), 0.0), DVec3::new(angle.cos(), angle.sin(), 0.0));
        let edge = across * at / 2.0 + DVec3::Z;
        let blocker = [
            edge - along * 9.0,
            edge + along * 9.0,
            edge + along * 9.0 + across * 9.0,
            edge - along * 9.0 + across * 9.0,
        ];
        let light = dark(&[(square, lamp(LAMP)), (blocker.map(|p| p.to_array()), grey())]);
        let place = place([0.0; 3], [0.1, 0.2, 1.0]);
        let got = gather_all(&light, &gpu, 4096, &[place])[0];
        // The part of the square on the light side of the line at `at` across.
        let mut left = vec![];
        for k in 0..4 {
            let (a, b) = (DVec3::from_array(square[k]), DVec3::from_array(square[(k + 1) % 4]));
            let (ha, hb) = (a.dot(across) - at, b.dot(across) - at);
            left.extend((ha < 0.0).then_some(a.to_array()));
            left.extend((ha * hb < 0.0).then(|| a.lerp(b, ha / (ha - hb)).to_array()));
        }
        let (want, whole) = (factor(&place, &left), factor(&place, &square));
        let error = (got.direct.x - want) / whole;
        worst[k / 20] = error.abs().max(worst[k / 20]);
        // Of 1024 points on the light, a (0,2)-net turned along both axes, an edge has wrong no
        // more than those in the cells of 1/32 that it crosses, two times 32 at most, evenly to
        // either side: 6 √(64/12) = 14 of them.
        assert!(error.abs() < 14.0 / 1024.0, "{k}: {error}");
    }
    println!("worst errors {worst:.4?} of the light, by angle");
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn light_of_many_triangles_matches_closed_form() {
    let gpu = gpu();
    // A bulb: an octahedron cut into 512 triangles, on a sphere of radius 0.2.
    let mut bulb = vec![];
    for octant in 0..8 {
        let sign = |bit: i32| if octant >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let [x, y, z] = [DVec3::X * sign(0), DVec3::Y * sign(1), DVec3::Z * sign(2)];
        let outward = sign(0) * sign(1) * sign(2) > 0.0;
        let mut parts = vec![if outward { [x, y, z] } else { [x, z, y] }];
        for _ in 0..3 {
            let halves = |[a, b, c]: [DVec3; 3]| {
                let [d, e, f] = [a + b, b + c, c + a].map(DVec3::normalize);
                [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
            };
            parts = parts.into_iter().flat_map(halves).collect();
        }
        bulb.extend(parts.into_iter().map(|t| t.map(|p| p * 0.2 + DVec3::Z)));
    }
    // A trough, open downwards, that shines on its inside: not convex, yet nothing of it hides any.
    let peak = [[0.0, -0.5, 2.0], [0.0, 0.5, 2.0]];
    let [left, right] = [-0.5, 0.5].map(|x| [[x, -0.5, 1.5], [x, 0.5, 1.5]]);
    let trough = [
        [left[0], left[1], peak[1]],
        [left[0], peak[1], peak[0]],
        [peak[0], peak[1], right[1]],
        [peak[0], right[1], right[0]],
    ]
    .map(|t| t.map(DVec3::from_array));
    for (corners, convex) in [(&bulb[..], true), (&trough[..], false)] {
        let triangles = (0..corners.len() as u32)
            .map(|t| Triangle { corners: [3 * t, 3 * t + 1, 3 * t + 2], ..Default::default() });
        let positions = corners.iter().copied().flatten().collect();
        let scene = Scene::new(positions, triangles.collect(), vec!["g".into()], vec![lamp(LAMP)]);
        let light =
            GivenRadiosity::new(Mesh::new(scene.unwrap(), f64::INFINITY).unwrap(), |_, _| {
                Rgb::ZERO
            });
        for place in
            [place([0.1, 0.2, 0.0], [0.0, 0.0, 1.0]), place([0.3, 0.0, 0.3], [-0.5, 0.2, 1.0])]
        {
            let got = gather_all(&light, &gpu, 4096, &[place])[0];
            let want: f64 =
                corners.iter().map(|t| point_to_polygon(place.position, place.normal, t)).sum();
            let error = got.direct.x / want - 1.0;
            // Not convex: the mean over 1024 points of form factors that vary by as much as they
            // are, in a (0,2)-net with four borders between triangles: 4/32.
            let bound = if convex { ROUNDING } else { 4.0 / 32.0 };
            println!("convex {convex}: {error:.1e}");
            assert!(error.abs() < bound, "convex {convex}: {error}");
        }
    }
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn large_light_nearby_is_its_closed_form() {
    let gpu = gpu();
    let sheet = facing_down([-1.0, 1.0], [-1.0, 1.0], 1.0);
    let light = dark(&[(sheet, lamp(LAMP))]);
    let places =
        [place([0.1, 0.2, 0.999], [0.0, 0.0, 1.0]), place([0.99, 0.2, 0.999], [0.4, 0.0, 1.0])];
    for (place, got) in places.iter().zip(gather_all(&light, &gpu, 4096, &places)) {
        let want = factor(place, &sheet);
        assert!((got.direct.x / want - 1.0).abs() < ROUNDING, "{got:?} {want}");
        // Stratified rays: those whose cells of 1/64 the outline crosses, at most two times 64.
        assert!(((1.0 - got.escaped) - want).abs() < 6.0 * (128f64 / 12.0).sqrt() / 4096.0);
    }
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn linear_radiosity_is_interpolated() {
    let gpu = gpu();
    // A floor of sides 4 under a place at height 1, cut unevenly.
    let floor = [[-2.0, -2.0, 0.0], [2.0, -2.0, 0.0], [2.0, 2.0, 0.0], [-2.0, 2.0, 0.0]];
    let value = |p: DVec3| Rgb::new(3.0 + p.x, 3.0 + p.y, 2.0 - p.x - 0.5 * p.y);
    let (steps, place) = (100, place([0.3, -0.2, 1.0], [0.1, 0.2, -1.0]));
    let mut want = Rgb::ZERO;
    for (i, j) in (0..steps * steps).map(|k| (k % steps, k / steps)) {
        let at = |k: i32| -2.0 + 4.0 * f64::from(k) / f64::from(steps);
        let (x0, x1, y0, y1) = (at(i), at(i + 1), at(j), at(j + 1));
        let cell = [[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]];
        want += value(DVec3::new(x0 + x1, y0 + y1, 0.0) / 2.0) * factor(&place, &cell);
    }
    for size in [f64::INFINITY, 2.9, 0.3] {
        let mesh = Mesh::new(quads(&[(floor, grey())]), size).unwrap();
        let uneven: Vec<usize> = (0..mesh.element_count()).step_by(3).collect();
        let light = GivenRadiosity::new(mesh.split(&uneven).unwrap(), |_, p| value(p));
        let got = gather_all(&light, &gpu, 1 << 14, &[place])[0];
        // Stratified rays in cells of 1/128: those that the outline crosses, up to two times 128,
        // are wrong by up to the radiosity of 5, and evenly; cells are taken at their middles:
        // 0.04² of 4/24.
        let bound = 5.0 * 6.0 * (256f64 / 12.0).sqrt() / 16384.0 + 3e-4;
        let error = (got.irradiance - want).abs().max_element();
        println!("size {size}: {error:.1e}, bound {bound:.1e}");
        assert!(error < bound, "{got:?} {want}");
        assert_eq!(got.direct, Rgb::ZERO);
    }
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn gather_is_independent_of_batching() {
    let gpu = gpu();
    let light = GivenRadiosity::new(cornell_box(100.0), |t, p| p / 600.0 + 0.1 * (t % 3) as f64);
    let places = light.places(70, 0.01);
    let mut gather = TracedGather::new(&gpu, &light.mesh, 64).unwrap();
    let together = gather.gather(&light.sources(), &places).unwrap();
    for (place, want) in places.iter().zip(&together) {
        assert_eq!(&gather.gather(&light.sources(), &[*place]).unwrap()[0], want);
    }
    // Those over the hemisphere and a quarter as many to each light, of each point, twice.
    assert_eq!(gather.rays(), 2 * (64 + 16) * places.len() as u64);
    assert!(gather_all(&light, &gpu, 64, &places) == together);
    assert_eq!(gather.gather(&light.sources(), &[]).unwrap(), []);
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn sky_backs_and_distance_match_closed_forms() {
    let gpu = gpu();
    let place = place([0.0; 3], [0.0, 0.0, 1.0]);
    let wide = |z: f64| facing_down([-1e3 * z, 1e3 * z], [-1e3 * z, 1e3 * z], z);
    for (back, z) in [(false, 2.0), (true, 0.5)] {
        let mut plane = wide(z);
        if back {
            plane.reverse();
        }
        let got = gather_all(&dark(&[(plane, grey())]), &gpu, 4096, &[place])[0];
        // Mean of 1/distance under a plane: ∫ 2 cos θ sin θ · cos θ/z dθ = 2/(3z). Rays start at
        // the inner rims of their rings: the mean cosine is 1/(2 n) too much, as in
        // `sampling::hemisphere`, 3/(4 n) of itself. The plane ends at 1e-3 above the horizon: one
        // ray in 10⁶.
        assert_eq!(got.escaped, 0.0);
        assert!((got.backface - f64::from(u8::from(back))).abs() < 1e-5, "{got:?}");
        assert!((got.inverse_distance * 1.5 * z - 1.0).abs() < 1.0 / 4096.0, "{got:?}");
    }
    // Half the sky: what is not on one side of a wall.
    let wall = [[0.0, -1e3, -1e3], [0.0, 1e3, -1e3], [0.0, 1e3, 1e3], [0.0, -1e3, 1e3]];
    let shifted = GatherPoint { position: DVec3::new(0.01, 0.0, 0.0), ..place };
    let got = gather_all(&dark(&[(wall, grey())]), &gpu, 4096, &[shifted])[0];
    // The top of the wall is 1e-5 off the zenith; of two times 64 cells half is wrong at most.
    assert!((got.escaped - 0.5).abs() < 6.0 * (128f64 / 12.0).sqrt() / 4096.0, "{got:?}");
    assert!((got.escaped + got.backface - 1.0).abs() < 1e-5 || got.backface == 0.0);
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn rejects_bad_numbers_of_rays_and_fields() {
    let gpu = gpu();
    let light = GivenRadiosity::new(cornell_box(200.0), |_, _| Rgb::ONE);
    for n in [0, (1 << 20) + 1] {
        let e = TracedGather::new(&gpu, &light.mesh, n).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::Setting);
        assert!(e.to_string().contains(&n.to_string()), "{e}");
    }
    let mut gather = TracedGather::new(&gpu, &light.mesh, 64).unwrap();
    let other = dark(&[(facing_down([0.0, 1.0], [0.0, 1.0], 1.0), lamp(LAMP))]);
    let good = light.sources();
    let short = RadiosityField { corners: &light.corners[1..], ..good };
    let empty = RadiosityField { reflected: &[], ..good };
    for bad in [other.sources(), short, empty] {
        assert_eq!(
            gather.gather(&bad, &light.places(1, 0.01)).unwrap_err().kind(),
            ErrorKind::Setting
        );
    }
    // A finer mesh of the same scene and other values are fine, call by call.
    for (size, value) in [(100.0, 0.5), (50.0, 2.0)] {
        let finer = GivenRadiosity::new(cornell_box(size), |_, _| Rgb::splat(value));
        let got = gather.gather(&finer.sources(), &light.places(1, 0.01)).unwrap()[0];
        let indirect = (got.irradiance - got.direct) / (1.0 - got.escaped - got.backface);
        assert!((indirect / value - 1.0).abs().max_element() < 1e-5, "{got:?}");
    }
}
