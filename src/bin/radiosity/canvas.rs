//! Shapes and text in pixels, on whatever plotters draws on, with fonts that come along.

use std::io::Cursor;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{RgbImage, imageops};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

pub const BLACK: RGBColor = RGBColor(30, 30, 30);
pub const GREY: RGBColor = RGBColor(95, 95, 95);
pub const LIGHT: RGBColor = RGBColor(196, 196, 196);
pub const FAINT: RGBColor = RGBColor(232, 232, 232);

/// A place in pixels.
pub type At = (f64, f64);

/// A drawing area of any size: `scale` of its pixels are one here.
pub struct Canvas<'a, B: DrawingBackend> {
    area: &'a DrawingArea<B, Shift>,
    scale: f64,
    /// Share of a font's size by which text is drawn too high.
    high: f64,
}

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

#[derive(Clone, Copy)]
pub enum Mark {
    Dot(f64),
    Ring(f64),
    Diamond(f64),
}

/// Whether it could be drawn and, if not, why.
pub type Drawn = Result<(), String>;

/// A bitmap is drawn so many times larger, and then made smaller: smooth edges.
const FINER: u32 = 3;

/// An SVG image of this width and height with what `draw` draws.
pub fn svg(
    size: (u32, u32),
    draw: impl FnOnce(&Canvas<SVGBackend>) -> Drawn,
) -> Result<String, String> {
    fonts()?;
    let mut text = String::new();
    let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
    draw(&Canvas::new(&area, 1.0, 0.04)?)?;
    area.present().map_err(|e| e.to_string())?;
    drop(area);
    Ok(text)
}

/// The same as a PNG image.
pub fn png(
    (width, height): (u32, u32),
    draw: impl FnOnce(&Canvas<BitMapBackend>) -> Drawn,
) -> Result<Vec<u8>, String> {
    fonts()?;
    let large = (FINER * width, FINER * height);
    let mut pixels = vec![0; 3 * (large.0 * large.1) as usize];
    let area = BitMapBackend::with_buffer(&mut pixels, large).into_drawing_area();
    draw(&Canvas::new(&area, f64::from(FINER), 0.17)?)?;
    area.present().map_err(|e| e.to_string())?;
    drop(area);
    let large = RgbImage::from_raw(large.0, large.1, pixels).expect("as many pixels");
    let image = imageops::resize(&large, width, height, imageops::FilterType::Triangle);
    let mut bytes = Cursor::new(vec![]);
    let small =
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::NoFilter);
    image.write_with_encoder(small).map_err(|e| e.to_string())?;
    Ok(bytes.into_inner())
}

/// Fonts that come along: there may be none on the system.
fn fonts() -> Result<(), String> {
    for (style, bytes) in
        [(FontStyle::Normal, dejavu::sans::regular()), (FontStyle::Bold, dejavu::sans::bold())]
    {
        plotters::style::register_font("sans-serif", style, bytes).map_err(|_| "no font")?;
    }
    Ok(())
}

impl<'a, B: DrawingBackend> Canvas<'a, B> {
    fn new(area: &'a DrawingArea<B, Shift>, scale: f64, high: f64) -> Result<Self, String> {
        area.fill(&WHITE).map_err(|e| e.to_string())?;
        Ok(Canvas { area, scale, high })
    }

    fn place(&self, (x, y): At) -> (i32, i32) {
        ((x * self.scale).round() as i32, (y * self.scale).round() as i32)
    }

    fn style<'f>(&self, font: &'f Font) -> TextStyle<'f> {
        let style = if font.bold { FontStyle::Bold } else { FontStyle::Normal };
        let pos = Pos::new(font.anchor, VPos::Center);
        TextStyle::from(("sans-serif", font.size * self.scale, style).into_font())
            .color(&font.colour)
            .pos(pos)
    }

    /// Text whose anchor is at half its height.
    pub fn text(&self, text: &str, (x, y): At, font: Font) -> Drawn {
        let at = self.place((x, y + self.high * font.size));
        self.area.draw_text(text, &self.style(&font), at).map_err(|e| e.to_string())
    }

    /// Text that is read from below.
    pub fn upright(&self, text: &str, (x, y): At, font: Font) -> Drawn {
        let at = self.place((x + self.high * font.size, y));
        let style = self.style(&font).transform(FontTransform::Rotate270);
        self.area.draw_text(text, &style, at).map_err(|e| e.to_string())
    }

    pub fn text_width(&self, text: &str, font: Font) -> Result<f64, String> {
        let size = self.area.estimate_text_size(text, &self.style(&font));
        size.map(|(width, _)| f64::from(width) / self.scale).map_err(|e| e.to_string())
    }

    pub fn line(&self, points: &[At], colour: RGBColor, width: f64) -> Drawn {
        let points: Vec<(i32, i32)> = points.iter().map(|&p| self.place(p)).collect();
        let style = colour.stroke_width((width * self.scale).round().max(1.0) as u32);
        self.area.draw(&PathElement::new(points, style)).map_err(|e| e.to_string())
    }

    /// A rectangle, given left, top, right and bottom.
    pub fn fill(&self, [left, top, right, bottom]: [f64; 4], colour: RGBColor) -> Drawn {
        let corners = [self.place((left, top)), self.place((right, bottom))];
        self.area.draw(&Rectangle::new(corners, colour.filled())).map_err(|e| e.to_string())
    }

    pub fn mark(&self, mark: Mark, at: At, colour: RGBColor) -> Drawn {
        let radius = |r: f64| (r * self.scale).round() as i32;
        let drawn = match mark {
            Mark::Dot(r) => {
                self.area.draw(&Circle::new(self.place(at), radius(r), colour.filled()))
            }
            Mark::Ring(r) => {
                let style = colour.stroke_width((2.0 * self.scale) as u32);
                self.area.draw(&Circle::new(self.place(at), radius(r), style))
            }
            Mark::Diamond(r) => {
                let (x, y) = at;
                let corners = [(x - r, y), (x, y - r), (x + r, y), (x, y + r)];
                let corners = corners.map(|c| self.place(c));
                self.area.draw(&Polygon::new(corners.to_vec(), colour.filled()))
            }
        };
        drawn.map_err(|e| e.to_string())
    }
}
