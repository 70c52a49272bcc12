//! Lets tests that need a graphics adapter show as ignored where RADIOSITY_NO_GPU is set.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=RADIOSITY_NO_GPU");
    println!("cargo::rustc-check-cfg=cfg(skip_gpu_tests)");
    if std::env::var_os("RADIOSITY_NO_GPU").is_some() {
        println!("cargo::rustc-cfg=skip_gpu_tests");
    }
}
