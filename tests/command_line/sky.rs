//! Skies and the sun, as the program takes them.

use std::path::Path;

use radiosity::glam::DVec3;
use radiosity::{Rgb, VertexMesh};

use crate::{cornell, refused, room, run, write};

#[test]
fn a_sky_lights_what_has_no_lamp() {
    let folder = tempfile::tempdir().unwrap();
    let radiosity = |name: &str, more: &[&str]| {
        let scene = write(folder.path(), name, &room(if name == "open.obj" { 5 } else { 6 }));
        let scene = scene.display().to_string();
        let mut args = vec![scene.as_str(), "--error", "0.1", "--cpu", "--write", "json,ply"];
        args.extend(more);
        let out = run("bake", &args);
        let said = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(out.status.success(), "{said}");
        let stem = Path::new(&scene).with_extension("");
        let ply = radiosity::io::read_ply(stem.with_extension("ply")).unwrap();
        let json = std::fs::read(stem.with_extension("json")).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
        let brightest = ply.radiosity.iter().map(|b| b.x).fold(0.0, f64::max);
        (brightest, json["sky"][0].as_f64().unwrap(), said)
    };
    let (one, sky, said) = radiosity("open.obj", &[]);
    assert!(one > 0.1 && sky == 1.0 && said.contains("sky of radiance 1"), "{one} {sky} {said}");
    let (two, sky, said) = radiosity("open.obj", &["--sky", "2"]);
    // The same rays: twice as much, in the files' six digits.
    assert!((two / one - 2.0).abs() < 1e-5 && sky == 2.0 && !said.contains("sky"), "{two} {said}");
    let place = |name: &str| folder.path().join(name).display().to_string();
    let (scene, ply) = (place("open.obj"), place("open.ply"));
    let other_sky = run("verify", &[&scene, &ply]);
    let said = String::from_utf8_lossy(&other_sky.stderr);
    assert!(!other_sky.status.success() && said.contains("--sky 2,2,2"), "{said}");
    let same_sky = run("verify", &[&scene, &ply, "--sky", "2", "--precision", "0.5"]);
    assert!(same_sky.status.success(), "{}", String::from_utf8_lossy(&same_sky.stderr));
    let (none, _, said) = radiosity("open.obj", &["--sky", "none"]);
    assert!(none == 0.0 && said.contains("left dark") && said.contains("--emit"), "{said}");
    let (closed, _, said) = radiosity("closed.obj", &[]);
    assert!(closed == 0.0 && said.contains("no light") && said.contains("--emit"), "{said}");
    refused(&[cornell(), "--sky", "blue"], &["--sky", "none"]);
    refused(&[cornell(), "--sky", "1,2,-3"], &["sky", "0"]);
}

/// A square of ground, level where +y is up, that reflects a half.
const GROUND: &str = "v 0 0 0\nv 0 0 1\nv 1 0 1\nv 1 0 0\nf 1 2 3 4\n";

/// The solution of the ground under the sky of these options, and its report.
fn ground_under(folder: &Path, sky: &[&str]) -> (VertexMesh, serde_json::Value) {
    let scene = write(folder, "ground.obj", GROUND).display().to_string();
    let mut args = vec![scene.as_str(), "--error", "0.05", "--cpu", "--write", "json,ply"];
    args.extend(sky);
    let out = run("bake", &args);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let stem = folder.join("ground");
    let json = std::fs::read(stem.with_extension("json")).unwrap();
    let solution = radiosity::io::read_ply(stem.with_extension("ply")).unwrap();
    (solution, serde_json::from_slice(&json).unwrap())
}

/// Irradiance of the ground, W/m², of the first channel.
fn irradiance(solution: &VertexMesh) -> f64 {
    let mean = solution.irradiance.iter().sum::<Rgb>() / solution.irradiance.len() as f64;
    mean.x
}

