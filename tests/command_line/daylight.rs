//! `radiosity ugr`.

use crate::light::{number, table};
use crate::{run, texts, write};

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
