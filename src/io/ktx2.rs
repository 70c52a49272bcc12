//! Light maps as KTX 2.0 files with the format E5B9G9R9: three mantissas of 9 bits and a common
//! exponent of 5, linear, which devices filter without decoding.
//!
//! "KTX File Format Specification 2.0" and "Khronos Data Format Specification 1.3", Khronos Group;
//! conversion as in "OpenGL 4.6", section 8.5.2.

use super::Output;
use crate::error::{Error, ErrorKind};
use crate::light_map::MapPage;
use crate::scene::Rgb;

/// First bytes of a file.
const IDENTIFIER: [u8; 12] =
    [0xab, b'K', b'T', b'X', b' ', b'2', b'0', 0xbb, b'\r', b'\n', 0x1a, b'\n'];

/// `VK_FORMAT_E5B9G9R9_UFLOAT_PACK32`.
const FORMAT: u32 = 123;

/// Bytes before the index of levels, and of an entry in that.
const HEADER: usize = 80;
const ENTRY: usize = 24;

/// Bits of a mantissa, bias of the exponent, and largest value of that.
const MANTISSA: i32 = 9;
const BIAS: i32 = 15;
const LARGEST_EXPONENT: i32 = 31;

/// Largest number: 511/512 · 2¹⁶.
const LARGEST: f64 = 65408.0;

/// Writes the irradiance of a light map or a page of it, W/m², as KTX 2.0 with the format
/// E5B9G9R9, linear: each channel is off by no more than 1/512 of the brightest one of its texel,
/// and by 2⁻²⁵. With as many smaller images (mipmaps) as the texels around charts suffice for
/// ([`Atlas::smaller_images`](crate::light_map::Atlas::smaller_images)), which are means of the
/// covered texels alone.
///
/// # Errors
/// [`ErrorKind::File`] when the file cannot be written, or for an irradiance above 65 408 W/m².
pub fn write_light_map_ktx2<'a, 'o>(
    out: impl Into<Output<'o>>,
    map: impl Into<MapPage<'a>>,
) -> Result<(), Error> {
    let (page, out) = (map.into(), out.into());
    let levels = page.levels();
    let largest = levels[0].values.iter().map(|e| e.max_element()).fold(0.0, f64::max);
    if largest > LARGEST {
        let found = format!("irradiance {largest} W/m²");
        let remedy = "KTX 2.0 with E5B9G9R9 holds up to 65408: scale exitances down";
        return Err(Error::new(ErrorKind::File, out.name(), found, remedy));
    }
    out.write_bytes(&file(&levels))
}

/// An image of a map.
struct Level {
    size: [u32; 2],
    values: Vec<Rgb>,
    /// Whether each texel is covered.
    covered: Vec<bool>,
}

impl MapPage<'_> {
    /// The image, and the smaller ones.
    fn levels(&self) -> Vec<Level> {
        let values = self.of(&self.map.irradiance);
        let mut levels = vec![Level { size: self.size(), values, covered: self.covered() }];
        let most = self.map.atlas.smaller_images() as usize;
        while levels.len() <= most
            && let Some(half) = levels.last().and_then(Level::half)
        {
            levels.push(half);
        }
        levels
    }
}

impl Level {
    /// The image with half as many texels along a side; none of one texel.
    fn half(&self) -> Option<Level> {
        let [width, height] = self.size;
        if width.max(height) == 1 {
            return None;
        }
        let size = [width, height].map(|side| (side / 2).max(1));
        let texel = |k: u32| {
            let [x, y] = [k % size[0], k / size[0]].map(|x| 2 * x);
            let of = [[x, y], [x + 1, y], [x, y + 1], [x + 1, y + 1]]
                .map(|[x, y]| (y.min(height - 1) * width + x.min(width - 1)) as usize);
            let any = of.iter().any(|&k| self.covered[k]);
            let counted = of.iter().filter(|&&k| self.covered[k] || !any);
            let (sum, count) =
                counted.fold((Rgb::ZERO, 0.0), |(sum, n), &k| (sum + self.values[k], n + 1.0));
            (sum / count, any)
        };
        let (values, covered) = (0..size[0] * size[1]).map(texel).unzip();
        Some(Level { size, values, covered })
    }
}

/// The file of these images.
fn file(levels: &[Level]) -> Vec<u8> {
    let descriptor = data_format_descriptor();
    let writer = b"KTXwriter\0radiosity\0";
    let descriptor_at = HEADER + ENTRY * levels.len();
    let values_at = descriptor_at + descriptor.len();
    // A key and a value, their length before and padding to 4 bytes behind them.
    let mut values = (writer.len() as u32).to_le_bytes().to_vec();
    values.extend(writer);
    values.resize(values.len().next_multiple_of(4), 0);
    let [width, height] = levels[0].size;
    let mut bytes = IDENTIFIER.to_vec();
    // Format, bytes of a word, size, depth 0 (2D), layers 0 (no array), faces, levels, no
    // supercompression; descriptor, keys and values, no global data of supercompression.
    let numbers = [FORMAT, 4, width, height, 0, 0, 1, levels.len() as u32, 0]
        .into_iter()
        .chain([descriptor_at, descriptor.len(), values_at, values.len()].map(|x| x as u32));
    bytes.extend(numbers.flat_map(u32::to_le_bytes));
    bytes.extend([0; 16]);
    // The smallest image comes first.
    let mut at = values_at + values.len();
    let mut places = vec![];
    for level in levels.iter().rev() {
        places.push([at, 4 * level.values.len()]);
        at += 4 * level.values.len();
    }
    for [offset, length] in places.into_iter().rev() {
        bytes.extend([offset, length, length].iter().flat_map(|&x| (x as u64).to_le_bytes()));
    }
    bytes.extend(descriptor);
    bytes.extend(values);
    for level in levels.iter().rev() {
        bytes.extend(level.values.iter().flat_map(|&e| encoded(e).to_le_bytes()));
    }
    bytes
}

