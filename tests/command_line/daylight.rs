//! `radiosity grid --weather` and `radiosity ugr`.

use crate::light::{ground, number, table};
use crate::weather::epw_at;
use crate::{run, texts, write};

/// Sun alone, day and night, at 0° north and east: it is up from about 6 to 18 h, so in all
/// occupied hours, and half of the year.
#[test]
fn a_year_of_sun_on_open_ground() {
    let folder = tempfile::tempdir().unwrap();
    let scene = ground(folder.path()).display().to_string();
    let weather = write(folder.path(), "sun.epw", &epw_at([0.0; 3], |_, _| [900.0, 0.0]));
    let weather = weather.display().to_string();
    let args = [&scene, "--weather", &weather, "--unit", "mm", "--up", "0,0,1"];
    let plane = ["--plane", "4000,0,3000,1000,0,0,0,1000,0", "--spacing", "1"];
    let out = run("grid", &[&args[..], &plane].concat());
    let [said, warned] = texts(&out);
    assert!(out.status.success(), "{warned}");
    let rows = table(&folder.path().join("ground.grid.csv"));
    assert_eq!(rows.len(), 2, "{rows:?}");
    let of = |name: &str| number(&rows[1][rows[0].iter().position(|cell| cell == name).unwrap()]);
    assert_eq!(of("sun_hours"), 3650.0);
    // The lowest sun, at 17:30 or 8:30 with 16 minutes of the equation of time, is 3° high.
    assert_eq!(
        (of("da_percent"), of("da_error"), of("udi_above_3000_percent")),
        (100.0, 0.0, 100.0)
    );
    assert_eq!((of("inside"), of("udi_below_100_percent")), (0.0, 0.0));
    // Nothing is reflected or random: 8760 hours of 900 W/m² by about 100 lm/W, times the mean of
    // the sine over day and night, cos δ/π, of which the equator's year has 0.3 on average.
    let exposure = 8760.0 * 9e4 * 0.305;
    let [found, error] = ["exposure_lxh", "exposure_error_lxh"].map(of);
    assert!((found / exposure - 1.0).abs() < 0.05 && error < 1e-9 * found, "{found} {error}");
    for words in ["sDA300/50% 100.0 %", "ASE1000,250 100.0 %", "mean DA300 100.0 %", "5 % reached"]
    {
        assert!(said.contains(words), "'{words}' not in: {said}");
    }
    assert!(folder.path().join("ground.grid.png").exists());

    // In another time zone the sun has set before the last of them.
    let east = epw_at([0.0, 0.0, 1.0], |_, _| [900.0, 0.0]);
    write(folder.path(), "sun.epw", &east);
    let hours = ["--hours", "17,20", "--target", "1e6"];
    let out = run("grid", &[&args[..], &plane, &hours].concat());
    let rows = table(&folder.path().join("ground.grid.csv"));
    let of = |name: &str| number(&rows[1][rows[0].iter().position(|cell| cell == name).unwrap()]);
    // 17 to 18 h is an hour before sunset; of the next some days have a sun in the middle of it,
    // 15 minutes high at most.
    assert!((365.0..=730.0).contains(&of("sun_hours")), "{rows:?}");
    assert_eq!(of("da_percent"), 0.0);
    assert!(texts(&out)[0].contains("sDA1000000/50% 0.0 %"), "{:?}", texts(&out));
}

#[test]
fn what_a_year_cannot_be_made_of_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let scene = ground(folder.path()).display().to_string();
    let weather = write(folder.path(), "sun.epw", &epw_at([0.0; 3], |_, _| [900.0, 0.0]));
    let args = [&scene, "--weather", weather.to_str().unwrap(), "--unit", "mm", "--up", "0,0,1"];
    for (more, word) in [
        (&["--sky", "1"][..], "leave out --sky"),
        (&["--hours", "18,8"], "the earlier first"),
        (&["--target", "0"], "above 0"),
        (&["--weather", "none.epw"], "none.epw"),
    ] {
        let out = run("grid", &[&args[..], more].concat());
        let error = &texts(&out)[1];
        assert!(!out.status.success() && error.contains(word), "'{word}' not in: {error}");
    }
    let out = run("grid", &[&scene, "--hours", "8,18"]);
    assert!(texts(&out)[1].contains("--weather"), "{:?}", texts(&out));
}

#[test]
fn glare_of_observers_is_printed_and_listed() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "lamp.mtl", "newmtl lamp\nKd 0 0 0\nKe 1000 1000 1000\n");
    let lamp = "mtllib lamp.mtl\nusemtl lamp\no panel\nv 4.9 -0.1 2\nv 4.9 0.1 2\nv 5.1 0.1 2\n\
                v 5.1 -0.1 2\nf 1 2 3 4\n";
    let scene = write(folder.path(), "lamp.obj", lamp).display().to_string();
    let args = [&scene, "--sky", "50", "--up", "0,0,1", "--observer", "0,0,0,1,0,0"];
    let out = run("ugr", &[&args[..], &["--observer", "0,0,0,-1,0,0"]].concat());
    let [said, warned] = texts(&out);
    assert!(out.status.success(), "{warned}");
    // As in `glare::rating_of_one_lamp_is_its_closed_form`.
    let rating = said.split("UGR ").nth(1).unwrap().split(' ').next().unwrap();
    let p2 = (2.0 * (33.98e-3 * 21.801_409 + 21e-5 * 21.801_409f64.powi(2))).exp();
    let truth = 8.0 * (0.25 / 50.0 * 1e6 * 0.08 / 29f64.powf(1.5) / p2).log10();
    // L_b is found to 0.5 %, 0.02, and the middle of the lamp stands for all of it, 0.012.
    assert!((number(rating) - truth).abs() < 0.1, "{said} {truth}");
    assert!(said.contains("observer 2: UGR undefined: no source in view"), "{said}");
    assert!(warned.contains("observer 2: behind it, and not counted: panel"), "{warned}");
    let rows = table(&folder.path().join("lamp.ugr.csv"));
    assert_eq!(rows.len(), 2, "{rows:?}");
    assert_eq!((&*rows[1][0], &*rows[1][1], &*rows[0][2]), ("1", "panel", "luminance"));
    assert!((number(&rows[1][2]) - 1000.0).abs() < 1e-9);
    for (observer, word) in [("0,0,0,0,0,1", "up"), ("1,2", "six numbers")] {
        let out = run("ugr", &[&scene, "--up", "0,0,1", "--observer", observer]);
        assert!(!out.status.success() && texts(&out)[1].contains(word), "{:?}", texts(&out));
    }
}
