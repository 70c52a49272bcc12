//! Gathering with rays: where rays disagree, more are cast.

use glam::DVec3;
use radiosity::backend::cpu::RayGather;
use radiosity::form_factor::closed_form::point_to_polygon;
use radiosity::gather::{GatherPoint, IrradianceSample};
use radiosity::{Gather, Material, Mesh, Rgb};

use crate::common::fakes::GivenRadiosity;
use crate::common::{cube, quads};

/// Some places see a small bright spot, which few rays find or miss by chance.
#[test]
fn noisy_points_get_more_rays() {
    let spot = [[-0.3, 0.0, 1.4], [0.3, 0.0, 1.4], [0.3, 0.0, 2.0], [-0.3, 0.0, 2.0]];
    let corners = spot.map(DVec3::from_array);
    let scene = quads(&[(spot, Material::grey("spot", 0.5))]);
    let light = GivenRadiosity::new(Mesh::new(scene, 1.0).unwrap(), |_, _| Rgb::ONE);
    let place = |k: usize| {
        let (x, y) = (0.01 * k as f64 - 0.5, -1.5 + 0.003 * k as f64);
        GatherPoint { position: DVec3::new(x, y, 0.0), normal: DVec3::Z, near: 1e-6 }
    };
    let places: Vec<GatherPoint> = (0..100).map(place).collect();
    let off = |gather: RayGather| {
        let mut gather = gather;
        let found = gather.gather(&light.sources(), &places).unwrap();
        let off = found.iter().zip(&places).map(|(g, p)| {
            let truth = point_to_polygon(p.position, p.normal, &corners);
            (g.irradiance.x / truth - 1.0).powi(2)
        });
        (off.sum::<f64>() / 100.0).sqrt()
    };
    let few = || RayGather::new(&light.mesh, 1024).unwrap();
    let (plain, more) = (off(few()), off(few().with_noise(0.02, 0.0)));
    let all = off(RayGather::new(&light.mesh, 1 << 14).unwrap());
    println!("off by {plain:.4}, {more:.4} where they disagree, {all:.4} with 16 times as many");
    // Some 8 of 256 rays find it: 1/8 off, or less as they are stratified. Four times as many are
    // off by less than half of that; 16 times by a quarter of that again.
    assert!(plain > 0.04 && more < plain / 2.0 && all < plain / 4.0);
    // A limit of no more rays leaves the first ones, one of twice as many is in between.
    let up_to = |times: u32| off(few().with_noise(0.02, 0.0).with_most_rays(times));
    assert_eq!([up_to(1), up_to(16)], [plain, more]);
    assert!(more < up_to(2) && up_to(2) < plain);
    assert_eq!([up_to(0), up_to(3)], [up_to(1), up_to(2)]);
    // Where they agree, nothing changes: with light from everywhere, bit for bit.
    let even =
        GivenRadiosity::new(Mesh::new(cube(&Material::grey("even", 0.5)), 0.5).unwrap(), |_, _| {
            Rgb::ONE
        });
    let places = even.places(20, 1e-6);
    let few = || RayGather::new(&even.mesh, 64).unwrap();
    let [one, two] = [few(), few().with_noise(0.02, 0.0)]
        .map(|mut g| g.gather(&even.sources(), &places).unwrap());
    assert_eq!(one, two);
}

/// The same rays for both: as many as the first field takes.
#[test]
fn two_fields_are_seen_by_the_same_rays() {
    let spot = [[-0.3, 0.0, 1.4], [0.3, 0.0, 1.4], [0.3, 0.0, 2.0], [-0.3, 0.0, 2.0]];
    let scene = quads(&[(spot, Material::grey("spot", 0.5))]);
    let mesh = Mesh::new(scene, 1.0).unwrap();
    let [bright, dark] =
        [Rgb::ONE, Rgb::ZERO].map(|value| GivenRadiosity::new(mesh.clone(), |_, _| value));
    let place = |k: usize| {
        let position = DVec3::new(0.01 * k as f64 - 0.5, -1.5, 0.0);
        GatherPoint { position, normal: DVec3::Z, near: 1e-6 }
    };
    let places: Vec<GatherPoint> = (0..100).map(place).collect();
    let few = || RayGather::new(&bright.mesh, 256).unwrap();
    let more = || few().with_noise(0.02, 0.0);
    let alone = |mut gather: RayGather| gather.gather(&bright.sources(), &places).unwrap();
    assert_ne!(alone(few()), alone(more()), "some places take more rays");
    let (bright, dark) = (bright.sources(), dark.sources());
    let [first, second] = more().gather_both([&bright, &dark], &places).unwrap();
    assert_eq!(first, alone(more()));
    assert!(second.iter().all(|sample| sample.irradiance == Rgb::ZERO));
    let shares = |samples: &[radiosity::gather::IrradianceSample]| {
        samples.iter().map(|s| (s.escaped, s.inverse_distance)).collect::<Vec<_>>()
    };
    assert_eq!(shares(&first), shares(&second));
    // Of darkness the fewest do, and there is no noise in it.
    let [_, second] = more().gather_both([&dark, &bright], &places).unwrap();
    let without_noise = |sample| IrradianceSample { noise: 0.0, ..sample };
    assert_eq!(second, alone(few()).into_iter().map(without_noise).collect::<Vec<_>>());
}