/// Says how the bits of a texel are to be read.
fn data_format_descriptor() -> Vec<u8> {
    // RGB, BT.709, linear, straight alpha; a texel is a block, of 4 bytes.
    let (model, primaries, transfer) = (1, 1, 1);
    let mut block = vec![model, primaries, transfer, 0];
    block.extend([0, 0, 0, 0, 4, 0, 0, 0, 0, 0, 0, 0]);
    for channel in 0..3u8 {
        // Mantissa and exponent: bit, length less one, channel; position; the values that stand for
        // 0 and 1 of the mantissa (with exponent 16), for the bias and the maximum of the exponent.
        let samples = [
            (9 * channel, MANTISSA - 1, channel, [0, (16 << MANTISSA) + 256u32]),
            (27, 4, channel | 0x20, [BIAS as u32, LARGEST_EXPONENT as u32]),
        ];
        for (bit, length, channel, range) in samples {
            block.extend([bit, 0, length as u8, channel, 0, 0, 0, 0]);
            block.extend(range.iter().flat_map(|x| x.to_le_bytes()));
        }
    }
    let size = 8 + block.len() as u32;
    // Length of all; vendor and type of the block 0, Khronos' basic one; version 2, its size.
    let mut all = (4 + size).to_le_bytes().to_vec();
    all.extend(0u32.to_le_bytes());
    all.extend((2 | size << 16).to_le_bytes());
    all.extend(block);
    all
}

/// A texel: three mantissas, then the exponent.
fn encoded(e: Rgb) -> u32 {
    let e = e.clamp(Rgb::ZERO, Rgb::splat(LARGEST));
    let largest = e.max_element();
    let steps = |exponent: i32| libm::exp2(f64::from(exponent - BIAS - MANTISSA));
    // Up to the power of two above the brightest channel.
    let floor = if largest > 0.0 { libm::log2(largest).floor() as i32 } else { -BIAS - 1 };
    let mut exponent = floor.max(-BIAS - 1) + 1 + BIAS;
    if (largest / steps(exponent)).round() >= f64::from(1 << MANTISSA) {
        exponent += 1;
    }
    let [r, g, b] = (e / steps(exponent)).round().to_array().map(|x| x as u32);
    r | g << 9 | b << 18 | (exponent as u32) << 27
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As devices read a texel.
    fn decoded(texel: u32) -> Rgb {
        let exponent = (texel >> 27) as i32 - BIAS - MANTISSA;
        Rgb::from_array(
            [0, 9, 18].map(|bit| f64::from(texel >> bit & 511) * f64::from(exponent).exp2()),
        )
    }

    #[test]
    fn channels_are_off_by_no_more_than_half_a_step() {
        for k in 0..4000 {
            let brightness = LARGEST * (-f64::from(k) / 140.0).exp();
            let share = [k * 37 % 101, k * 53 % 101, 100].map(|x| f64::from(x) / 100.0);
            let e = Rgb::from_array(share) * brightness;
            let off = (decoded(encoded(e)) - e).abs().max_element();
            // Half a step of 1/512 of a power of two that is at most twice the brightest channel;
            // of the smallest exponent 2⁻²⁵.
            assert!(off <= (brightness / 512.0).max(2f64.powi(-25)), "{e}: {off}");
        }
        for (value, texel) in [(1.0, 256 | 16 << 27), (LARGEST, 511 | 31 << 27), (0.0, 0)] {
            assert_eq!(encoded(Rgb::new(value, 0.0, 0.0)), texel, "{value}");
        }
        // Rounded up to the next power of two.
        assert_eq!(decoded(encoded(Rgb::new(0.99999, 0.0, 0.0))).x, 1.0);
    }

    #[test]
    fn smaller_images_have_means_of_covered_texels() {
        let values = (0..12).map(|k| Rgb::splat(f64::from(k))).collect();
        let covered = (0..12).map(|k| [0, 1, 4, 6].contains(&k)).collect();
        let level = Level { size: [4, 3], values, covered };
        let half = level.half().unwrap();
        assert_eq!((half.size, &half.covered[..]), ([2, 1], &[true, true][..]));
        assert_eq!(half.values, [Rgb::splat(5.0 / 3.0), Rgb::splat(6.0)]);
        let one = half.half().unwrap();
        assert_eq!((one.size, one.values[0]), ([1, 1], Rgb::splat((5.0 / 3.0 + 6.0) / 2.0)));
        assert!(one.half().is_none());
    }
}
