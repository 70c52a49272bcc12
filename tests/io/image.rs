//! EXR and PNG files.

use radiosity::{ErrorKind, RadianceImage, Rgb, write_exr, write_png};

#[test]
fn exr_reads_back_bit_for_bit() {
    let pixels = (0..12).map(|k| Rgb::new(f64::from(k), 0.25, 1e-3 * f64::from(k))).collect();
    let image = RadianceImage { width: 4, height: 3, pixels };
    let folder = tempfile::tempdir().unwrap();
    let (exr, png) = (folder.path().join("i.exr"), folder.path().join("i.png"));
    write_exr(&exr, &image).unwrap();
    write_png(&png, &image).unwrap();
    let read = exr::prelude::read_first_rgba_layer_from_file(
        &exr,
        |size, _| vec![[0f32; 3]; size.area()],
        |store, at, (r, g, b, _): (f32, f32, f32, f32)| store[at.y() * 4 + at.x()] = [r, g, b],
    )
    .unwrap();
    let want: Vec<[f32; 3]> = image.pixels.iter().map(|c| c.as_vec3().to_array()).collect();
    assert_eq!(read.layer_data.channel_data.pixels, want);
    let read = image::open(&png).unwrap().into_rgb8();
    assert_eq!(read.dimensions(), (4, 3));
    // Brighter radiance, brighter pixel: red rises along the image, and is never past green first.
    assert!(read.get_pixel(0, 0)[0] == 0 && read.get_pixel(3, 2)[0] > read.get_pixel(1, 0)[0]);
}

#[test]
fn exr_rejects_values_beyond_floats() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let image = |value: f64| {
        let mut pixels = vec![Rgb::ONE; 6];
        pixels[4] = Rgb::splat(value);
        RadianceImage { width: 3, height: 2, pixels }
    };
    write_exr(&path, &image(1e30)).unwrap();
    for value in [1e39, f64::INFINITY, f64::NAN] {
        let e = write_exr(&path, &image(value)).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::File);
        assert!(e.to_string().contains("pixel 1, 1") && e.to_string().contains("3.4e38"), "{e}");
    }
}
