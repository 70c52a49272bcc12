//! Warnings about accepted defects: kind, number, first occurrence and treatment.

use std::fmt;

use crate::error::quoted;

/// A defect in a scene that was repaired, replaced or skipped.
///
/// Shown with `{}`, it is one line: number, kind, first occurrence, treatment, names.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Warning {
    /// Kind of the defect.
    pub kind: WarningKind,
    /// Number of occurrences.
    pub count: usize,
    /// First occurrence, as `file:line`; `None` if it has no line.
    pub place: Option<String>,
    /// Treatment.
    pub done: String,
    /// The groups, materials or files concerned, up to [`Warning::MAX_NAMES`] of them, each once.
    pub names: Vec<String>,
}

/// The kinds: documentation, name, noun in singular and plural, and the remedy where a strict
/// reader refuses the file.
macro_rules! warning_kinds {
    ($($(#[$doc:meta])* $kind:ident: $one:literal, $many:literal $(=> $remedy:literal)?;)*) => {
        /// Kind of a [`Warning`].
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum WarningKind {
            $($(#[$doc])* $kind,)*
        }

        impl WarningKind {
            /// Its noun, singular and plural.
            pub(crate) fn nouns(self) -> (&'static str, &'static str) {
                match self {
                    $(WarningKind::$kind => ($one, $many),)*
                }
            }

            /// The remedy, if a strict reader refuses it; `None` if it only warns: nothing was
            /// changed, or the skipped content does not belong in a scene of surfaces.
            pub(crate) fn remedy(self) -> Option<&'static str> {
                match self {
                    $($(WarningKind::$kind => Some($remedy),)?)*
                    _ => None,
                }
            }
        }
    };
}

warning_kinds! {
    /// A library of materials that cannot be read.
    MissingLibrary: "missing library", "missing libraries"
        => "put the library into the folder of the OBJ file or below";
    /// A library under another path, with other capitalisation, or one that no `mtllib` names.
    LibraryElsewhere: "library not where it is said", "libraries not where it is said"
        => "name it by its path from the folder of the OBJ file";
    /// `usemtl` with a name that no library defines, or with none.
    UnknownMaterial: "unknown material", "unknown materials"
        => "define it with `newmtl` in a library that `mtllib` names";
    /// A face before the first `usemtl`.
    FaceWithoutMaterial: "face without a material", "faces without a material";
    /// A material with neither reflectance nor radiance.
    MaterialWithoutColour:
        "material with neither colour nor emission",
        "materials with neither colour nor emission";
    /// A material that is defined several times.
    RedefinedMaterial: "material with several definitions", "materials with several definitions";
    /// A reflectance of 1 or more in a channel.
    HighReflectance:
        "material with a reflectance of 1 or more",
        "materials with reflectances of 1 or more"
        => "a diffuse reflectance is at least 0 and below 1 in each channel";
    /// A reflectance or radiance below 0 in a channel.
    NegativeColour: "material with a negative colour", "materials with negative colours"
        => "reflectance and radiance are at least 0 in each channel";
    /// A statement of a material that cannot be read.
    MaterialStatement: "unusable statement of a material", "unusable statements of materials"
        => "begin with `newmtl NAME`; write three finite numbers r g b, or one for all three";
    /// A missing texture.
    MissingTexture: "texture that is not there", "textures that are not there"
        => "put the image, as PNG, JPEG, BMP, TGA or WebP, into the folder of the scene";
    /// A texture that is not an image, or is truncated.
    UnreadableTexture: "texture that cannot be read", "textures that cannot be read"
        => "give a whole image, as PNG, JPEG, BMP, TGA or WebP";
    /// A texture that exceeds the limits, alone or with those before it.
    LargeTexture: "texture that is too large", "textures that are too large"
        => "make images smaller: a side of 32768 texels, 134217728 in all";
    /// Options of a texture that are not used.
    TextureOptions:
        "texture with options that are not used",
        "textures with options that are not used";
    /// Transparency, which is not modelled.
    Transparency: "material with transparency", "materials with transparency";
    /// A metal, as Blender writes it into OBJ files or by its metallic factor in glTF.
    Metal: "material of metal", "materials of metal";
    /// A glTF material whose metallic factor is the format's default.
    MetalByDefault: "material without a metallic factor", "materials without a metallic factor";
    /// An unlit glTF material.
    Unlit: "unlit material", "unlit materials";
    /// Lamps of a glTF file, whose unit is uncertain beside that of emitting surfaces.
    LampUnits: "lamp in candela or lux", "lamps in candela or lux";
    /// A lamp whose light ends at a range.
    LampRange: "lamp with a range", "lamps with ranges";
    /// Directional lamps beside the brightest one.
    MoreSuns: "directional lamp beside another one", "directional lamps beside another one";
    /// A part of a file by an extension of its format that is not read.
    Extension: "extension that is not read", "extensions that are not read";
    /// Nodes that are children of several others.
    SharedNode: "node below several others", "nodes below several others"
        => "each node must have one parent";
    /// A mesh that the joints of a skin pose.
    Skin: "mesh posed by a skin", "meshes posed by skins";
    /// A mirror whose `Kd` and `Ks` add up to more than 1.
    MoreThanAll:
        "mirror whose `Kd` and `Ks` are more than 1 together",
        "mirrors whose `Kd` and `Ks` are more than 1 together";
    /// A `map_Ke` without a strength.
    EmissionStrength: "`map_Ke` without a `Ke`", "`map_Ke` without a `Ke`";
    /// A file by a program whose export leaves light out.
    Generator: "file by Blender's OBJ exporter", "files by Blender's OBJ exporter";
    /// A mirror or glass, which pictures show and the light solution simplifies.
    Specular: "material of mirror or glass", "materials of mirror or glass";
    /// `Ka` above 1, used as radiance.
    AmbientAsRadiance: "material with `Ka` above 1", "materials with `Ka` above 1"
        => "write `Ke` for emitted radiance";
    /// No face emits light.
    NoLight: "no light in the scene", "scenes without light";
    /// A polygon that crosses itself, or has too many corners, or no front.
    Polygon: "polygon that crosses itself", "polygons that cross themselves"
        => "its outline must not cross itself, and may have 10000 corners unless it is convex; \
            triangles always work";
    /// A face that names a corner twice in a row.
    RepeatedCorner: "corner given twice in a row", "corners given twice in a row"
        => "name each corner once";
    /// A face with fewer than three different corners.
    FewCorners: "face of fewer than three corners", "faces of fewer than three corners"
        => "a face has three corners or more";
    /// A vertex with more numbers than a position, a weight or a colour has.
    VertexNumbers: "vertex with too many numbers", "vertices with too many numbers"
        => "a vertex is `v x y z`, with a weight or a colour at most";
    /// A smoothing group that is not an integer.
    SmoothingGroup:
        "smoothing group that is no whole number",
        "smoothing groups that are no whole numbers"
        => "write `s off`, or `s` and a whole number up to 4294967295";
    /// `s` with neither a group nor `off`.
    SmoothingWithoutGroup: "`s` line without a group", "`s` lines without a group";
    /// Points and lines.
    PointsAndLines: "`p` or `l` line (points, lines)", "`p` and `l` lines (points, lines)";
    /// Free-form curves and surfaces.
    FreeForm: "line of free-form curves or surfaces", "lines of free-form curves or surfaces";
    /// A line that is not OBJ.
    UnknownStatement: "line of unknown kind", "lines of unknown kind";
    /// A facet of an STL file whose normal points to the back of its corners.
    OpposedNormal:
        "facet with a normal that its corners contradict",
        "facets with normals that their corners contradict"
        => "seen from where the normal points, corners run counter-clockwise";
    /// An STL file that is truncated, or has another length than it declares.
    BrokenOff: "file that breaks off", "files that break off"
        => "give the whole file";
    /// A text that is not UTF-8.
    Encoding: "text that is not UTF-8", "texts that are not UTF-8";
    /// A triangle without area.
    Degenerate: "triangle without area", "triangles without area";
    /// A duplicated triangle.
    RepeatedTriangle: "triangle given again", "triangles given again";
    /// A triangle that light reaches from behind only.
    Winding: "triangle lit from behind", "triangles lit from behind";
    /// A lamp that could light something from the side on which it does not emit.
    DarkBack:
        "triangle of a lamp that faces surfaces on its dark side",
        "triangles of lamps that face surfaces on their dark sides";
    /// A triangle that light reaches on both sides.
    BothSides: "triangle lit from both sides", "triangles lit from both sides";
}

impl Warning {
    /// Maximum number of names that a warning keeps.
    pub const MAX_NAMES: usize = 9;

    /// A warning of `kind` without place or names.
    pub fn new(kind: WarningKind, count: usize, done: impl Into<String>) -> Warning {
        Warning { kind, count, place: None, done: done.into(), names: vec![] }
    }

    /// The same about these, the first few of which are kept.
    pub fn naming<S: Into<String>>(mut self, names: impl IntoIterator<Item = S>) -> Warning {
        for name in names {
            self.add_name(name);
        }
        self
    }

    /// Keeps `name` too, if there is room and it is new.
    pub(crate) fn add_name(&mut self, name: impl Into<String>) {
        if self.names.len() < Warning::MAX_NAMES {
            let name = name.into();
            if !self.names.contains(&name) {
                self.names.push(name);
            }
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (one, many) = self.kind.nouns();
        match (self.kind, self.count) {
            // It concerns the scene as a whole: no count.
            (WarningKind::NoLight, 1) => f.write_str(one)?,
            (_, 1) => write!(f, "1 {one}")?,
            (_, count) => write!(f, "{count} {many}")?,
        }
        match (&self.place, self.count) {
            (Some(place), 1) => write!(f, ", at {place}")?,
            (Some(place), _) => write!(f, ", first at {place}")?,
            (None, _) => {}
        }
        write!(f, ": {}", self.done)?;
        // If the list of names is full, the total number is unknown.
        let shown = &self.names[..self.names.len().min(Warning::MAX_NAMES - 1)];
        let others = if shown.len() < self.names.len() { " and others" } else { "" };
        if !shown.is_empty() {
            write!(f, " ({}{others})", quoted(shown))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_were_not_kept_are_not_counted() {
        let line = |count: usize| {
            let names = (0..count).map(|k| format!("m{k}"));
            Warning::new(WarningKind::UnknownMaterial, count, "grey").naming(names).to_string()
        };
        assert_eq!(line(2), "2 unknown materials: grey ('m0', 'm1')");
        let eight = "('m0', 'm1', 'm2', 'm3', 'm4', 'm5', 'm6', 'm7";
        assert_eq!(line(8), format!("8 unknown materials: grey {eight}')"));
        for count in [9, 30] {
            assert_eq!(
                line(count),
                format!("{count} unknown materials: grey {eight}' and others)")
            );
        }
    }
}
