//! EXR and PNG files.

use radiosity::camera::RadianceImage;
use radiosity::io::ToneCurve;
use radiosity::{ErrorKind, Rgb, write_exr, write_png};

/// 4 × 3 pixels, all different, red from 0 to 11 and green even.
fn image() -> RadianceImage {
    let pixel = |k: u32| Rgb::new(f64::from(k), 0.25, 1e-3 * f64::from(k));
    RadianceImage {
        width: 4,
        height: 3,
        pixels: (0..12).map(pixel).collect(),
        sky: vec![false; 12],
    }
}

#[test]
fn exr_reads_back_bit_for_bit() {
    let (image, folder) = (image(), tempfile::tempdir().unwrap());
    let path = folder.path().join("i.exr");
    write_exr(&path, &image).unwrap();
    let read = exr::prelude::read_first_rgba_layer_from_file(
        &path,
        |size, _| vec![[0f32; 3]; size.area()],
        |store, at, (r, g, b, _): (f32, f32, f32, f32)| store[at.y() * 4 + at.x()] = [r, g, b],
    )
    .unwrap();
    let want: Vec<[f32; 3]> = image.pixels.iter().map(|c| c.as_vec3().to_array()).collect();
    assert_eq!(read.layer_data.channel_data.pixels, want);
}

/// Engines that read no tiles read this.
#[test]
fn exr_has_blocks_of_scan_lines() {
    let folder = tempfile::tempdir().unwrap();
    for (width, height) in [(4, 3), (1, 1), (70, 33)] {
        let path = folder.path().join(format!("{width}.exr"));
        let count = width * height;
        let pixels = (0..count).map(|k| Rgb::splat(f64::from(k))).collect();
        let sky = vec![false; count as usize];
        write_exr(&path, &RadianceImage { width, height, pixels, sky }).unwrap();
        let meta = exr::meta::MetaData::read_from_file(&path, true).unwrap();
        let [header] = &meta.headers[..] else { panic!("one part: {meta:?}") };
        assert!(!meta.requirements.is_single_layer_and_tiled);
        assert_eq!(header.blocks, exr::meta::BlockDescription::ScanLines);
        assert_eq!(header.compression, exr::compression::Compression::ZIP16);
        assert_eq!(header.line_order, exr::meta::attribute::LineOrder::Increasing);
        assert_eq!(header.chunk_count, height.div_ceil(16) as usize);
        let channels = &header.channels.list;
        let names: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
        assert_eq!(names, ["B", "G", "R"]);
        let float = exr::meta::attribute::SampleType::F32;
        assert!(channels.iter().all(|c| c.sample_type == float && c.sampling.area() == 1));
    }
}

/// Blocks that several threads compress may come in any order.
#[test]
fn exr_has_the_same_bytes_on_every_run() {
    let folder = tempfile::tempdir().unwrap();
    let (width, height) = (64, 1024);
    let pixel = |k: u32| Rgb::splat(f64::from(k.wrapping_mul(2_654_435_761) % 1009));
    let image = RadianceImage {
        width,
        height,
        pixels: (0..width * height).map(pixel).collect(),
        sky: vec![false; (width * height) as usize],
    };
    let bytes = |k: u32| {
        let path = folder.path().join(format!("{k}.exr"));
        write_exr(&path, &image).unwrap();
        std::fs::read(path).unwrap()
    };
    let first = bytes(0);
    assert!((1..10).all(|k| bytes(k) == first));
}

#[test]
fn png_has_every_pixel_through_the_tone_curve() {
    let (image, folder) = (image(), tempfile::tempdir().unwrap());
    let path = folder.path().join("i.png");
    write_png(&path, &image).unwrap();
    let read = ::image::open(&path).unwrap();
    assert_eq!(read.color(), ::image::ColorType::Rgb8);
    let read = read.into_rgb8();
    assert_eq!(read.dimensions(), (4, 3));
    // Row after row from the top left.
    let tone = ToneCurve::fit(&image.pixels);
    let want: Vec<u8> = image.pixels.iter().flat_map(|&colour| tone.display(colour)).collect();
    assert_eq!(read.into_raw(), want);
}

#[test]
fn exr_rejects_values_beyond_floats() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let image = |value: f64| {
        let mut pixels = vec![Rgb::ONE; 6];
        pixels[4] = Rgb::splat(value);
        RadianceImage { width: 3, height: 2, pixels, sky: vec![false; 6] }
    };
    write_exr(&path, &image(1e30)).unwrap();
    for value in [1e39, f64::INFINITY, f64::NAN] {
        let e = write_exr(&path, &image(value)).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::File);
        assert!(e.to_string().contains("pixel 1, 1") && e.to_string().contains("3.4e38"), "{e}");
    }
}
