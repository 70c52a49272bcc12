//! Shapes, text and axes in pixels, as a PNG image, with fonts that come along.

pub mod scale;

use std::io::Cursor;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{RgbImage, imageops};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use scale::Scale;

pub const BLACK: RGBColor = RGBColor(30, 30, 30);
pub const GREY: RGBColor = RGBColor(95, 95, 95);
pub const LIGHT: RGBColor = RGBColor(196, 196, 196);

/// A place in pixels.
pub type At = (f64, f64);

/// A drawing area [`FINER`] times as large in pixels.
pub struct Canvas<'a>(DrawingArea<BitMapBackend<'a>, Shift>);

/// How text looks and where its anchor is.
#[derive(Clone, Copy)]
pub struct Font {
    pub size: f64,
    pub colour: RGBColor,
    pub bold: bool,
    pub anchor: HPos,
}

impl Font {
    pub fn new(size: f64, colour: RGBColor) -> Font {
        Font { size, colour, bold: false, anchor: HPos::Left }
    }

    pub fn bold(self) -> Font {
        Font { bold: true, ..self }
    }

    pub fn anchor(self, anchor: HPos) -> Font {
        Font { anchor, ..self }
    }
}

/// On which side of its line an axis has its numbers.
#[derive(Clone, Copy, PartialEq)]
pub enum Side {
    Left,
    Right,
    Below,
}

/// Whether it could be drawn and, if not, why.
pub type Drawn = Result<(), String>;

/// The image is drawn so many times larger, and then made smaller: smooth edges.
const FINER: u32 = 3;

/// Share of a font's size by which plotters draws text too high.
const TEXT_TOO_HIGH: f64 = 0.17;

/// A PNG image of this width and height with what `draw` draws.
pub fn png(
    (width, height): (u32, u32),
    draw: impl FnOnce(&Canvas) -> Drawn,
) -> Result<Vec<u8>, String> {
    // Fonts that come along: there may be none on the system.
    for (style, bytes) in
        [(FontStyle::Normal, dejavu::sans::regular()), (FontStyle::Bold, dejavu::sans::bold())]
    {
        plotters::style::register_font("sans-serif", style, bytes).map_err(|_| "no font")?;
    }
    let large = (FINER * width, FINER * height);
    let mut pixels = vec![255; 3 * (large.0 * large.1) as usize];
    let canvas = Canvas(BitMapBackend::with_buffer(&mut pixels, large).into_drawing_area());
    draw(&canvas)?;
    canvas.0.present().map_err(|e| e.to_string())?;
    drop(canvas);
    let large = RgbImage::from_raw(large.0, large.1, pixels).expect("as many pixels");
    let image = imageops::resize(&large, width, height, imageops::FilterType::Triangle);
    let mut bytes = Cursor::new(vec![]);
    let small =
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::NoFilter);
    image.write_with_encoder(small).map_err(|e| e.to_string())?;
    Ok(bytes.into_inner())
}

fn pixels((x, y): At) -> (i32, i32) {
    let scaled = |v: f64| (v * f64::from(FINER)).round() as i32;
    (scaled(x), scaled(y))
}

impl Canvas<'_> {
    /// Text whose anchor is at half its height.
    pub fn text(&self, text: &str, (x, y): At, font: Font) -> Drawn {
        self.write(text, (x, y + TEXT_TOO_HIGH * font.size), font, FontTransform::None)
    }

    /// Text that is read from below.
    pub fn upright(&self, text: &str, (x, y): At, font: Font) -> Drawn {
        self.write(text, (x + TEXT_TOO_HIGH * font.size, y), font, FontTransform::Rotate270)
    }

    fn write(&self, text: &str, at: At, font: Font, turned: FontTransform) -> Drawn {
        let style = if font.bold { FontStyle::Bold } else { FontStyle::Normal };
        let style =
            TextStyle::from(("sans-serif", font.size * f64::from(FINER), style).into_font())
                .color(&font.colour)
                .pos(Pos::new(font.anchor, VPos::Center))
                .transform(turned);
        self.0.draw_text(text, &style, pixels(at)).map_err(|e| e.to_string())
    }

    pub fn line(&self, points: &[At], colour: RGBColor, width: f64) -> Drawn {
        let points: Vec<(i32, i32)> = points.iter().map(|&p| pixels(p)).collect();
        let style = colour.stroke_width((width * f64::from(FINER)).round().max(1.0) as u32);
        self.0.draw(&PathElement::new(points, style)).map_err(|e| e.to_string())
    }

    /// A rectangle, given left, top, right and bottom.
    pub fn fill(&self, [left, top, right, bottom]: [f64; 4], colour: RGBColor) -> Drawn {
        let corners = [pixels((left, top)), pixels((right, bottom))];
        self.0.draw(&Rectangle::new(corners, colour.filled())).map_err(|e| e.to_string())
    }

    pub fn dot(&self, at: At, radius: f64, colour: RGBColor) -> Drawn {
        let radius = (radius * f64::from(FINER)).round() as i32;
        self.0.draw(&Circle::new(pixels(at), radius, colour.filled())).map_err(|e| e.to_string())
    }

    pub fn diamond(&self, (x, y): At, r: f64, colour: RGBColor) -> Drawn {
        let corners = [(x - r, y), (x, y - r), (x + r, y), (x, y + r)].map(pixels);
        self.0.draw(&Polygon::new(corners.to_vec(), colour.filled())).map_err(|e| e.to_string())
    }

    /// An axis from the `low` end of `scale` to its `high` one: ticks and, where there is room,
    /// their numbers. Each tick goes on by `across` pixels on the side without numbers.
    pub fn axis(&self, scale: &Scale, [low, high]: [At; 2], side: Side, across: f64) -> Drawn {
        self.line(&[low, high], BLACK, 1.0)?;
        let (dx, dy, anchor) = match side {
            Side::Left => (-1.0, 0.0, HPos::Right),
            Side::Right => (1.0, 0.0, HPos::Left),
            Side::Below => (0.0, 1.0, HPos::Center),
        };
        let (tick, mut last) = (5.0, f64::NEG_INFINITY);
        for (value, text) in scale.ticks() {
            let share = scale.share(value);
            let (x, y) = (low.0 + share * (high.0 - low.0), low.1 + share * (high.1 - low.1));
            let along = |d: f64| (x + d * dx, y + d * dy);
            self.line(&[along(-across), (x, y)], LIGHT, 1.0)?;
            self.line(&[(x, y), along(tick)], BLACK, 1.0)?;
            let way = share * libm::hypot(high.0 - low.0, high.1 - low.1);
            if way - last >= 16.0 {
                let away = if side == Side::Below { 12.0 } else { 4.0 };
                self.text(&text, along(tick + away), Font::new(14.0, GREY).anchor(anchor))?;
                last = way;
            }
        }
        Ok(())
    }
}
