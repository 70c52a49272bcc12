//! Luminaires, as the program takes them.

use std::path::Path;

use crate::{refused, room, run, write};

/// An LM-63 file of a point that sends 100 cd in all directions.
const EVEN: &str = "IESNA:LM-63-2002\n[LUMINAIRE] Bulb\nTILT=NONE\n\
                    1 -1 1 2 1 1 2 0 0 0\n1 1 9\n0 180\n0\n100 100\nleft\n";

/// The solution and the report of the room `scene` with these `options`.
fn baked(scene: &Path, options: &[&str]) -> (radiosity::VertexMesh, serde_json::Value, String) {
    let scene_name = scene.display().to_string();
    let mut args = vec![scene_name.as_str(), "--error", "0.1", "--cpu", "--write", "json,ply"];
    args.extend(options);
    let out = run("bake", &args);
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(out.status.success(), "{said}");
    let json = std::fs::read(scene.with_extension("json")).unwrap();
    let table = said + &String::from_utf8(out.stdout).unwrap();
    let solution = radiosity::io::read_ply(scene.with_extension("ply")).unwrap();
    (solution, serde_json::from_slice(&json).unwrap(), table)
}

#[test]
fn luminaires_light_a_room_and_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let scene = write(folder.path(), "room.obj", &room(6));
    let lamp = write(folder.path(), "bulb.ies", EVEN).display().to_string();
    let at = format!("{lamp}@0.5,0.4,0.6");
    let (solution, report, said) = baked(&scene, &["--luminaire", &at]);
    assert!(solution.radiosity.iter().all(|b| b.x > 0.0));
    // 100 cd all around.
    let lumens = report["luminaires"][0]["lumens"][0].as_f64().unwrap();
    assert!((lumens / (400.0 * std::f64::consts::PI) - 1.0).abs() < 1e-12, "{lumens}");
    assert_eq!(report["luminaires"][0]["name"], "Bulb");
    assert!(report["warnings"][0].as_str().unwrap().contains("bulb.ies: 1 words"), "{report}");
    assert!(said.contains("(Bulb): 1 of 1256.6 lm") && !said.contains("sky of"), "{said}");
    // Without them it is another scene; with them it is what it was.
    let (scene_name, ply) = (scene.display().to_string(), scene.with_extension("ply"));
    let ply = ply.display().to_string();
    let verify = |more: &[&str]| {
        let out = run("verify", &[&[scene_name.as_str(), ply.as_str()][..], more].concat());
        (out.status.success(), String::from_utf8(out.stderr).unwrap())
    };
    let (fine, said) = verify(&["--sky", "none"]);
    assert!(!fine && said.contains("baked with 1 luminaires"), "{said}");
    let (fine, said) = verify(&["--luminaire", &at, "--precision", "1"]);
    assert!(fine, "{said}");
    // Without the report nobody knows.
    std::fs::remove_file(scene.with_extension("json")).unwrap();
    let (fine, said) = verify(&["--luminaire", &at, "--precision", "1"]);
    assert!(fine, "{said}");
    // A list with the lamp twice at half of its light, one aimed somewhere; in millimetres.
    let list = r#"[{"file": "bulb.ies", "at": [500, 400, 600], "scale": 0.5},
                   {"file": "bulb.ies", "at": [500, 400, 600], "aim": [1, 0, 0], "c0": [0, 0, 1],
                    "scale": [0.5, 0.5, 0.5]}]"#;
    let list = write(folder.path(), "lamps.json", list).display().to_string();
    let large = room(6).lines().map(in_mm).collect::<Vec<_>>().join("\n");
    let large = write(folder.path(), "large.obj", &large);
    let (same, report, _) = baked(&large, &["--luminaires", &list, "--unit", "mm"]);
    assert_eq!(report["luminaires"].as_array().unwrap().len(), 2);
    let brightest = |s: &radiosity::VertexMesh| s.radiosity.iter().map(|b| b.x).fold(0.0, f64::max);
    let ratio = brightest(&same) / brightest(&solution);
    // The same light in another unit, to half of the error asked for.
    assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
}

/// A line of an OBJ file in metres, in millimetres.
fn in_mm(line: &str) -> String {
    let Some(numbers) = line.strip_prefix("v ") else { return line.into() };
    let scaled = numbers.split_whitespace().map(|n| (1e3 * n.parse::<f64>().unwrap()).to_string());
    format!("v {}", scaled.collect::<Vec<_>>().join(" "))
}

