//! What loading a file takes of memory, whatever the file says.
#![cfg(target_os = "linux")]

use radiosity::io::read_obj;

/// Most memory that this process ever had, bytes.
fn peak() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse::<usize>().unwrap() * 1024
}

#[test]
fn peak_memory_is_bounded_by_file_size() {
    const BYTES: usize = 8 << 20;
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    // Numbers as short as they can be, so that what is made of them is the most.
    let corners = "1 2 3 4 ".repeat(BYTES / 8);
    let many = |line: &str| line.repeat(BYTES / line.len());
    let names = |keyword: &str, between: &str| -> String {
        let line = |i| format!("{keyword} {i:x}\n{between}");
        (0..BYTES / line(1 << 16).len()).map(line).collect()
    };
    let objs = [
        many("f 1\n"),
        many("f 1 2 3\n"),
        many("f 1 2 3 4\n"),
        format!("f {corners}\n"),
        format!("f {}\n", "1 ".repeat(BYTES / 2)),
        many("v 0 0 0\n"),
        many("\n"),
        many("x\n"),
        many("\\\n"),
        "\0".repeat(BYTES),
        names("g", "f 1\n"),
        names("o", ""),
        many("s 1\n"),
        many("g a\nf 1\n"),
        many("f 1 2 3\ng\nf 1 2 3\ng a\n"),
        many("f 1 2 3\ns\nf 1 2 3\ns 1\n"),
        many("usemtl\nf 1 2 3\nusemtl a\nf 1 2 3\n"),
        many("vt 0 0\n"),
        format!("vt 0 0\n{}", many("f 1/1 2/1 3/1\n")),
        format!("vt 0 0\nf {}\n", "1/1 2/1 3/1 ".repeat(BYTES / 12)),
        names("usemtl", "f 1 2 3\n"),
        many("p 1\n"),
        format!("g {}\n{}", "x".repeat(BYTES / 2), "f 1 2 3\ng\nf 1 2 3\ns\n".repeat(BYTES / 40)),
        format!("mtllib{}\n", " x".repeat(BYTES / 2)),
        names("mtllib", ""),
        "\u{e9}".repeat(BYTES / 2).chars().map(|c| c as u8 as char).collect(),
    ];
    let mtls = [names("newmtl", ""), many("newmtl a\n"), names("newmtl", "Kd 0\n"), many("d 1\n")];
    let start = peak();
    let mut highest = start;
    let mut check = |what: &str, obj: &str, mtl: &str| {
        let mtl = mtl.as_bytes();
        let _ = read_obj("it.obj", obj.as_bytes(), &[("it.mtl", mtl)]);
        let text = &what[..what.len().min(20)];
        println!("{text:?}: {:.1} bytes a byte", (peak() - start) as f64 / BYTES as f64);
        highest = peak();
    };
    for obj in &objs {
        check(obj, &format!("{square}{obj}"), "");
    }
    for mtl in &mtls {
        check(mtl, &format!("{square}mtllib it.mtl\nusemtl 1\nf 1 2 3\n"), mtl);
    }
    // The corner of a polygon, of two bytes, becomes 24 bytes in tobj, which go again, an index, a
    // place in space and a triangle of 28 bytes; a model, of some ten bytes, some 300 in tobj.
    let factor = (highest - start) as f64 / BYTES as f64;
    assert!(factor < 60.0, "{factor} bytes a byte");
}
