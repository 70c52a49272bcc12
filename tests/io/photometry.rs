//! Photometric files as they are met: LM-63 and EULUMDAT, whole, odd and broken.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::io::{Input, Photometry, PhotometrySettings, read_photometry};
use radiosity::{Error, ErrorKind};

fn read(text: &str) -> Photometry {
    try_read(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn try_read(text: &str) -> Result<Photometry, Error> {
    read_photometry(Input::bytes("lamp", text.as_bytes()))
}

/// The message of what is refused.
fn refused(text: &str) -> String {
    let error = try_read(text).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Scene);
    error.to_string()
}

/// The only warning.
fn warned(photometry: &Photometry) -> &str {
    let [warning] = &photometry.warnings[..] else { panic!("{:?}", photometry.warnings) };
    warning
}

/// A whole LM-63 file: 2 lamps of 500 lm, metres, 0.6 wide, 1.2 long, and these angles and values.
fn lm_63(angles: &str, values: &str) -> String {
    let counts: Vec<usize> = angles.lines().map(|line| line.split_whitespace().count()).collect();
    let [vertical, horizontal] = counts[..] else { panic!("{angles}") };
    format!(
        "IESNA:LM-63-2002\n[TEST] 1\n[MANUFAC] Firm\n[LUMINAIRE] Lamp\nTILT=NONE\n\
         2 500 1 {vertical} {horizontal} 1 2 0.6 1.2 0\n1 1 40\n{angles}\n{values}\n"
    )
}

/// One that sends 10 cd straight down, 20 at 90° from there and 30 up.
fn plain() -> String {
    lm_63("0 90 180\n0", "10 20 30")
}

/// The direction at these degrees from the aim, and from C = 0° towards C = 90°.
fn towards(polar: f64, azimuth: f64) -> DVec3 {
    let ([sine, cosine], [y, x]) =
        [polar, azimuth].map(|a| a.to_radians().sin_cos()).map(|(s, c)| [s, c]).into();
    DVec3::new(sine * x, sine * y, cosine)
}

/// Intensities at 90° from the aim, every 45° around.
fn around(photometry: &Photometry) -> [f64; 8] {
    let at = |k: usize| photometry.intensity.along(towards(90.0, 45.0 * k as f64));
    std::array::from_fn(|k| (at(k) * 1e6).round() / 1e6)
}

#[test]
fn lm_63_is_read() {
    let lamp = read(&plain());
    assert_eq!((lamp.name.as_str(), lamp.lamp_flux, lamp.power), ("Firm Lamp", Some(1000.0), 40.0));
    assert_eq!((lamp.opening.size, lamp.opening.is_round), (DVec3::new(1.2, 0.6, 0.0), false));
    assert!(lamp.warnings.is_empty(), "{:?}", lamp.warnings);
    for (polar, intensity) in [(0.0, 10.0), (45.0, 15.0), (90.0, 20.0), (180.0, 30.0)] {
        let found = lamp.intensity.along(towards(polar, 33.0));
        assert!((found - intensity).abs() < 1e-12, "{polar}: {found}");
    }
    // The mean is 20 by symmetry.
    assert!((lamp.intensity.flux() / (80.0 * PI) - 1.0).abs() < 1e-13);
    // Multiplier, ballast factor and the factor that came before the future use; feet.
    let factors =
        plain().replace("500 1 3 1 1 2", "500 2 3 1 1 1").replace("\n1 1 40", "\n0.5 3 40");
    let lamp = read(&factors);
    assert!((lamp.intensity.flux() / (240.0 * PI) - 1.0).abs() < 1e-13);
    assert!((lamp.opening.size.x / (1.2 * 0.3048) - 1.0).abs() < 1e-14);
}

#[test]
fn planes_are_unfolded_by_their_symmetry() {
    let planes = |azimuths: &str, values: &[&str]| {
        around(&read(&lm_63(&format!("0 90\n{azimuths}"), &values.join("\n"))))
    };
    assert_eq!(planes("0", &["0 1"]), [1.0; 8]);
    assert_eq!(planes("0 45 90", &["0 1", "0 2", "0 3"]), [1., 2., 3., 2., 1., 2., 3., 2.]);
    let half = ["0 1", "0 2", "0 3", "0 4", "0 5"];
    assert_eq!(planes("0 45 90 135 180", &half), [1., 2., 3., 4., 5., 4., 3., 2.]);
    // Symmetric about the plane of 90° and 270°, as street lights of 1995 are.
    assert_eq!(planes("90 135 180 225 270", &half), [3., 2., 1., 2., 3., 4., 5., 4.]);
    let whole = ["0 1", "0 2", "0 3", "0 4", "0 1"];
    assert_eq!(planes("0 90 180 270 360", &whole), [1., 1.5, 2., 2.5, 3., 3.5, 4., 2.5]);
    // All but the last plane, which is the first once more.
    let open = read(&lm_63("0 90\n0 90 180 270", &whole[..4].join("\n")));
    assert!(warned(&open).contains("closed to a turn"));
    assert_eq!(around(&open), [1., 1.5, 2., 2.5, 3., 3.5, 4., 2.5]);
    // Nobody knows what is between 200° and 360°.
    let said = refused(&lm_63("0 90\n0 100 200", &whole[..3].join("\n")));
    assert!(said.contains("0° to 200°") && said.contains("180°"), "{said}");
}

#[test]
fn types_a_and_b_turn_around_other_axes() {
    // By vertical angle down, for each horizontal: brightest at 45° right, 45° up.
    let kind = |kind: &str, angles: &str, values: &str| {
        read(&lm_63(angles, values).replacen(" 1 2 0.6", &format!(" {kind} 2 0.6"), 1)).intensity
    };
    let (angles, values) = ("-45 0 45\n-45 0 45", "0 0 0\n0 0 0\n0 0 9");
    let up = DVec3::Y;
    let (right, aim) = (DVec3::X, DVec3::Z);
    // Of type A the horizontal angle turns around the vertical axis, of type B the other way.
    let half = 0.5f64.sqrt();
    let by_a = half * up + half * (half * right + half * aim);
    let by_b = half * right + half * (half * up + half * aim);
    for (name, direction) in [("3", by_a), ("2", by_b)] {
        let intensity = kind(name, angles, values);
        assert!((intensity.along(direction) - 9.0).abs() < 1e-9, "type {name}");
        assert_eq!(intensity.along(-direction), 0.0);
        // From 0° on both sides are alike: a quarter unfolds to the whole.
        let quarter = kind(name, "0 45 90\n0 45 90", "7 7 7\n7 7 7\n7 7 7");
        assert!((quarter.flux() / (14.0 * PI) - 1.0).abs() < 1e-13, "type {name}");
        let folded = kind(name, "0 45\n0 45", "0 0\n0 9");
        for mirrored in [direction, direction.with_x(-direction.x), direction.with_y(-direction.y)]
        {
            assert!((folded.along(mirrored) - 9.0).abs() < 1e-9, "type {name} {mirrored}");
        }
    }
    let said = refused(&plain().replacen(" 1 2 0.6", " 3 2 0.6", 1));
    assert!(said.contains("two of each"), "{said}");
    assert!(refused(&plain().replacen(" 1 2 0.6", " 4 2 0.6", 1)).contains("type 4"));
}

#[test]
fn openings_follow_their_signs() {
    let opening = |size: &str| read(&plain().replace("0.6 1.2 0\n", &format!("{size}\n"))).opening;
    let round = |size: &str| {
        let opening = opening(size);
        assert!(opening.is_round, "{size}");
        opening.size.to_array()
    };
    assert_eq!(opening("0 0 0").size, DVec3::ZERO);
    assert_eq!(opening("0.6 1.2 0.3").size, DVec3::new(1.2, 0.6, 0.3));
    // Circles of 1995 and of 2002, an upright cylinder, a sphere, an upright disc.
    assert_eq!(round("-0.5 0 0"), [0.5, 0.5, 0.0]);
    assert_eq!(round("-0.5 -0.5 0"), [0.5, 0.5, 0.0]);
    assert_eq!(round("-0.5 0 0.2"), [0.5, 0.5, 0.2]);
    assert_eq!(round("-0.5 -0.5 -0.5"), [0.5; 3]);
    assert_eq!(opening("-0.5 0 -0.5").size, DVec3::new(0.0, 0.5, 0.5));
}

#[test]
fn oddities_of_lm_63_are_understood() {
    let whole = read(&plain());
    let same = |text: &str| {
        let lamp = read(text);
        assert_eq!(lamp.intensity, whole.intensity, "{text}");
        lamp
    };
    // Line ends, a byte-order mark, capitals, blanks, lines broken anywhere, unknown keywords.
    same(&plain().replace('\n', "\r\n"));
    same(&plain().replace('\n', "\r"));
    same(&format!("\u{feff}\n  {}", plain()));
    same(&plain().replace("TILT=NONE", "Tilt = None "));
    same(&plain().replace("0 90 180\n0\n10 20 30", "0\n90 180 0\n10\n\n20\t30"));
    same(&plain().replace("[TEST] 1", "[_OWN] x\n[MORE] y\nnothing=known\n"));
    same(&plain().replace("IESNA:LM-63-2002\n", ""));
    same(&plain().replace("IESNA:LM-63-2002", "IESNA91"));
    same(&plain().replace("IESNA:LM-63-2002", "IES:LM-63-2019"));
    same(&plain().replace("0 90 180", "0, 90, 180").replace("10 20 30", "10,20,30"));
    // A whole number written as a fraction.
    same(&plain().replace("500 1 3 1", "500.0 1.0 3.0 1.0"));
    // Latin-1 in a name.
    let latin: Vec<u8> = plain().replace("Lamp", "L\u{e4}mp").chars().map(|c| c as u8).collect();
    let lamp = read_photometry(Input::bytes("lamp", &latin)).unwrap();
    assert_eq!((lamp.name.as_str(), &lamp.intensity), ("Firm L\u{e4}mp", &whole.intensity));
    // Absolute photometry.
    assert_eq!(same(&plain().replace("2 500", "1 -1")).lamp_flux, None);
    // Tilts: with factors, in a file, and no word of it.
    let tilt = same(&plain().replace("TILT=NONE", "TILT=INCLUDE\n1\n3\n0 45 90\n1 0.9 0.8"));
    assert!(warned(&tilt).contains("not applied"));
    assert!(same(&plain().replace("NONE", "INCLUDE\n1\n2\n0 90\n1 1")).warnings.is_empty());
    assert!(warned(&same(&plain().replace("NONE", "a.tlt"))).contains("'a.tlt'"));
    assert!(warned(&same(&plain().replace("TILT=NONE\n", ""))).contains("TILT=NONE"));
    // Factors of 0, as some programs write what they do not know; other units; words at the end.
    assert!(warned(&same(&plain().replace("\n1 1 40", "\n1 0 40"))).contains("future use 0"));
    assert!(warned(&same(&plain().replace("500 1 3", "500 0 3"))).contains("multiplier 0"));
    assert!(warned(&same(&plain().replace(" 1 2 0.6", " 1 7 0.6"))).contains("type 7"));
    assert!(warned(&same(&(plain() + "9 9\nEND\n"))).contains("3 words"));
    // Angles that come twice or in another order.
    let twice = lm_63("0 90 90 180\n0", "10 20 20 30");
    assert!(warned(&same(&twice)).contains("do not ascend"));
    assert!(warned(&same(&lm_63("180 90 0\n0", "30 20 10"))).contains("sorted"));
    // One plane at any angle is all of them.
    assert_eq!(around(&read(&lm_63("0 90 180\n45", "10 20 30"))), [20.0; 8]);
    // Decimal commas: with them there are as many numbers as there should be.
    let comma = plain().replace("0.6 1.2 0", "0,6 1,2 0,0").replace("10 20 30", "10,0 20,0 30,0");
    assert!(warned(&same(&comma)).contains("decimal"));
}

#[test]
fn vertical_angles_may_be_a_part() {
    let at = |lamp: &Photometry| {
        [10.0, 80.0, 100.0, 170.0].map(|polar| lamp.intensity.along(towards(polar, 0.0)) > 0.0)
    };
    let down = read(&lm_63("0 45 90\n0", "1 1 1"));
    assert!(at(&down) == [true, true, false, false] && down.warnings.is_empty());
    let up = read(&lm_63("90 135 180\n0", "1 1 1"));
    assert!(at(&up) == [false, false, true, true] && up.warnings.is_empty());
    let narrow = read(&lm_63("0 20\n0", "1 1"));
    assert_eq!(at(&narrow), [true, false, false, false]);
    assert!(warned(&narrow).contains("0° to 20°"));
    let noise = read(&lm_63("0 45 90\n0", "1 -0.01 -1"));
    assert!(warned(&noise).contains("2 intensities below 0"));
    assert_eq!(noise.intensity.along(towards(45.0, 0.0)), 0.0);
}

#[test]
fn broken_lm_63_is_refused_with_its_line() {
    let ends = refused(&lm_63("0 90 180\n0", "10 20"));
    assert!(ends.starts_with("lamp:10") && ends.contains("ends where a candela value"), "{ends}");
    // Counts that lie, without taking memory for what they promise.
    for (count, said) in [
        ("4000000000 1", "vertical angle"),
        ("3 4000000000", "horizontal angle"),
        ("0 1", "vertical angles 0"),
        ("-3 1", "vertical angles -3"),
        ("2.5 1", "vertical angles 2.5"),
        ("1e300 1", "vertical angles"),
        ("3 nan", "'nan'"),
    ] {
        let message = refused(&plain().replace("500 1 3 1", &format!("500 1 {count}")));
        assert!(message.contains(said), "{count}: {message}");
    }
    assert!(refused(&plain().replace("10 20", "10 2o")).contains("'2o'"));
    assert!(refused(&plain().replace("10 20", "10 1e999")).contains("'1e999'"));
    assert!(refused(&plain().replace("500 1 3", "500 -1 3")).contains("multiplier -1"));
    assert!(refused(&lm_63("0 90 200\n0", "1 1 1")).contains("200"));
    assert!(refused(&lm_63("-90 0 90\n0", "1 1 1")).contains("-90"));
    for nothing in ["", "IESNA91", "TILT=NONE", "TILT=INCLUDE\n1\n99999999\n0"] {
        refused(nothing);
    }
}

/// A EULUMDAT file: a tube 1.2 m long and 0.1 m wide, 1000 lm, of this symmetry, C-planes and
/// angles, and its intensities per 1000 lm.
fn ldt(symmetry: u32, planes: &[u32], angles: &[u32], values: &[&str]) -> String {
    let mut lines: Vec<String> = [
        "Firm",
        "2",
        &symmetry.to_string(),
        &planes.len().to_string(),
        "0",
        &angles.len().to_string(),
        "0",
        "report",
        "Lamp",
        "7",
        "lamp.ldt",
        "today",
        "1250",
        "150",
        "80",
        "1200",
        "100",
        "0",
        "0",
        "0",
        "0",
        "100",
        "80",
        "1",
        "0",
        "1",
        "1",
        "tube",
        "1000",
        "warm",
        "80",
        "30",
    ]
    .map(String::from)
    .to_vec();
    lines.extend((0..10).map(|_| "0.5".into()));
    lines.extend(planes.iter().chain(angles).map(u32::to_string));
    lines.extend(values.iter().map(|&value| value.into()));
    lines.join("\r\n")
}

#[test]
fn eulumdat_is_read() {
    let lamp = read(&ldt(1, &[0], &[0, 90, 180], &["10", "20", "30"]));
    assert_eq!((lamp.name.as_str(), lamp.lamp_flux, lamp.power), ("Firm Lamp", Some(1000.0), 30.0));
    // Length is along C = 90° here.
    assert_eq!((lamp.opening.size, lamp.opening.is_round), (DVec3::new(0.1, 1.2, 0.0), false));
    assert!(lamp.warnings.is_empty() && (lamp.intensity.flux() / (80.0 * PI) - 1.0).abs() < 1e-13);
    let planes = |symmetry, planes: &[u32], values: &[&str]| {
        around(&read(&ldt(symmetry, planes, &[0, 90], values)))
    };
    let eight: Vec<u32> = (0..8).map(|k| 45 * k).collect();
    let pairs = ["0", "1", "0", "2", "0", "3", "0", "4", "0", "5"];
    let all: Vec<&str> =
        (1..=8).flat_map(|k| ["0", ["", "1", "2", "3", "4", "5", "6", "7", "8"][k]]).collect();
    assert_eq!(planes(0, &eight, &all), [1., 2., 3., 4., 5., 6., 7., 8.]);
    assert_eq!(planes(1, &eight, &pairs[..2]), [1.0; 8]);
    assert_eq!(planes(2, &eight, &pairs), [1., 2., 3., 4., 5., 4., 3., 2.]);
    // From C = 270° over 0° to 90°.
    assert_eq!(planes(3, &eight, &pairs), [3., 4., 5., 4., 3., 2., 1., 2.]);
    assert_eq!(planes(4, &eight, &pairs[..6]), [1., 2., 3., 2., 1., 2., 3., 2.]);
}

#[test]
fn oddities_of_eulumdat_are_understood() {
    let plain = ldt(1, &[0], &[0, 90, 180], &["10", "20", "30"]);
    let whole = read(&plain);
    let line = |number: usize, text: &str| {
        let mut lines: Vec<&str> = plain.lines().collect();
        lines[number - 1] = text;
        read(&lines.join("\n"))
    };
    // Commas before fractions; several numbers in a line; absolute photometry.
    assert_eq!(line(24, "2,5").intensity.flux(), 2.5 * whole.intensity.flux());
    assert_eq!(read(&plain.replace("10\r\n20", "10 20")).intensity, whole.intensity);
    let absolute = line(27, "-1");
    assert_eq!((absolute.lamp_flux, &absolute.intensity), (None, &whole.intensity));
    // Twice the lamps' flux, twice the light; none known, and no factor.
    assert_eq!(line(29, "2000").intensity.flux(), 2.0 * whole.intensity.flux());
    assert!(warned(&line(29, "")).contains("without flux"));
    assert!(warned(&line(24, "0")).contains("factor 0"));
    // A round opening has no width; heights are told for four sides.
    let round = line(17, "0").opening;
    assert_eq!((round.size, round.is_round), (DVec3::new(1.2, 1.2, 0.0), true));
    assert_eq!(line(20, "50").opening.size.z, 0.05);
    // All planes in spite of a symmetry that needs one; numbers at the end; Windows-1252.
    let all = ldt(1, &[0, 90, 180, 270], &[0, 90], &["0", "1", "0", "2", "0", "3", "0", "4"]);
    let all = read(&all);
    assert!(warned(&all).contains("in spite of symmetry 1"));
    assert_eq!(around(&all), [1., 1.5, 2., 2.5, 3., 3.5, 4., 2.5]);
    assert!(warned(&read(&(plain.clone() + "\r\n1\r\n2"))).contains("2 numbers"));
    let mut bytes = plain.clone().into_bytes();
    bytes[0] = 0xdc;
    assert_eq!(read_photometry(Input::bytes("lamp", &bytes)).unwrap().name, "\u{dc}irm Lamp");
}

/// [`ldt`] of an even light with these sets of lamps: how many, lm and W.
fn with_lamp_sets(sets: &[(i32, &str, u32)]) -> String {
    let plain = ldt(1, &[0], &[0, 90, 180], &["10", "10", "10"]);
    let mut lines: Vec<String> = plain.lines().map(String::from).collect();
    lines[25] = sets.len().to_string();
    let set = |(k, (count, flux, watts)): (usize, &(i32, &str, u32))| {
        [count.to_string(), format!("tube {k}"), flux.to_string(), "warm".into(), "80".into()]
            .into_iter()
            .chain([watts.to_string()])
            .collect::<Vec<_>>()
    };
    lines.splice(26..32, sets.iter().enumerate().flat_map(set));
    lines.join("\n")
}

#[test]
fn one_of_several_sets_of_lamps_is_chosen() {
    let choose = |text: &str, lamp_set| {
        let mut settings = PhotometrySettings::default();
        settings.lamp_set = lamp_set;
        settings.read(Input::bytes("lamp", text.as_bytes()))
    };
    let sets = with_lamp_sets(&[(1, "3200", 36), (2, "8600", 116), (1, "5000", 58)]);
    let error = choose(&sets, None).unwrap_err().to_string();
    for word in ["lamp:26", "3 sets", "2: tube 1, 8600 lm, 116 W", "--lamp-set 1 to 3"] {
        assert!(error.contains(word), "{word}: {error}");
    }
    for (number, flux, watts) in [(1, 3200.0, 36.0), (2, 8600.0, 116.0), (3, 5000.0, 58.0)] {
        let lamp = choose(&sets, Some(number)).unwrap();
        // 10 cd/klm in all directions.
        let lumens = lamp.intensity.flux();
        assert!((lumens / (0.04 * PI * flux) - 1.0).abs() < 1e-13, "{lumens}");
        assert_eq!((lamp.lamp_flux, lamp.power), (Some(flux), watts));
    }
    for number in [0, 4] {
        assert!(choose(&sets, Some(number)).unwrap_err().to_string().contains("3 sets"));
    }
    // Sets that shine alike need no choice; a file with one takes it, whatever is chosen.
    let alike = with_lamp_sets(&[(1, "3200", 36), (1, "3200", 30)]);
    assert_eq!(choose(&alike, None).unwrap().power, 36.0);
    assert_eq!(choose(&alike, Some(2)).unwrap().power, 30.0);
    let one = with_lamp_sets(&[(1, "3200", 36)]);
    assert_eq!(choose(&one, Some(2)).unwrap(), choose(&one, None).unwrap());
    // Absolute intensities beside relative ones are another light.
    let absolute = with_lamp_sets(&[(-1, "3200", 36), (1, "3200", 36)]);
    assert!(choose(&absolute, None).is_err());
    assert_eq!(choose(&absolute, Some(1)).unwrap().lamp_flux, None);
    // No set at all.
    let none = choose(&with_lamp_sets(&[]), None).unwrap();
    assert!(warned(&none).contains("without flux"));
}

#[test]
fn broken_eulumdat_is_refused_with_its_line() {
    let plain = ldt(1, &[0], &[0, 90, 180], &["10", "20", "30"]);
    let line = |number: usize, text: &str| {
        let mut lines: Vec<&str> = plain.lines().collect();
        lines[number - 1] = text;
        refused(&lines.join("\n"))
    };
    assert!(line(3, "5").starts_with("lamp:3"));
    assert!(line(3, "x").contains("'x'") && line(3, "x").contains("LM-63"));
    assert!(line(4, "0").contains("C-planes 0"));
    assert!(line(4, "4000000000").contains("C-angle"));
    assert!(line(6, "4000000000").contains("angle"));
    assert!(line(6, "-1").contains("-1"));
    assert!(line(26, "21").contains("21 sets"));
    assert!(line(26, "-1").contains("-1 sets"));
    let short = plain.rsplit_once("\r\n").unwrap().0;
    assert!(refused(short).contains("2 intensities for 1 planes"));
    let said = refused(&ldt(4, &[0, 60, 120], &[0, 90], &["0", "1", "0", "2"]));
    assert!(said.contains("0° to 60° of symmetry 4"), "{said}");
    let said = refused(&ldt(2, &[190, 200], &[0, 90], &[]));
    assert!(said.contains("0 planes"), "{said}");
    for lines in 0..plain.lines().count() {
        let _ = refused(&plain.lines().take(lines).collect::<Vec<_>>().join("\n"));
    }
}
