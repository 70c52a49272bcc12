//! Rays on the CPU give the same light, bit for bit, on every platform.
//!
//! `data/same_bytes.json` has eight bakes and the SHA-256 of the PLY file of each, made on x86-64.
//! The same table is read by the tests of the page (WebAssembly), and this test runs on other
//! targets by an emulator:
//!
//! ```sh
//! target=CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU
//! export ${target}_LINKER=aarch64-linux-gnu-gcc
//! export ${target}_RUNNER="qemu-aarch64-static -L /usr/aarch64-linux-gnu"
//! cargo test --release --target aarch64-unknown-linux-gnu --no-default-features \
//!     --features glb,textures --test same_bytes
//! ```
//!
//! A change of the light that is meant changes the hashes: the test prints the new table.

#![cfg(all(feature = "glb", feature = "textures"))]

use std::ops::ControlFlow;
use std::path::Path;

use radiosity::{Backend, BakeTarget, Rgb, SceneSettings, write_ply};
use serde_json::Value;
use sha2::{Digest as _, Sha256};

#[test]
fn eight_bakes_have_the_same_bytes_on_every_platform() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let table = std::fs::read_to_string(folder.join("tests/data/same_bytes.json")).unwrap();
    let bakes: Vec<Value> = serde_json::from_str(&table).unwrap();
    let hashes: Vec<String> = bakes.iter().map(|bake| hash_of(folder, bake)).collect();
    let changed: Vec<String> = bakes
        .iter()
        .zip(&hashes)
        .filter(|(bake, hash)| bake["sha256"] != **hash)
        .map(|(bake, hash)| format!("{} to {}: {hash}", bake["scene"], bake["error"]))
        .collect();
    assert!(bakes.len() == 8 && changed.is_empty(), "{}", changed.join("\n"));
}

/// SHA-256 of the PLY file of a bake with rays on the CPU.
fn hash_of(folder: &Path, bake: &Value) -> String {
    let mut settings = SceneSettings::default();
    let colours = |name: &str| {
        let of = bake[name].as_object().into_iter().flatten();
        of.map(|(material, colour)| (material.clone(), rgb(colour))).collect()
    };
    (settings.emit, settings.transmit) = (colours("emit"), colours("transmit"));
    settings.sky = bake.get("sky").map(|sky| rgb(sky).into());
    let scene = settings.load(folder.join(bake["scene"].as_str().unwrap())).unwrap();
    let target = BakeTarget::Error(bake["error"].as_f64().unwrap());
    let baked = target.bake(scene, &Backend::Cpu, |_| ControlFlow::Continue(())).unwrap();
    let mut bytes = vec![];
    write_ply(&mut bytes, &baked.light.surface).unwrap();
    Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

fn rgb(colour: &Value) -> Rgb {
    Rgb::from_array([0, 1, 2].map(|k| colour[k].as_f64().unwrap()))
}
