//! What loading a file takes of memory, whatever the file says. Each file is loaded in a process of
//! its own, so that what one leaves behind is not counted with another.
#![cfg(target_os = "linux")]

use std::process::Command;

use radiosity::io::read_scene;
use radiosity::scene::WarningKind;

/// Most memory that this process ever had, bytes.
fn peak() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse::<usize>().unwrap() * 1024
}

/// Bytes of each file.
const BYTES: usize = 4 << 20;

/// The variable that tells a process which file it is to load.
const CASE: &str = "RADIOSITY_IMPORT_MEMORY_CASE";

/// An OBJ file, a library, `it.mtl`, and images by name.
struct Files {
    obj: Vec<u8>,
    mtl: Vec<u8>,
    images: Vec<(String, Vec<u8>)>,
    /// Bytes that the images may take beside those for each byte of the files.
    decoded: usize,
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn obj(text: impl Fn() -> String + 'static) -> Box<dyn Fn() -> Files> {
    Box::new(move || Files {
        obj: format!("{SQUARE}{}", text()).into_bytes(),
        mtl: vec![],
        images: vec![],
        decoded: 0,
    })
}

/// With a face that follows these lines.
fn mtl(before: &'static str, text: impl Fn() -> String + 'static) -> Box<dyn Fn() -> Files> {
    let obj = move || format!("{SQUARE}mtllib it.mtl\n{before}f 1 2 3\n");
    Box::new(move || Files {
        obj: obj().into_bytes(),
        mtl: text().into_bytes(),
        images: vec![],
        decoded: 0,
    })
}

/// As many copies of an image, each the texture of a material, and the bytes that a texel of those
/// takes that are read.
#[cfg(feature = "textures")]
fn textures(
    copies: usize,
    image: impl Fn() -> Vec<u8> + 'static,
    texel: usize,
) -> Box<dyn Fn() -> Files> {
    Box::new(move || {
        let each = |line: fn(usize) -> String| (0..copies).map(line).collect::<String>();
        let faces = each(|k| format!("usemtl {k}\nf 1 2 3\n"));
        Files {
            obj: format!("{SQUARE}mtllib it.mtl\n{faces}").into_bytes(),
            mtl: each(|k| format!("newmtl {k}\nKd 0.3\nmap_Kd {k}.png\n")).into_bytes(),
            images: (0..copies).map(|k| (format!("{k}.png"), image())).collect(),
            decoded: copies.min(MOST_IMAGES) * SIDE * SIDE * texel,
        }
    })
}

/// A texel of a texture: three bytes, a third of a mean, which has twelve, and four thirds of a
/// sixteenth of a sum, which has 24.
#[cfg(feature = "textures")]
const TEXEL: usize = 3 + 4 + 2;

/// Images of [`SIDE`] × [`SIDE`] texels that a scene may have.
#[cfg(feature = "textures")]
const MOST_IMAGES: usize = (1 << 27) / (SIDE * SIDE);

/// Texels along a side of an image.
#[cfg(feature = "textures")]
const SIDE: usize = 4096;

/// A black PNG image of [`SIDE`] × [`SIDE`] texels of so many bytes each, as small as it can be.
#[cfg(feature = "textures")]
fn png(depth: u8, colour: u8, bytes: usize) -> Vec<u8> {
    let size = (SIDE as u32).to_be_bytes();
    let header = [&size[..], &size, &[depth, colour, 0, 0, 0]].concat();
    let mut png = b"\x89PNG\r\n\x1a\n".to_vec();
    for (kind, data) in
        [(b"IHDR", header), (b"IDAT", zeros(SIDE * (1 + SIDE * bytes))), (b"IEND", vec![])]
    {
        png.extend((data.len() as u32).to_be_bytes());
        let start = png.len();
        png.extend(kind);
        png.extend(data);
        // The checksum of PNG (ISO 3309).
        let crc = png[start..].iter().fold(!0u32, |crc, &byte| {
            let bit = |c: u32| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 };
            (0..8).fold(crc ^ u32::from(byte), |c, _| bit(c))
        });
        png.extend((!crc).to_be_bytes());
    }
    png
}

