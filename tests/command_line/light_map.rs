//! `radiosity light-map`.

use crate::{cornell, run};

#[test]
fn light_map_writes_all_it_says() {
    let folder = tempfile::tempdir().unwrap();
    let stem = folder.path().join("box.light");
    let mut args = vec![cornell(), "--out", stem.to_str().unwrap(), "--error", "0.3", "--cpu"];
    args.extend(["--size", "48", "--radiosity", "--write", "exr,glb,ply,png"]);
    let out = run("light-map", &args);
    let [said, told] = [&out.stdout, &out.stderr].map(|text| String::from_utf8_lossy(text));
    assert!(out.status.success(), "{told}");
    assert!(said.contains("48 × ") && said.contains(" charts, "), "{said}");
    assert!(told.contains("missing for 32 triangles"), "{told}");
    let read = |ending: &str| std::fs::read(folder.path().join(format!("box.light.{ending}")));
    let endings = ["exr", "radiosity.exr", "glb", "ply", "png"];
    let first = endings.map(|ending| read(ending).unwrap());
    assert!(first.iter().all(|bytes| bytes.len() > 1000));
    // What the program writes of a map can be verified. Vertices are shared within charts: between
    // half as many as faces, without seams, and three times as many.
    let ply = radiosity::read_ply(folder.path().join("box.light.ply")).unwrap();
    assert!(ply.faces.len() > 200, "{}", ply.faces.len());
    let shared = ply.positions.len() as f64 / ply.faces.len() as f64;
    assert!((0.5..1.0).contains(&shared), "{shared}");
    // Two runs, the same bytes.
    assert!(run("light-map", &args).status.success());
    assert!(first == endings.map(|ending| read(ending).unwrap()));
}

#[test]
fn light_map_has_as_many_texels_as_the_error_takes() {
    let folder = tempfile::tempdir().unwrap();
    let stem = folder.path().join("box");
    let stem = stem.to_str().unwrap();
    // In 64 × 64 texels the box is off by about 4 %; a finer bake makes no difference.
    for (error, pixels, words) in [("0.3", 64, "30 % reached"), ("0.03", 128, "3 % reached")] {
        let args = [cornell(), "--out", stem, "--error", error, "--cpu", "--write", "exr"];
        let out = run("light-map", &args);
        let said = String::from_utf8_lossy(&out.stdout);
        assert!(said.contains(&format!("light map  {pixels} × ")), "{error}: {said}");
        assert!(said.lines().last().is_some_and(|line| line.starts_with(words)), "{said}");
    }
    // With a number given, it says that they are too few.
    let args = [cornell(), "--out", stem, "--error", "0.03", "--cpu", "--size", "48"];
    let out = run("light-map", &args);
    let said = String::from_utf8_lossy(&out.stdout);
    let last = said.lines().last().unwrap();
    assert!(
        last.starts_with("3 % missed: ") && last.contains("more texels (--size) would do"),
        "{said}"
    );
}

#[test]
fn light_map_refuses_what_it_cannot_do() {
    for (args, words, status) in [
        (
            &["--coordinates", "file"][..],
            &["texture coordinates", "missing for 32 triangles"][..],
            1,
        ),
        (&["--coordinates", "odd"], &["auto, file, new"], 2),
        (&["--size", "9000"], &["9000", "8192"], 1),
        (&["--texel", "-1"], &["above 0"], 1),
        (&["--texel", "1e-9"], &["8192"], 1),
        (&["--error", "2"], &["error 2"], 1),
        (&["--write", "bmp"], &["exr, glb, ply, png"], 2),
        (&["--out", "/no/such/folder/a"], &["/no/such/folder"], 1),
        (&["--mesh-error", "1"], &["--mesh-error"], 2),
    ] {
        let out = run("light-map", &[&[cornell(), "--cpu"], args].concat());
        let told = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(status), "{args:?}: {told}");
        assert!(words.iter().all(|word| told.contains(word)), "{args:?}: {told}");
    }
}