#[test]
fn wrong_luminaires_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let scene = write(folder.path(), "room.obj", &room(6)).display().to_string();
    let lamp = write(folder.path(), "bulb.ies", EVEN).display().to_string();
    for (option, value, words) in [
        ("--luminaire", lamp.clone(), "FILE@x,y,z"),
        ("--luminaire", format!("{lamp}@1,2"), "FILE@x,y,z"),
        ("--luminaire", format!("{lamp}@1,2,3:1,2"), "FILE@x,y,z"),
        ("--luminaire", format!("{lamp}@1,2,3:0,0,1:1,0,0:0,0,1"), "FILE@x,y,z"),
        ("--luminaire", format!("{lamp}@1,2,3*x"), "FILE@x,y,z"),
        ("--luminaire", format!("{lamp}@1,2,3:0,0,0"), "aim"),
        ("--luminaire", format!("{lamp}@1,2,3:0,0,1:0,0,2"), "C = 0"),
        ("--luminaire", format!("{lamp}@1,2,3*-1"), "at least 0"),
        ("--luminaire", format!("{scene}@1,2,3"), "LM-63"),
        ("--luminaire", "nothing.ies@1,2,3".into(), "nothing.ies"),
        ("--luminaires", "nothing.json".into(), "nothing.json"),
        ("--luminaires", scene.clone(), "\"at\""),
        ("--unit", "0".into(), "above 0"),
    ] {
        refused(&[&scene, option, &value], &[words]);
    }
}

#[test]
fn sets_of_lamps_are_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let scene = write(folder.path(), "room.obj", &room(6));
    // Symmetric about its axis, 50 cd/klm in all directions; lamps of 1000 or of 3000 lm.
    let head = "Firm\n1\n1\n1\n0\n3\n0\n\nBulb\n\n\n\n0\n0\n0\n0\n0\n0\n0\n0\n0\n100\n100\n1\n0\n";
    let sets = "2\n1\ndim\n1000\nwarm\n80\n9\n1\nbright\n3000\nwarm\n80\n25\n";
    let text = format!("{head}{sets}{}0\n0\n90\n180\n50\n50\n50\n", "0.5\n".repeat(10));
    let lamp = write(folder.path(), "two.ldt", &text).display().to_string();
    let at = format!("{lamp}@0.5,0.4,0.6");
    let words = ["two.ldt:26", "1: dim, 1000 lm, 9 W; 2: bright", "--lamp-set 1 to 2"];
    refused(&[scene.to_str().unwrap(), "--luminaire", &at], &words);
    let (_, report, _) = baked(&scene, &["--luminaire", &at, "--lamp-set", "2"]);
    let lumens = report["luminaires"][0]["lumens"][0].as_f64().unwrap();
    // 150 cd all around.
    assert!((lumens / (600.0 * std::f64::consts::PI) - 1.0).abs() < 1e-12, "{report}");
    assert_eq!(report["luminaires"][0]["watts"], 25.0);
}

#[test]
fn luminaires_light_bands_as_the_file_says() {
    let folder = tempfile::tempdir().unwrap();
    let scene = write(folder.path(), "room.obj", &room(6));
    let lamp = write(folder.path(), "bulb.ies", EVEN).display().to_string();
    let at = format!("{lamp}@0.5,0.4,0.6*4");
    let file = |luminaires: &str| {
        let head = r#"{"bands": ["a", "b"], "materials": {"*": {"reflectance": 0.5}}"#;
        let text = format!("{head}{luminaires}}}");
        write(folder.path(), "bands.json", &text).display().to_string()
    };
    let name = scene.display().to_string();
    let args = |bands: &str| {
        let lit = ["--luminaire", &at, "--bands", bands, "--error", "0.1", "--cpu"];
        let args: Vec<String> = lit.map(String::from).into();
        args
    };
    let with = |args: &[String]| -> Vec<String> {
        [&[name.clone(), "--write".into(), "csv".into()], args].concat()
    };
    let all = with(&args(&file(", \"luminaires\": [0, 0.25]")));
    let out = run("bake", &all.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let table = std::fs::read_to_string(scene.with_extension("bands.csv")).unwrap();
    let mut lines = table.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| names.iter().position(|n| n.starts_with(name)).unwrap();
    let (a, b) = (column("irradiance_a"), column("irradiance_b"));
    for line in lines {
        let values: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        // 100 cd times 4 times 0.25, straight, from a third of a metre to one, and reflected.
        assert!(values[a] == 0.0 && (30.0..5000.0).contains(&values[b]), "{line}");
    }
    let all = with(&args(&file("")));
    let all: Vec<&str> = all.iter().map(String::as_str).collect();
    refused(&all, &["nothing of luminaires", "or 0"]);
}
