//! The files that a bake writes: STEM with the ending of each.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use clap::Args;
use radiosity::bake::ErrorEstimate;
use radiosity::bands::BandLight;
use radiosity::camera::RadianceImage;
use radiosity::io::{
    GlbSettings, LitVertices, ToneCurve, gltf_ending, write_lit_gltf, write_ply_bands,
    write_ply_with_tone, write_png_with_tone,
};
use radiosity::{
    Backend, BakeResult, Camera, Error, ErrorKind, GatheredMesh, VertexMesh, write_exr, write_glb,
};

use crate::args::{self, List, Names, Output, numbers, some_of};
use crate::bake::bands;
use crate::camera_option::CameraOption;
use crate::progress;
use crate::scene_options::SceneOptions;
use crate::standard;
use crate::viewer_options::{ViewerOptions, glb_settings, is_lit};

/// Rays along a pixel's side.
pub const SAMPLES: u32 = 4;

/// Pixels of the picture unless others are asked for.
pub const IMAGE: [u32; 2] = [512, 512];

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Format {
    Ply,
    Glb,
    Json,
    Exr,
    Png,
    /// Of bands alone.
    Csv,
}

const FORMATS: Names<Format> = &[
    ("ply", Format::Ply),
    ("glb", Format::Glb),
    ("json", Format::Json),
    ("exr", Format::Exr),
    ("png", Format::Png),
    ("csv", Format::Csv),
];

/// What to write, and where.
#[derive(Args)]
#[command(next_help_heading = "Files")]
pub struct Files {
    #[command(flatten)]
    output: Output,
    /// Files: ply, vertices with radiosity and error; glb, the same for viewers of glTF, or a glTF
    /// scene with light at its own vertices; json, a report; exr and png, a picture; csv, with
    /// --bands, a table
    #[arg(long = "write", value_name = "FORMATS", value_parser = some_of(FORMATS))]
    #[arg(default_value = "ply,glb,json,exr,png")]
    formats: List<Format>,
    #[command(flatten)]
    camera: CameraOption,
    #[command(flatten)]
    viewer: ViewerOptions,
    /// For a glTF file: write the mesh that was refined, not the file with light at its vertices
    #[arg(long, hide = true)]
    refine: bool,
    /// Metres in the scene's unit.
    #[arg(skip = 1.0)]
    metres: f64,
    /// Whether the light is on the scene's own mesh.
    #[arg(skip)]
    keeps_mesh: bool,
    #[arg(skip)]
    source: Option<Source>,
    /// Pixels of the picture
    #[arg(long, value_name = "W,H", default_value = "512,512")]
    #[arg(value_parser = numbers::<u32, 2>("2 whole numbers with a comma between them"))]
    image: [u32; 2],
    /// Gather the light at each pixel of the picture
    #[arg(long, hide = true)]
    pixel_gather: bool,
    /// Write STEM.elements.ply: each element with its own value, constant on the element
    #[arg(long, hide = true)]
    elements: bool,
}

/// The glTF file that a scene is from.
struct Source {
    path: PathBuf,
    ending: &'static str,
    /// Name of its scene, if one was given.
    scene: Option<String>,
}

/// How a picture was taken.
#[derive(Clone, Copy)]
pub struct Picture {
    pub camera: Camera,
    /// What radiance was multiplied with for its colours.
    pub exposure: f64,
}

impl Files {
    /// Names the files after the scene, where they are given no name, and checks whether all of it
    /// can be written, before any work is done for it.
    pub fn name_after(
        &mut self,
        scene: &Path,
        reading: &SceneOptions,
        keeps_mesh: bool,
    ) -> Result<(), Error> {
        (self.metres, self.keeps_mesh) = (reading.unit, keeps_mesh);
        let of_scene =
            |ending| Source { path: scene.into(), ending, scene: reading.scene_name.clone() };
        self.source = gltf_ending(standard::input(scene)?)?.map(of_scene);
        // Not over the scene itself.
        let ending = if self.source.is_some() { "baked" } else { "" };
        let stem = standard::stem(scene).with_added_extension(ending);
        if self.output.is_dash() {
            standard::keep_for_file();
            (self.formats, self.elements) = (vec![Format::Ply], false);
        } else {
            self.output.name(stem, &args::names(FORMATS))?;
        }
        if ["glb", "gltf"].iter().any(|ending| self.output.path(ending) == scene) {
            let place = scene.display().to_string();
            let remedy = "give the results another name with --out";
            return Err(Error::new(
                ErrorKind::Setting,
                place,
                "its results would replace it",
                remedy,
            ));
        }
        self.viewer.check()?;
        self.camera.find(scene, self.image, SAMPLES)
    }

    fn writes(&self, format: Format) -> bool {
        self.formats.contains(&format)
    }

