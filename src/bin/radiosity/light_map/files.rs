//! The files of a light map, and what they will take.

use std::collections::HashSet;
use std::path::Path;

use radiosity::io::{
    GlbSettings, MapBinding, ToneCurve, gltf_ending, rgbm_range, write_light_map_directional,
    write_light_map_exr, write_light_map_glb, write_light_map_ktx2, write_light_map_radiosity,
    write_light_map_rgbm, write_mapped_gltf, write_ply_with_tone, write_png_with_tone,
};
use radiosity::light_map::{Atlas, LightMap, MapPage, Page};
use radiosity::{BakeResult, Error, ErrorKind, Rgb};
use serde_json::{Value, json};

use super::{Options, PICTURE, Shown};
use crate::args::Names;
use crate::bake::files::{IMAGE, SAMPLES};
use crate::viewer_options::glb_settings;
use crate::{progress, standard};

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Format {
    Exr,
    Glb,
    Ply,
    Png,
    Rgbm,
    Ktx2,
    Json,
}

pub const FORMATS: Names<Format> = &[
    ("exr", Format::Exr),
    ("glb", Format::Glb),
    ("ply", Format::Ply),
    ("png", Format::Png),
    ("rgbm", Format::Rgbm),
    ("ktx2", Format::Ktx2),
    ("json", Format::Json),
];

/// How the file of a glTF scene names the map; none for the file that other scenes have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bind(Option<MapBinding>);

pub const BINDINGS: Names<Bind> = &[
    ("extras", Bind(Some(MapBinding::Extras))),
    ("emissive", Bind(Some(MapBinding::Emissive))),
    ("occlusion", Bind(Some(MapBinding::Occlusion))),
    ("none", Bind(None)),
];

/// Bytes of memory for a texel of a map: irradiance, error, triangle and whether it gathered.
const BYTES_OF_TEXEL: f64 = 24.0 + 8.0 + 4.0 + 2.0;

/// What files of each page of `atlas` have before their endings: nothing for the only one, its
/// group's name in characters that all systems have in names of files, or its number.
fn page_names(atlas: &Atlas) -> Vec<String> {
    let groups = atlas.scene().groups();
    let mut known = HashSet::new();
    let name = |(k, page): (usize, &Page)| {
        let plain = |c: char| if c.is_alphanumeric() || c == '-' { c } else { '_' };
        let number = (k + 1).to_string();
        let name = match page.group {
            Some(group) => groups[group as usize].chars().map(plain).collect(),
            None if atlas.pages().len() == 1 => return String::new(),
            None => number.clone(),
        };
        // Systems may take upper and lower case for the same.
        let is_new = known.insert(name.to_lowercase());
        if is_new { format!("{name}.") } else { format!("{name}-{number}.") }
    };
    atlas.pages().iter().enumerate().map(name).collect()
}

/// Prints the maps of `atlas` and what they will take.
pub fn print_layout(atlas: &Atlas) {
    let texels = |[width, height]: [u32; 2]| f64::from(width) * f64::from(height);
    let megabytes = |bytes: f64| bytes / f64::from(1 << 20);
    say!("map                              texels     exr, ktx2, rgbm at most, MiB");
    for (name, page) in page_names(atlas).iter().zip(atlas.pages()) {
        let [width, height] = page.size;
        let name = if name.is_empty() { "all" } else { name.trim_end_matches('.') };
        let [exr, packed] = [20.0, 4.0].map(|bytes| megabytes(bytes * texels(page.size)));
        let size = format!("{width} × {height}");
        say!("{name:<30} {size:>12} {exr:>9.2} {packed:>9.2} {packed:>9.2}");
    }
    let all: f64 = atlas.pages().iter().map(|page| texels(page.size)).sum();
    let memory = megabytes(BYTES_OF_TEXEL * texels([atlas.width(), atlas.height()]));
    say!(
        "{} maps, {all} texels of about {:.4}; {memory:.0} MiB of memory for them",
        atlas.pages().len(),
        atlas.texel_size()
    );
}

impl Options {
    /// Writes all files that are asked for, of a map that is off as `shown` says.
    pub fn write(
        &self,
        map: &LightMap,
        baked: &BakeResult,
        shown: Option<&Shown>,
        directional: Option<&[Vec<Rgb>; 3]>,
    ) -> Result<(), Error> {
        let writes = |format: Format| self.formats.contains(&format);
        let path = |ending: &str| self.output.path(ending);
        let range = rgbm_range(map);
        for (k, name) in page_names(&map.atlas).iter().enumerate() {
            let (page, path) = (map.page(k), |ending: &str| path(&format!("{name}{ending}")));
            let write = |ending: &str, write: &dyn Fn(&Path, MapPage) -> Result<(), Error>| {
                progress::of_writing(&path(ending), |path| write(path, page));
            };
            if writes(Format::Exr) {
                write("exr", &|path, page| write_light_map_exr(path, page));
            }
            if self.radiosity {
                write("radiosity.exr", &|path, page| write_light_map_radiosity(path, page));
            }
            if let Some(changes) = directional {
                let directional =
                    |path: &Path, page: MapPage| write_light_map_directional(path, page, changes);
                write("directional.exr", &directional);
            }
            if writes(Format::Ktx2) {
                write("ktx2", &|path, page| write_light_map_ktx2(path, page));
            }
            if writes(Format::Rgbm) {
                write("rgbm.png", &|path, page| write_light_map_rgbm(path, page, range));
            }
        }
        self.write_meshes(map, baked)?;
        // The range of RGBM is in the report.
        if writes(Format::Json) || writes(Format::Rgbm) {
            self.output.write_report(self.report(map, baked, shown));
        }
        Ok(())
    }