/// What rays tell of their own noise, against what they are off by.
#[test]
fn noise_is_what_points_are_off_by() {
    let lamp = [[-0.5, -0.5, 2.0], [-0.5, 0.5, 2.0], [0.5, 0.5, 2.0], [0.5, -0.5, 2.0]];
    let screen = [[-0.4, -0.4, 1.0], [0.4, -0.4, 1.0], [0.4, 0.4, 1.0], [-0.4, 0.4, 1.0]];
    let wall = [[1.5, -1.0, 0.0], [1.5, 1.0, 0.0], [1.5, 1.0, 2.0], [1.5, -1.0, 2.0]];
    let glowing = Material { exitance: Rgb::splat(10.0), ..Material::grey("lamp", 0.5) };
    let grey = Material::grey("grey", 0.5);
    let scene = quads(&[(lamp, glowing), (screen, grey.clone()), (wall, grey)]);
    let light = GivenRadiosity::new(Mesh::new(scene, 1.0).unwrap(), |_, _| Rgb::splat(2.0));
    let place = |k: usize| {
        let position = DVec3::new(0.009 * k as f64 - 0.9, 0.003 * k as f64 - 0.3, 0.0);
        GatherPoint { position, normal: DVec3::Z, near: 1e-6 }
    };
    let places: Vec<GatherPoint> = (0..200).map(place).collect();
    let by = |rays: u32| {
        RayGather::new(&light.mesh, rays).unwrap().gather(&light.sources(), &places).unwrap()
    };
    let (few, many) = (by(128), by(1 << 16));
    let root_mean_square = |squares: &mut dyn Iterator<Item = f64>| {
        (squares.sum::<f64>() / places.len() as f64).sqrt()
    };
    let pairs = few.iter().zip(&many);
    let off =
        root_mean_square(&mut pairs.map(|(a, b)| a.irradiance.distance_squared(b.irradiance)));
    let told = root_mean_square(&mut few.iter().map(|sample| sample.noise.powi(2)));
    let rest = root_mean_square(&mut many.iter().map(|sample| sample.noise.powi(2)));
    println!("off by {off:.4}, told {told:.4}; {rest:.5} with 512 times the rays");
    // Stratified halves differ by more than twice what all of them are off by: up to n^0.25 in
    // the limit of smooth light, some 3 here; and never by far less.
    assert!(told > 0.7 * off && told < 4.0 * off && rest < 0.1 * told);
}

/// Of a sky that reaches to the horizon, few points spread over its area count.
#[test]
fn how_much_of_a_wide_sky_is_hidden_is_seen_by_rays_over_the_hemisphere() {
    const RAYS: u32 = 256;
    let sky = |to: f64| {
        let at = |x: f64, y: f64| DVec3::new(x, y, 10.0);
        [at(-1000.0, -1000.0), at(-1000.0, 1000.0), at(to, 1000.0), at(to, -1000.0)]
    };
    let roof = [[0.0, -1e3, 5.0], [1e3, -1e3, 5.0], [1e3, 1e3, 5.0], [0.0, 1e3, 5.0]];
    let bright = Material { exitance: Rgb::ONE, ..Material::grey("sky", 0.0) };
    let sky_quad = (sky(1000.0).map(|p| p.to_array()), bright);
    let places: Vec<GatherPoint> = (0..100)
        .map(|k| DVec3::new(0.04 * f64::from(k) - 2.0, 0.3 * f64::from(k), 0.0))
        .map(|position| GatherPoint { position, normal: DVec3::Z, near: 1e-6 })
        .collect();
    let off = |roofs: &[_], end: &dyn Fn(f64) -> f64| {
        let scene = quads(&[std::slice::from_ref(&sky_quad), roofs].concat());
        let dark = GivenRadiosity::new(Mesh::new(scene, 1e4).unwrap(), |_, _| Rgb::ZERO);
        let mut rays = RayGather::new(&dark.mesh, RAYS).unwrap();
        let found = rays.gather(&dark.sources(), &places).unwrap();
        let square = |(g, p): (&IrradianceSample, &GatherPoint)| {
            let truth = point_to_polygon(p.position, p.normal, &sky(end(p.position.x)));
            (g.direct.x / truth - 1.0).powi(2)
        };
        (found.iter().zip(&places).map(square).sum::<f64>() / places.len() as f64).sqrt()
    };
    // All of it is its closed form, but for rounding.
    assert!(off(&[], &|_| 1000.0) < 1e-12);
    // The roof's edge, at half the height, hides what is beyond the point reflected in it: about
    // half of the sky. Of n independent rays half are off by 1/√n of that; where half of the sky
    // hides behind one line, those of n strata are off in √n of them.
    let hidden = off(&[(roof, Material::grey("roof", 0.0))], &|x| -x);
    println!("off by {hidden:.4}");
    assert!(hidden < 0.5 / f64::from(RAYS).sqrt());
}