    /// Writes pictures and meshes, and tells how the picture was taken, if there is one.
    pub fn write(&self, baked: &BakeResult, device: &Backend) -> Result<Option<Picture>, Error> {
        let mut picture = None;
        let mut image = None;
        if self.writes(Format::Exr) || self.writes(Format::Png) {
            let camera = self.camera.of(&baked.light, self.image);
            image = self.picture(&camera, baked, device)?;
            if let Some(seen) = &image {
                let radiosity = &baked.light.surface.radiosity;
                if !is_lit(seen) && radiosity.iter().any(|b| b.max_element() > 0.0) {
                    eprintln!(
                        "warning: the picture is black, nothing lit is in view: try --camera"
                    );
                }
                let tone = self.viewer.of_picture(seen);
                self.write_picture("", seen, &tone);
                picture = Some(Picture { camera, exposure: tone.exposure() });
            }
        }
        // Where the picture is black, what it does not show has its own exposure.
        let tone = self.viewer.of_meshes(image.as_ref(), &baked.light);
        self.write_meshes(baked, &tone);
        Ok(picture)
    }

    /// Writes a picture to files whose endings begin with `of`.
    fn write_picture(&self, of: &str, image: &RadianceImage, tone: &ToneCurve) {
        let path = |ending| self.output.path(&format!("{of}{ending}"));
        if self.writes(Format::Exr) {
            progress::of_writing(&path("exr"), |path| write_exr(path, image));
        }
        if self.writes(Format::Png) {
            progress::of_writing(&path("png"), |path| write_png_with_tone(path, image, tone));
        }
    }

    /// Writes meshes; their colours are those of the picture.
    fn write_meshes(&self, baked: &BakeResult, tone: &ToneCurve) {
        if self.writes(Format::Ply) {
            let mut surface = self.surface(baked);
            surface.comments = comments(baked);
            if self.output.is_dash() {
                standard::write(|out| write_ply_with_tone(out, &surface, tone));
            } else {
                let write = |path: &Path| write_ply_with_tone(path, &surface, tone);
                progress::of_writing(&self.output.path("ply"), write);
            }
        }
        if self.writes(Format::Glb) {
            self.write_glb(baked, &glb_settings(tone, self.metres, baked.estimate.total));
        }
        if self.elements {
            progress::of_writing(&self.output.path("elements.ply"), |path| {
                let flat = VertexMesh::per_element(&baked.mesh, &baked.solution.radiosity);
                write_ply_with_tone(path, &flat, tone)
            });
        }
    }

    /// The mesh of a PLY file: with the vertices of the scene's file where its mesh is kept.
    fn surface(&self, baked: &BakeResult) -> VertexMesh {
        if !self.keeps_mesh {
            return baked.light.surface.clone();
        }
        let (surface, shared) = baked.light.at_positions();
        if shared > 0 {
            eprintln!(
                "warning: {shared} vertices are shared by surfaces that meet in a crease: in the \
                 PLY file they have the mean of these"
            );
        }
        surface
    }

    /// The file for viewers of glTF.
    fn glb_path(&self) -> PathBuf {
        self.output.path(self.lit_source().map_or("glb", |source| source.ending))
    }

    /// The glTF file that is written again with light; none if the mesh of the light is.
    fn lit_source(&self) -> Option<&Source> {
        self.source.as_ref().filter(|_| !self.refine)
    }

    /// Writes the glTF file of the scene with its `light`, or the mesh of the light, to this path.
    fn write_glb_to(
        &self,
        to: &Path,
        light: &GatheredMesh,
        settings: GlbSettings,
    ) -> Result<LitVertices, Error> {
        match self.lit_source() {
            Some(Source { path, scene, .. }) => {
                write_lit_gltf(to, standard::input(path)?, light, scene.as_deref(), settings)
            }
            None => write_glb(to, light, settings).map(|()| LitVertices::default()),
        }
    }

    /// The same to its path, and says what has no light.
    fn write_glb(&self, baked: &BakeResult, settings: &GlbSettings) {
        let write = |to: &Path| self.write_glb_to(to, &baked.light, settings.clone());
        let Some(counts) = progress::of_writing(&self.glb_path(), write) else { return };
        let LitVertices { without, instances, .. } = counts;
        if without > 0 {
            eprintln!("warning: {without} vertices are of no lit triangle: black in the glTF file");
        }
        if instances > 0 {
            eprintln!(
                "warning: {instances} instances share their vertices, and have no light in the \
                 glTF file: --refine writes a mesh for each"
            );
        }
    }

    /// Checks that there are files to be written while a bake is under way.
    pub fn check_preview(&self) -> Result<(), Error> {
        let writes_mesh = self.writes(Format::Ply) || self.writes(Format::Glb);
        if writes_mesh && !self.output.is_dash() {
            return Ok(());
        }
        let remedy = "add ply or glb to --write, and name files with --out";
        Err(Error::new(ErrorKind::Setting, "--preview", "without a file to write", remedy))
    }