    /// Writes the scene with the map, and pictures of it.
    fn write_meshes(&self, map: &LightMap, baked: &BakeResult) -> Result<(), Error> {
        let writes = |format: Format| self.formats.contains(&format);
        let path = |ending: &str| self.output.path(ending);
        if !writes(Format::Glb) && !writes(Format::Ply) && !writes(Format::Png) {
            return Ok(());
        }
        let tone = self.tone(baked)?;
        if writes(Format::Glb) {
            let settings = glb_settings(&tone, self.reading.unit, baked.estimate.total);
            match self.binding()? {
                Some((ending, binding)) => {
                    self.write_mapped(map, &path(ending), binding, &settings)?;
                }
                None => {
                    let write = |path: &Path| write_light_map_glb(path, map, settings.clone());
                    progress::of_writing(&path("glb"), write);
                }
            }
        }
        if !writes(Format::Ply) && !writes(Format::Png) {
            return Ok(());
        }
        let surface = progress::of_stage("cutting the scene to texels", || map.surface())?;
        if writes(Format::Ply) {
            progress::of_writing(&path("ply"), |path| write_ply_with_tone(path, &surface, &tone));
        }
        if writes(Format::Png) {
            let [width, height] = PICTURE;
            let image =
                self.camera.of(&baked.light, PICTURE).image(&surface, width, height, SAMPLES)?;
            let tone = self.viewer.of_picture(&image);
            progress::of_writing(&path("png"), |path| write_png_with_tone(path, &image, &tone));
        }
        Ok(())
    }

    /// The ending of the file of a glTF scene, and how it names the map; none where there is no
    /// such file.
    pub fn binding(&self) -> Result<Option<(&'static str, MapBinding)>, Error> {
        match (gltf_ending(standard::input(&self.scene)?)?, self.bind) {
            (Some(ending), bind) => {
                let Bind(binding) = bind.unwrap_or(Bind(Some(MapBinding::default())));
                Ok(binding.map(|binding| (ending, binding)))
            }
            (None, None | Some(Bind(None))) => Ok(None),
            (None, Some(Bind(Some(_)))) => {
                let found = "no glTF file, which could name a map";
                let remedy = "leave --bind out, or give a glTF scene";
                let place = self.scene.display().to_string();
                Err(Error::new(ErrorKind::Setting, place, found, remedy))
            }
        }
    }

    fn write_mapped(
        &self,
        map: &LightMap,
        to: &Path,
        binding: MapBinding,
        settings: &GlbSettings,
    ) -> Result<(), Error> {
        let file = |name: &String| {
            // The one that keeps most, of those that are written.
            let formats =
                [(Format::Exr, "exr"), (Format::Ktx2, "ktx2"), (Format::Rgbm, "rgbm.png")];
            let written = formats.iter().find(|(format, _)| self.formats.contains(format));
            let ending = written.map_or("exr", |(_, ending)| ending);
            let path = self.output.path(&format!("{name}{ending}"));
            path.file_name().unwrap_or_default().to_string_lossy().into_owned()
        };
        let files: Vec<String> = page_names(&map.atlas).iter().map(file).collect();
        let scene = self.reading.scene_name.as_deref();
        let write = |path: &Path| {
            write_mapped_gltf(
                path,
                standard::input(&self.scene)?,
                map,
                scene,
                (binding, &files),
                settings.clone(),
            )
        };
        let instances = progress::of_writing(to, write).unwrap_or(0);
        if instances > 0 {
            eprintln!(
                "warning: {instances} instances share their vertices, and have no places in the \
                 map: --bind none writes a mesh for each"
            );
        }
        Ok(())
    }

    /// What the maps are, for programs that use them.
    fn report(&self, map: &LightMap, baked: &BakeResult, shown: Option<&Shown>) -> Value {
        let atlas = &map.atlas;
        let groups = atlas.scene().groups();
        let pages = page_names(atlas).into_iter().zip(atlas.pages()).map(|(name, page)| {
            let group = page.group.map(|group| &groups[group as usize]);
            json!({ "name": name.trim_end_matches('.'), "group": group, "size": page.size })
        });
        json!({
            "maps": pages.collect::<Vec<_>>(),
            "texel": atlas.texel_size(),
            "padding": self.padding,
            "rgbm": {
                "range": rgbm_range(map),
                "irradiance": "range * (alpha * colour)^2, W/m2 per channel",
            },
            "error": shown.map(|shown| json!({
                "total": shown.total(),
                "between_texels": shown.between.value,
                "light": shown.of_light,
            })),
            "bake": { "error": baked.estimate.total, "outcome": baked.outcome.to_string() },
        })
    }

    /// The curve of radiosity that the files of a bake are shown with.
    fn tone(&self, baked: &BakeResult) -> Result<ToneCurve, Error> {
        if let Some(given) = self.viewer.given() {
            return Ok(given.of_radiosity());
        }
        let [width, height] = IMAGE;
        let camera = self.camera.of(&baked.light, IMAGE);
        let image = progress::of_result("pixels of the picture", |report| {
            camera.interpolated_image(&baked.light, width, height, SAMPLES, report)
        })?;
        Ok(self.viewer.of_meshes(image.as_ref(), &baked.light))
    }
}