/// So many zeros, one and the rest in runs of 258, as a zlib stream (RFC 1950) of one block with
/// the fixed codes of deflate (RFC 1951, 3.2.6).
#[cfg(feature = "textures")]
fn zeros(count: usize) -> Vec<u8> {
    let (mut stream, mut bits, mut used) = (vec![0x78, 0xda], 0u32, 0);
    let mut code = |stream: &mut Vec<u8>, code: u32, length: u32| {
        bits |= code << used;
        used += length;
        while used >= 8 {
            stream.push(bits as u8);
            (bits, used) = (bits >> 8, used - 8);
        }
    };
    code(&mut stream, 0b011, 3);
    let runs = (count - 1) / 258;
    for _ in 0..count - 258 * runs {
        // Literal 0, codes from the highest bit on.
        code(&mut stream, 0b0000_1100, 8);
    }
    for _ in 0..runs {
        // Length 258, distance 1.
        code(&mut stream, 0b1010_0011, 8);
        code(&mut stream, 0, 5);
    }
    code(&mut stream, 0, 7 + 7);
    // Adler-32: the sum of the bytes and 1, and the sum of these sums.
    stream.extend((((count % 65521) << 16 | 1) as u32).to_be_bytes());
    stream
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
    let latin_1 = || Files {
        obj: [SQUARE.as_bytes(), &[0xe9; BYTES], b"\nf 1 2 3\n"].concat(),
        mtl: vec![],
        images: vec![],
        decoded: 0,
    };
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
        #[cfg(feature = "textures")]
        textures(1, || png(8, 2, 3), TEXEL),
        #[cfg(feature = "textures")]
        textures(1, || png(8, 6, 4), TEXEL),
        // Is there in 16 bits and in 8 before its means are made.
        #[cfg(feature = "textures")]
        textures(1, || png(16, 6, 8), 8 + 3),
        #[cfg(feature = "textures")]
        textures(MOST_IMAGES + 1, || png(8, 2, 3), TEXEL),
    ]
}

/// Loads the files of a case, and prints how much memory that took, in bytes for each of theirs:
/// what is more than the images may take.
#[test]
fn loads_a_case() {
    let Some(case) = std::env::var(CASE).ok().and_then(|case| case.parse::<usize>().ok()) else {
        return;
    };
    let Files { obj, mtl, images, decoded } = cases().remove(case)();
    let mut files = vec![("it.mtl", &mtl[..])];
    files.extend(images.iter().map(|(name, bytes)| (&name[..], &bytes[..])));
    let bytes = obj.len() + files.iter().map(|(_, bytes)| bytes.len()).sum::<usize>();
    let start = peak();
    let scene = read_scene("it.obj", &obj, &files);
    let taken = peak() - start;
    if let (Ok(scene), [_, _, ..]) = (&scene, &images[..]) {
        let large = scene.warnings().iter().find(|w| w.kind == WarningKind::LargeTexture);
        assert_eq!(large.unwrap().count, 1);
        assert_eq!(scene.material(images.len() - 1).reflectance.to_array(), [0.3; 3]);
        assert!(scene.textures(images.len() - 1).is_none() && scene.textures(0).is_some());
    }
    println!("factor {}", taken.saturating_sub(decoded) as f64 / bytes as f64);
}

#[test]
fn peak_memory_is_bounded_by_file_size() {
    for case in 0..cases().len() {
        let mut loading = Command::new(std::env::current_exe().unwrap());
        loading.args(["--exact", "loads_a_case", "--nocapture"]).env(CASE, case.to_string());
        let said = loading.output().unwrap();
        assert!(said.status.success(), "case {case}: {said:?}");
        let said = String::from_utf8_lossy(&said.stdout).into_owned();
        let factor = said.lines().find_map(|line| line.rsplit_once("factor ")).unwrap().1;
        println!("case {case}: {factor} bytes a byte");
        // The corner of a polygon, of two bytes, becomes 24 bytes in tobj, which go again, an
        // index, a place in space and a triangle of 28 bytes; a model, of some 17 bytes, some 600
        // in tobj; a material, of nine bytes or more, some 350.
        assert!(factor.parse::<f64>().unwrap() < 60.0, "case {case}: {factor} bytes a byte");
    }
}