    /// Writes meshes of the `light` of a bake that is under way, with its estimated error, if that
    /// is known.
    pub fn write_preview(
        &self,
        light: &GatheredMesh,
        estimate: Option<&ErrorEstimate>,
    ) -> Result<(), Error> {
        let tone = self.viewer.of_meshes(None, light);
        if self.writes(Format::Ply) {
            let mut surface = light.surface.clone();
            surface.comments = vec![match estimate {
                Some(estimate) => error_comment(estimate, "preview"),
                None => "preview, its error is not known yet".into(),
            }];
            write_ply_with_tone(self.output.path("ply"), &surface, &tone)?;
        }
        if self.writes(Format::Glb) {
            let error = estimate.map_or(0.0, |estimate| estimate.total);
            let settings = glb_settings(&tone, self.metres, error);
            self.write_glb_to(&self.glb_path(), light, settings)?;
        }
        Ok(())
    }

    /// Writes the light of bands and, if they have colours, a picture of these: from the camera of
    /// the other `picture`, if there is one.
    pub fn write_bands(
        &self,
        light: &BandLight,
        baked: &BakeResult,
        picture: Option<Picture>,
    ) -> Result<(), Error> {
        let mut tone = self.viewer.given();
        // Bands that are no spectrum have no colours.
        if let (Some(Picture { camera, .. }), Ok(colours)) = (picture, light.colours()) {
            let mut coloured = baked.light.clone();
            coloured.surface = colours;
            if let Some(image) = self.interpolated(&camera, &coloured)? {
                let shown = tone.unwrap_or_else(|| ToneCurve::fit_image(&image));
                self.write_picture("bands.", &image, &shown);
                tone = Some(shown);
            }
        }
        if self.writes(Format::Ply) {
            let tone = tone.map(ToneCurve::of_radiosity);
            progress::of_writing(&self.output.path("bands.ply"), |path| {
                write_ply_bands(path, light, tone.as_ref())
            });
        }
        if self.writes(Format::Csv) {
            self.output.write("bands.csv", &bands::table(light));
        }
        Ok(())
    }

    /// Writes the report, if it is asked for.
    pub fn write_report(&self, report: serde_json::Value) {
        if self.writes(Format::Json) {
            self.output.write_report(report);
        }
    }

    /// The picture, interpolated between vertices or gathered by its pixels; none after Ctrl-C, if
    /// it takes long.
    fn picture(
        &self,
        camera: &Camera,
        baked: &BakeResult,
        device: &Backend,
    ) -> Result<Option<RadianceImage>, Error> {
        let [width, height] = self.image;
        if !self.pixel_gather {
            return self.interpolated(camera, &baked.light);
        }
        // Without a gather: rays for an error of about 1.5 %.
        let rays = baked.settings.gather.as_ref().map_or(2048, |gather| gather.rays);
        let mut gather =
            progress::of_stage("preparing rays", || device.gather(&baked.light.mesh, rays))?;
        let image = progress::of_result("pixels gathered for the picture", |report| {
            camera.gathered_image(&baked.light, &mut *gather, width, height, SAMPLES, report)
        })?;
        Ok(or_warn(image))
    }

    /// The picture by the light between vertices; none after Ctrl-C, if it takes long.
    fn interpolated(
        &self,
        camera: &Camera,
        light: &GatheredMesh,
    ) -> Result<Option<RadianceImage>, Error> {
        let [width, height] = self.image;
        let image = progress::of_result("pixels of the picture", |report| {
            camera.interpolated_image(light, width, height, SAMPLES, report)
        })?;
        Ok(or_warn(image))
    }
}

/// Warns where an `image` was stopped.
fn or_warn(image: Option<RadianceImage>) -> Option<RadianceImage> {
    if image.is_none() {
        eprintln!(
            "warning: no picture: it would take longer than a second after the bake was stopped"
        );
    }
    image
}

/// How a PLY file begins to tell its error, in per cent.
const ESTIMATED_ERROR: &str = "estimated error ";

/// The error that the `comment` of a PLY file tells, as a share.
pub fn estimated_error(comment: &str) -> Option<f64> {
    let told = comment.strip_prefix(ESTIMATED_ERROR)?;
    told.split(' ').next()?.parse::<f64>().ok().map(|percent| percent / 100.0)
}

/// What the PLY file says of itself.
fn comments(baked: &BakeResult) -> Vec<String> {
    let mut comments = vec![];
    if baked.settings.solve.ambient {
        comments.push("ambient term of the unshot light added to the elements".into());
    }
    comments.push(error_comment(&baked.estimate, baked.outcome) + "; vertices have their own");
    comments
}

/// The `comment` that tells an error, with a remark.
fn error_comment(estimate: &ErrorEstimate, remark: impl Display) -> String {
    format!(
        "{ESTIMATED_ERROR}{:.3} % of reflected radiosity, RMS over area, at {} places ({remark})",
        100.0 * estimate.total,
        estimate.samples
    )
}
