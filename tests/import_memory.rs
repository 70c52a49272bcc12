//! What loading a file takes of memory, whatever the file says. Each file is loaded in a process of
//! its own, so that what one leaves behind is not counted with another.
#![cfg(target_os = "linux")]

use std::process::Command;

use radiosity::io::read_obj;

/// Most memory that this process ever had, bytes.
fn peak() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse::<usize>().unwrap() * 1024
}

/// Bytes of each file.
const BYTES: usize = 8 << 20;

/// The variable that tells a process which file it is to load.
const CASE: &str = "RADIOSITY_IMPORT_MEMORY_CASE";

/// An OBJ file and a library, `it.mtl`.
type Files = (Vec<u8>, Vec<u8>);

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn obj(text: impl Fn() -> String + 'static) -> Box<dyn Fn() -> Files> {
    Box::new(move || (format!("{SQUARE}{}", text()).into_bytes(), vec![]))
}

/// With a face that follows these lines.
fn mtl(before: &'static str, text: impl Fn() -> String + 'static) -> Box<dyn Fn() -> Files> {
    let obj = move || format!("{SQUARE}mtllib it.mtl\n{before}f 1 2 3\n");
    Box::new(move || (obj().into_bytes(), text().into_bytes()))
}

fn many(line: &str) -> String {
    line.repeat(BYTES / line.len())
}

/// Lines of this keyword, each with another name, and what comes between them.
fn names(keyword: &str, between: &str) -> String {
    let line = |i| format!("{keyword} {i:x}\n{between}");
    (0..BYTES / line(1 << 16).len()).map(line).collect()
}

/// How to make each pair of files.
fn cases() -> Vec<Box<dyn Fn() -> Files>> {
    let latin_1 = || ([SQUARE.as_bytes(), &[0xe9; BYTES], b"\nf 1 2 3\n"].concat(), vec![]);
    vec![
        obj(|| many("f 1\n")),
        obj(|| many("f 1 2 3\n")),
        obj(|| many("f 1 2 3 4\n")),
        // Numbers as short as they can be, so that what is made of them is the most.
        obj(|| format!("f {}\n", "1 2 3 4 ".repeat(BYTES / 8))),
        obj(|| format!("f {}\n", "1 ".repeat(BYTES / 2))),
        obj(|| many("v 0 0 0\n")),
        obj(|| many("\n")),
        obj(|| many("x\n")),
        obj(|| many("\\\n")),
        obj(|| "\0".repeat(BYTES)),
        obj(|| names("g", "f 1\n")),
        obj(|| names("g", "f 1 2 3\n")),
        obj(|| names("o", "")),
        obj(|| many("s 1\n")),
        obj(|| many("g a\nf 1\n")),
        obj(|| many("f 1 2 3\ng\nf 1 2 3\ng a\n")),
        obj(|| many("f 1 2 3\ns\nf 1 2 3\ns 1\n")),
        obj(|| many("usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n")),
        obj(|| many("vt 0 0\n")),
        obj(|| format!("vt 0 0\n{}", many("f 1/1 2/1 3/1\n"))),
        obj(|| format!("vt 0 0\nf {}\n", "1/1 2/1 3/1 ".repeat(BYTES / 12))),
        obj(|| names("usemtl", "f 1 2 3\n")),
        obj(|| many("p 1\n")),
        obj(|| {
            format!(
                "g {}\n{}",
                "x".repeat(BYTES / 2),
                "f 1 2 3\ng\nf 1 2 3\ns\n".repeat(BYTES / 40)
            )
        }),
        obj(|| format!("mtllib{}\n", " x".repeat(BYTES / 2))),
        obj(|| names("mtllib", "")),
        Box::new(latin_1),
        mtl("usemtl 1\n", || names("newmtl", "")),
        mtl("usemtl a\n", || many("newmtl a\n")),
        mtl("usemtl 1\n", || names("newmtl", "Kd 0\n")),
        mtl("usemtl 1\n", || names("newmtl", "map_Kd a\n")),
        mtl("usemtl a\n", || format!("newmtl a\n{}", many("d 1\n"))),
    ]
}

/// Loads the files of a case, and prints how much memory that took, in bytes for each of theirs.
#[test]
fn loads_a_case() {
    let Some(case) = std::env::var(CASE).ok().and_then(|case| case.parse::<usize>().ok()) else {
        return;
    };
    let (obj, mtl) = cases().remove(case)();
    let start = peak();
    let _ = read_obj("it.obj", &obj, &[("it.mtl", &mtl)]);
    println!("factor {}", (peak() - start) as f64 / (obj.len() + mtl.len()) as f64);
}

#[test]
fn peak_memory_is_bounded_by_file_size() {
    for case in 0..cases().len() {
        let mut loading = Command::new(std::env::current_exe().unwrap());
        loading.args(["--exact", "loads_a_case", "--nocapture"]).env(CASE, case.to_string());
        let said = loading.output().unwrap();
        let said = String::from_utf8_lossy(&said.stdout).into_owned();
        let factor = said.lines().find_map(|line| line.rsplit_once("factor ")).unwrap().1;
        println!("case {case}: {factor} bytes a byte");
        // The corner of a polygon, of two bytes, becomes 24 bytes in tobj, which go again, an
        // index, a place in space and a triangle of 28 bytes; a model, of some 17 bytes, some 600
        // in tobj; a material, of nine bytes or more, some 350.
        assert!(factor.parse::<f64>().unwrap() < 60.0, "case {case}: {factor} bytes a byte");
    }
}