#[test]
fn skies_and_suns_are_named_on_the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    let sky = |options: &[&str]| irradiance(&ground_under(folder.path(), options).0);
    let near = |found: f64, truth: f64| {
        // A few hundred rays, and a file's six digits.
        assert!((found / truth - 1.0).abs() < 2e-3, "{found} {truth}");
    };
    let pi = std::f64::consts::PI;
    near(sky(&["--sky", "overcast"]), 7.0 / 9.0 * pi);
    near(sky(&["--sky", "overcast", "--zenith", "2,1,1"]), 14.0 / 9.0 * pi);
    near(sky(&["--sky", "cie5", "--up", "0,1,0"]), pi);
    near(sky(&["--sky", "none", "--sun", "0,3,4=10"]), 6.0);
    near(sky(&["--sky", "1", "--sun", "0,3,4=10", "--sides", "front"]), 6.0 + pi);
    // From below a sun lights nothing of it but its back.
    near(
        sky(&["--sky", "overcast", "--up", "0,-1,0", "--sides", "front", "--sun", "0,1,0=1"]),
        1.0,
    );
    // Straight above the equator at noon of an equinox; at Greenwich the equation of time is
    // 7.5 minutes then, 1.9°.
    near(sky(&["--sky", "none", "--sun-at", "0,0,2026-03-20T12:07:30Z=10"]), 10.0);
    // At the Tropic of Cancer at midsummer's noon the sun is overhead as well; six hours earlier at
    // 22° × sin(23.4°): known from the height of the sun at six, sin h = sin φ sin δ.
    let morning = ["--sky", "none", "--sun-at", "23.44,0,2026-06-21T06:01:50Z=10"];
    near(sky(&morning), 10.0 * 23.44f64.to_radians().sin().powi(2));
}

/// Measured irradiance: level ground receives DNI · cos Z + DHI, whatever the sky's distribution.
#[test]
fn a_sky_is_given_by_its_irradiance() {
    let folder = tempfile::tempdir().unwrap();
    for (sky, sun, truth) in [
        ("irradiance:0,100", ["--sun", "0,3,4"], 100.0),
        ("irradiance:800,100", ["--sun", "0,3,4"], 800.0 * 0.6 + 100.0),
        ("irradiance:500,0", ["--sun", "0,3,4"], 500.0 * 0.6),
        // Straight above, as in `skies_and_suns_are_named_on_the_command_line`.
        ("irradiance:300,250,15", ["--sun-at", "0,0,2026-03-20T12:07:30Z"], 550.0),
    ] {
        let options = [&["--sky", sky][..], &sun].concat();
        let (solution, report) = ground_under(folder.path(), &options);
        let found = irradiance(&solution);
        // A few hundred rays near a bright sun's halo, half of them stratified: 1 %.
        assert!((found / truth - 1.0).abs() < 1e-2, "{sky}: {found} {truth}");
        if sky.ends_with(",0") {
            continue;
        }
        let again = report["sky"].as_str().unwrap();
        assert!(again.starts_with("perez:"), "{again}");
        let typed: Vec<&str> = ["--sky"].into_iter().chain(again.split(' ')).collect();
        let (same, report) = ground_under(folder.path(), &typed);
        assert!((irradiance(&same) / found - 1.0).abs() < 1e-5 && report["sky"] == again);
    }
}

#[test]
fn the_sun_rises_in_the_east() {
    let folder = tempfile::tempdir().unwrap();
    // +x is east where −z is north, and where north is +x, +z is east.
    for (more, east) in [(&[][..], DVec3::X), (&["--north", "1,0,0"], DVec3::Z)] {
        let mut options = vec!["--sky", "none", "--sun-at", "0,0,2026-03-20T07:00:00Z=10"];
        options.extend(more);
        let (_, report) = ground_under(folder.path(), &options);
        let words = report["sky"].as_str().unwrap();
        let direction = words.split("--sun ").nth(1).unwrap().split('=').next().unwrap();
        let direction: Vec<f64> = direction.split(',').map(|x| x.parse().unwrap()).collect();
        let direction = DVec3::from_slice(&direction);
        // An hour after the rise, 15° and what the equation of time takes off.
        assert!(direction.dot(east) > 0.96 && direction.y > 0.2, "{words}");
    }
}

#[test]
fn verify_takes_the_sky_of_the_bake() {
    let folder = tempfile::tempdir().unwrap();
    let sky = ["--sky", "cie12", "--sun", "1,2,0=10"];
    let (_, report) = ground_under(folder.path(), &sky);
    let place = |name: &str| folder.path().join(name).display().to_string();
    let (scene, ply) = (place("ground.obj"), place("ground.ply"));
    let verify = |more: &[&str]| {
        let mut args = vec![scene.as_str(), ply.as_str(), "--precision", "0.5", "--hidden"];
        args.extend(more);
        let out = run("verify", &args);
        (out.status.success(), String::from_utf8_lossy(&out.stderr).into_owned())
    };
    let (good, said) = verify(&sky);
    assert!(good, "{said}");
    for other in [&["--sky", "overcast"][..], &["--sky", "1"], &sky[..2]] {
        let (good, said) = verify(other);
        assert!(!good && said.contains("--sky cie12 --zenith 1,1,1 --up 0,1,0 --sun"), "{said}");
    }
    // What it says can be typed.
    let again = report["sky"].as_str().unwrap().split(' ').collect::<Vec<_>>();
    let (good, said) = verify(&[&["--sky"], &again[..]].concat());
    assert!(good, "{said}");
}

