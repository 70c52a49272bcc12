//! A contact sheet: square tiles in rows, each with a title and a note below it.

use image::imageops::{self, FilterType};
use image::{Rgb, RgbImage};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::Result;

/// Tiles in a row.
const COLUMNS: u32 = 4;

/// Between tiles, pixels.
const GAP: u32 = 8;

/// Text is drawn so many times larger, and then made smaller: even spaces between letters.
const FINER: u32 = 4;

const BLACK: RGBColor = RGBColor(30, 30, 30);
const GREY: RGBColor = RGBColor(95, 95, 95);

/// Pictures side by side.
pub struct Sheet {
    /// Pixels along a tile.
    pub side: u32,
    image: RgbImage,
    tiles: u32,
}

impl Sheet {
    /// For so many `rows` of tiles with `side` pixels along an edge.
    pub fn new(side: u32, rows: u32) -> Result<Sheet> {
        // Fonts that come along: there may be none on the system.
        let fonts =
            [(FontStyle::Normal, dejavu::sans::regular()), (FontStyle::Bold, dejavu::sans::bold())];
        for (style, font) in fonts {
            plotters::style::register_font("sans-serif", style, font).map_err(|_| "no font")?;
        }
        let (width, height) = (COLUMNS * (side + GAP), rows * (side + 2 * line(side) + GAP));
        let image = RgbImage::from_pixel(GAP + width, GAP + height, Rgb([255; 3]));
        Ok(Sheet { side, image, tiles: 0 })
    }

    /// Adds a picture in the next place.
    pub fn add(&mut self, title: &str, note: &str, picture: &RgbImage) -> Result<()> {
        let (column, row) = (self.tiles % COLUMNS, self.tiles / COLUMNS);
        let line = line(self.side);
        let x = GAP + column * (self.side + GAP);
        let y = GAP + row * (self.side + 2 * line + GAP);
        self.tiles += 1;
        for (below, words, bold) in [(0, title, true), (line, note, false)] {
            let words = text(words, [self.side, line], bold)?;
            imageops::replace(&mut self.image, &words, x.into(), (y + self.side + below).into());
        }
        imageops::replace(&mut self.image, picture, x.into(), y.into());
        Ok(())
    }

    /// Writes the sheet as a PNG file.
    pub fn save(&self, path: &str) -> Result<()> {
        Ok(self.image.save(path)?)
    }
}

/// Pixels from a line of text to the next, below tiles with `side` pixels along an edge.
fn line(side: u32) -> u32 {
    side * 9 / 104
}

/// A line of text, so many pixels wide and high.
fn text(text: &str, [width, height]: [u32; 2], bold: bool) -> Result<RgbImage> {
    let size = (FINER * width, FINER * height);
    let mut large = RgbImage::from_pixel(size.0, size.1, Rgb([255; 3]));
    let (style, colour) = if bold { (FontStyle::Bold, BLACK) } else { (FontStyle::Normal, GREY) };
    let font = ("sans-serif", 0.7 * f64::from(size.1), style).into_font();
    let style = TextStyle::from(font).color(&colour).pos(Pos::new(HPos::Left, VPos::Center));
    let area = BitMapBackend::with_buffer(&mut large, size).into_drawing_area();
    // Plotters draws letters a little above the middle.
    let middle = (0, (0.62 * f64::from(size.1)) as i32);
    area.draw_text(text, &style, middle).map_err(|error| error.to_string())?;
    drop(area);
    Ok(imageops::resize(&large, width, height, FilterType::Triangle))
}

/// A scale: the colours from 1 at its top to -1 at its bottom, with a text at some places.
pub fn legend(
    side: u32,
    colour: impl Fn(f64) -> [u8; 3],
    texts: &[(f64, String)],
) -> Result<RgbImage> {
    let mut picture = RgbImage::from_pixel(side, side, Rgb([255; 3]));
    let (top, height, width) = (side / 12, side - side / 6, side / 6);
    for y in 0..height {
        let place = 1.0 - (2.0 * f64::from(y) + 1.0) / f64::from(height);
        (0..width).for_each(|x| picture.put_pixel(x, top + y, Rgb(colour(place))));
    }
    for (place, words) in texts {
        let line = line(side);
        let middle = f64::from(top) + f64::from(height) * (1.0 - place) / 2.0;
        let words = text(words, [side - width - GAP, line], false)?;
        let y = middle as i64 - i64::from(line / 2);
        imageops::replace(&mut picture, &words, (width + GAP).into(), y);
    }
    Ok(picture)
}
