//! `--emit`, and materials that are not what they should be.

use crate::{lit_plates, refused, run, texts, write};

#[test]
fn names_that_are_no_material_are_explained() {
    let folder = tempfile::tempdir().unwrap();
    let lit = lit_plates(folder.path()).display().to_string();
    let emit = |scene: &str, name: &str, words: &[&str]| {
        let value = format!("{name}=5");
        refused(&[scene, "--cpu", "--emit", &value], words);
    };
    emit(&lit, "Lamp", &["no material 'Lamp'", "did you mean 'lamp'?", "'grey'"]);
    emit(&lit, "lmap", &["did you mean 'lamp'?"]);
    emit(&lit, "floor", &["'floor' is a group, of material 'grey'; name the material"]);
    refused(&[&lit, "--transmit", "gray=0.5"], &["'gray'", "did you mean 'grey'?"]);
    let triangle = |group: &str, material: &str| {
        format!("o {group}\nusemtl {material}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n")
    };
    write(folder.path(), "m.mtl", "newmtl white\nKd 0.5 0.5 0.5\nnewmtl black\nKd 0 0 0\n");
    let walls: String = ["lamp", "wall", "floor"].map(|group| triangle(group, "white")).concat();
    let shared = write(folder.path(), "shared.obj", &format!("mtllib m.mtl\n{walls}"));
    let want = "'lamp' is a group, of material 'white', which 3 groups share; \
                give it a material of its own";
    emit(shared.to_str().unwrap(), "lamp", &[want]);
    let both = triangle("lamp", "white") + &triangle("lamp", "black");
    let both = write(folder.path(), "both.obj", &format!("mtllib m.mtl\n{both}"));
    emit(both.to_str().unwrap(), "lamp", &["'lamp' is a group, of materials 'white', 'black'"]);
}

#[test]
fn lamps_that_are_put_out_are_told_with_the_sky() {
    let folder = tempfile::tempdir().unwrap();
    let scene = lit_plates(folder.path()).display().to_string();
    let told = |more: &[&str]| {
        let mut args = vec![&*scene, "--cpu", "--write", "json", "--error", "0.5"];
        args.extend(more);
        texts(&run("bake", &args))[1].clone()
    };
    let dark = told(&["--emit", "lamp=0"]);
    let want = "no light in the scene: what was told to emit emits 0; lit from outside by a sky of \
                radiance 1;";
    assert!(dark.contains(want) && dark.contains("('lamp')"), "{dark}");
    let left_dark = told(&["--emit", "lamp=0", "--sky", "none"]);
    assert!(left_dark.contains("emits 0; left dark"), "{left_dark}");
    assert!(!told(&["--emit", "lamp=0", "--sky", "2"]).contains("no light in the scene"));
    assert!(!told(&["--emit", "lamp=2"]).contains("no light in the scene"));
}

#[test]
fn whole_words_say_light() {
    let folder = tempfile::tempdir().unwrap();
    let told = |names: [&str; 2]| {
        let faces = names.map(|name| format!("usemtl {name}\nf 1 2 3\nf 1 3 4\n")).concat();
        let corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
        let scene = write(folder.path(), "m.obj", &format!("{corners}{faces}"));
        let scene = scene.display().to_string();
        texts(&run("bake", &[&scene, "--cpu", "--write", "json", "--error", "0.5"]))[1].clone()
    };
    let glass = told(["Translucent_Glass_Blue", "slightly_grey"]);
    assert!(glass.contains("no light") && !glass.contains("say light"), "{glass}");
    let lamp = told(["slightly_grey", "deskLamp_2"]);
    assert!(lamp.contains("these names say light") && lamp.contains("('deskLamp_2')"), "{lamp}");
}

#[test]
fn unknown_materials_are_told_with_those_of_the_library() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "viking.mtl", "newmtl room\nKd 0.5 0.5 0.5\n");
    let scene = "mtllib viking.mtl\nusemtl Texture\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let scene = write(folder.path(), "viking.obj", scene).display().to_string();
    let told =
        texts(&run("bake", &[&scene, "--cpu", "--write", "json", "--error", "0.5"]))[1].clone();
    let want = "they are grey, reflectance 0.5; viking.mtl has 'room' ('Texture')";
    assert!(told.contains(want), "{told}");
}
