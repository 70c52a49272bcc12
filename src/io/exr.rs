//! OpenEXR output: linear light, one 32-bit float per channel, in scan lines (ZIP).

use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, WritableImage};

use super::Output;
use crate::camera::RadianceImage;
use crate::error::{Error, ErrorKind};
#[cfg(feature = "light-map")]
use crate::light_map::MapPage;
use crate::scene::Rgb;

/// Writes linear radiance, W/(m² sr), as a 32-bit float OpenEXR with channels R, G, B.
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written, or cannot represent a radiance:
/// above 3.4e38. Values below 1e-38 become 0, or keep few digits.
pub fn write_exr<'o>(out: impl Into<Output<'o>>, image: &RadianceImage) -> Result<(), Error> {
    let (out, size) = (out.into(), [image.width, image.height]);
    let channels = rgb(&out, size, &image.pixels, ["radiance", "W/(m² sr)"])?;
    write(out, size, channels.into())
}

/// Writes the irradiance of a light map or a page of it, W/m², as a 32-bit float OpenEXR. Its
/// channels are R, G, B, `coverage`, 1 where a texel gathered and 0 where it is empty or filled
/// from its neighbours, and `error`, the standard error of a texel that gathered, W/m², a length
/// over R, G and B. At the first row texture coordinate v is 0 as in glTF, and 1 as in OBJ files.
///
/// # Errors
/// Those of [`write_exr`].
#[cfg(feature = "light-map")]
pub fn write_light_map_exr<'a, 'o>(
    out: impl Into<Output<'o>>,
    map: impl Into<MapPage<'a>>,
) -> Result<(), Error> {
    let (page, out) = (map.into(), out.into());
    let map = page.map;
    let [r, g, b] = rgb(&out, page.size(), &page.of(&map.irradiance), ["irradiance", "W/m²"])?;
    let gathered = page.of(&map.gathered);
    let coverage = gathered.into_iter().map(|gathered| f32::from(u8::from(gathered))).collect();
    let error = page.of(&map.standard_error).into_iter().map(|error| error as f32).collect();
    write(out, page.size(), vec![r, g, b, ("coverage", coverage), ("error", error)])
}

/// Writes how the irradiance of a light map or a page of it changes with the normal, W/m², as a
/// 32-bit float OpenEXR with channels `x.R` to `z.B`: `changes` are those of
/// [`LightMap::directional`](crate::light_map::LightMap::directional).
///
/// # Errors
/// Those of [`write_exr`].
#[cfg(feature = "light-map")]
pub fn write_light_map_directional<'a, 'o>(
    out: impl Into<Output<'o>>,
    map: impl Into<MapPage<'a>>,
    changes: &[Vec<Rgb>; 3],
) -> Result<(), Error> {
    let (page, out) = (map.into(), out.into());
    let names = [["x.R", "x.G", "x.B"], ["y.R", "y.G", "y.B"], ["z.R", "z.G", "z.B"]];
    let mut channels = vec![];
    for (names, values) in names.into_iter().zip(changes) {
        let of_axis = rgb(&out, page.size(), &page.of(values), ["change of irradiance", "W/m²"])?;
        channels.extend(names.into_iter().zip(of_axis).map(|(name, (_, values))| (name, values)));
    }
    write(out, page.size(), channels)
}

/// Writes the radiosity of a light map or a page of it, W/m², as a 32-bit float OpenEXR with
/// channels R, G, B: emitted and reflected, by materials without their textures
/// ([`LightMap::radiosity`](crate::light_map::LightMap::radiosity)).
///
/// # Errors
/// Those of [`write_exr`].
#[cfg(feature = "light-map")]
pub fn write_light_map_radiosity<'a, 'o>(
    out: impl Into<Output<'o>>,
    map: impl Into<MapPage<'a>>,
) -> Result<(), Error> {
    let (page, out) = (map.into(), out.into());
    let radiosity = page.of(&page.map.radiosity());
    let channels = rgb(&out, page.size(), &radiosity, ["radiosity", "W/m²"])?;
    write(out, page.size(), channels.into())
}

/// Name and samples of a channel, row by row from the top.
type Channel = (&'static str, Vec<f32>);

/// The channels of `pixels`, a quantity in a unit, if 32-bit floats represent all of them.
fn rgb(
    out: &Output<'_>,
    [width, _]: [u32; 2],
    pixels: &[Rgb],
    [quantity, unit]: [&str; 2],
) -> Result<[Channel; 3], Error> {
    let fits = |c: &Rgb| c.abs().max_element() <= f64::from(f32::MAX);
    if let Some(k) = pixels.iter().position(|c| !fits(c)) {
        let (column, row) = (k % width as usize, k / width as usize);
        let place = format!("{}: pixel {column}, {row}", out.name());
        let found = format!("{quantity} {} {unit}", pixels[k]);
        let remedy = "OpenEXR holds up to 3.4e38 a channel: scale exitances down";
        return Err(Error::new(ErrorKind::File, place, found, remedy));
    }
    let samples = |k: usize| pixels.iter().map(|c| c[k] as f32).collect();
    Ok([("R", samples(0)), ("G", samples(1)), ("B", samples(2))])
}

fn write(out: Output<'_>, [width, height]: [u32; 2], channels: Vec<Channel>) -> Result<(), Error> {
    let channel = |(name, samples)| AnyChannel::new(name, FlatSamples::F32(samples));
    let channels = AnyChannels::sort(channels.into_iter().map(channel).collect());
    let size = (width as usize, height as usize);
    // Blocks of 16 scan lines, ZIP, as most programs write: some engines do not read tiles
    // (Babylon.js 9.35, three.js up to r160).
    let image = Image::from_encoded_channels(size, Encoding::SMALL_LOSSLESS, channels);
    let mut bytes = std::io::Cursor::new(vec![]);
    // One block after the other: parallel writes would change their order from run to run.
    image.write().non_parallel().to_buffered(&mut bytes).map_err(|e| out.cannot_write(e))?;
    out.write_bytes(bytes.get_ref())
}