#[test]
fn a_sun_below_the_horizon_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let scene = write(folder.path(), "ground.obj", GROUND).display().to_string();
    let told = |more: &[&str]| {
        let mut args = vec![&*scene, "--error", "0.5", "--cpu", "--write", "json"];
        args.extend(more);
        let out = run("bake", &args);
        let told = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(out.status.success(), "{told}");
        told
    };
    let below = told(&["--sun", "1,-2,0=10"]);
    let want = "1,-2,0 points towards it; did you mean -1,2,0?";
    assert!(below.contains("the sun is below the horizon") && below.contains(want), "{below}");
    let json = std::fs::read_to_string(folder.path().join("ground.json")).unwrap();
    assert!(json.contains("the sun is below the horizon"), "{json}");
    for fine in [&["--sun", "1,2,0=10"][..], &["--sun", "1,-2,0=10", "--up", "0,-1,0"]] {
        assert!(!told(fine).contains("horizon"), "{fine:?}");
    }
}

#[test]
fn a_picture_is_a_sky() {
    let folder = tempfile::tempdir().unwrap();
    // White above the horizon, as EXR; and as HDR, in which 1 is 128, 128, 128 and 2¹⁻⁸⁺¹²⁸.
    let pixels: Vec<Rgb> = [Rgb::ONE, Rgb::ZERO].into_iter().flat_map(|l| [l; 4]).collect();
    let image =
        radiosity::camera::RadianceImage { width: 4, height: 2, pixels, sky: vec![false; 8] };
    radiosity::write_exr(folder.path().join("half.exr"), &image).unwrap();
    let mut hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n".to_vec();
    hdr.extend([[128, 128, 128, 129]; 4].concat());
    hdr.extend([[0; 4]; 4].concat());
    std::fs::write(folder.path().join("half.hdr"), hdr).unwrap();
    for name in ["half.exr", "half.hdr"] {
        let path = folder.path().join(name).display().to_string();
        let (solution, _) = ground_under(folder.path(), &["--sky", &path, "--zenith", "3"]);
        let found = irradiance(&solution) / (3.0 * std::f64::consts::PI);
        assert!((found - 1.0).abs() < 1e-5, "{name}: {found}");
        // Upside down it is dark: only the back of the ground is lit.
        let options = ["--sky", &path, "--up", "0,-1,0", "--sides", "front"];
        assert_eq!(irradiance(&ground_under(folder.path(), &options).0), 0.0);
    }
    let nonsense = write(folder.path(), "nonsense.hdr", "no picture").display().to_string();
    refused(&[cornell(), "--sky", &nonsense], &["nonsense.hdr", "OpenEXR"]);
    refused(&[cornell(), "--sky", "not_there.exr"], &["not_there.exr", "cannot be read"]);
}

#[test]
fn wrong_skies_and_suns_are_refused() {
    for (option, value, word) in [
        ("--sky", "cie16", "cie1 to cie15"),
        ("--sky", "perez:1", "perez:CLEARNESS,BRIGHTNESS"),
        ("--sky", "perez:0.5,0.1", "--sky"),
        ("--zenith", "bright", "r,g,b"),
        ("--up", "0,0,0", "not zero"),
        ("--sun", "0,1", "x,y,z=IRRADIANCE"),
        ("--sun", "0,0,0=1", "direction"),
        ("--sun", "0,1,0=-1", "at least 0"),
        ("--zenith", "1,1,1", "add --sky overcast"),
        ("--sky", "irradiance:800", "irradiance:DNI,DHI"),
        ("--sky", "irradiance:800,-1", "irradiance:DNI,DHI"),
        ("--sky", "irradiance:800,100", "add --sun x,y,z"),
        ("--sun", "0,1,0", "write =E behind it"),
        ("--sun-at", "48,11,noon=800", "noon"),
        ("--sun-at", "98,11,2026-06-21T12:00:00Z=800", "98"),
        ("--sun-at", "48,11,2026-06-21T00:00:00Z=800", "below the horizon"),
    ] {
        refused(&[cornell(), option, value], &[option.trim_start_matches("--"), word]);
    }
}
