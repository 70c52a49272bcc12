//! The JSON report of a bake.

use std::io::Write;
use std::path::Path;

use serde_json::{Map, Value, json};

use super::write_file;
use crate::bake::ErrorEstimate;
use crate::error::Error;
use crate::scene::Rgb;
use crate::solver::Ledger;

/// What was done, with what, and where the light and the time went.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// The scene, as the user named it.
    pub scene: String,
    /// Name, type and driver of what made the rows.
    pub adapter: [String; 3],
    /// What was asked for.
    pub goal: Value,
    /// Settings by name: those chosen, and those made by hand.
    pub settings: Vec<(String, Value)>,
    /// Triangles with area.
    pub triangles: usize,
    /// Elements of the mesh that light was shot on.
    pub shot_elements: usize,
    /// Elements of the mesh exported: more where vertices gathered and elements were split.
    pub elements: usize,
    /// Vertices exported.
    pub vertices: usize,
    /// Patches shot.
    pub shots: u64,
    /// Rows made: hemicubes drawn, or fans of rays cast.
    pub hemicubes: u64,
    /// HemicubeRows drawn at each resolution: pixels along an edge of the top face, and how many.
    /// None where rays were cast.
    pub hemicubes_by_resolution: Vec<(u32, u64)>,
    /// Places at which vertices gathered.
    pub gathers: u64,
    /// What gathering changed of the vertices; see `GatheredMesh`.
    pub gather_change: f64,
    /// Why gathering stopped.
    pub gather_stop: String,
    /// Share of a row that the proximity repair moved, in the mean; see `ProximityCorrection`.
    pub near_moved: f64,
    /// Why the solver stopped.
    pub stop: String,
    /// Where the light went.
    pub ledger: Ledger,
    /// How far off the result is.
    pub certificate: ErrorEstimate,
    /// Where the time went.
    pub seconds: Seconds,
    /// What deserves a look.
    pub warnings: Vec<String>,
}

/// Seconds of wall time by stage. Draw, reduce and read-back are parts of making rows; `solve` is
/// the rest of the shooting, repairs of rows included.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seconds {
    /// Reading the scene.
    pub load: f64,
    /// Opening the device.
    pub open: f64,
    /// Cutting the scene into elements, and getting the device ready.
    pub mesh: f64,
    /// Rendering item buffers, or casting rays.
    pub draw: f64,
    /// Adding up pixel weights.
    pub reduce: f64,
    /// Getting rows from the device.
    pub readback: f64,
    /// Shooting on rows.
    pub solve: f64,
    /// Elements to vertices, gathering and splitting included.
    pub vertices: f64,
    /// Judging what was found.
    pub certificate: f64,
    /// Drawing the camera image and writing all other files.
    pub write: f64,
    /// All of it.
    pub total: f64,
}

impl Report {
    /// The report as JSON.
    pub fn to_json(&self) -> Value {
        let channels = |c: Rgb| json!(c.to_array());
        let Ledger { emitted, absorbed, escaped: left, backface_loss: back, unshot, overshot } =
            self.ledger;
        let (s, c) = (self.seconds, self.certificate);
        let [name, kind, driver] = &self.adapter;
        let drawn = self.hemicubes_by_resolution.iter();
        let drawn: Map<String, Value> = drawn.map(|(n, k)| (n.to_string(), json!(k))).collect();
        json!({
            "scene": self.scene,
            "adapter": { "name": name, "type": kind, "driver": driver },
            "goal": self.goal,
            "settings": self.settings.iter().cloned().collect::<Map<String, Value>>(),
            "triangles": self.triangles,
            "shot_elements": self.shot_elements,
            "elements": self.elements,
            "vertices": self.vertices,
            "shots": self.shots,
            "hemicubes": self.hemicubes,
            "hemicubes_by_resolution": drawn,
            "gathers": self.gathers,
            "gather_change": self.gather_change,
            "gather_stop": self.gather_stop,
            "near_moved": self.near_moved,
            "stop": self.stop,
            "ledger": {
                "emitted": channels(emitted),
                "absorbed": channels(absorbed),
                "left": channels(left),
                "back": channels(back),
                "unshot": channels(unshot),
                "overshot": channels(overshot),
            },
            "error": {
                "total": c.total, "mesh": c.mesh, "sampling": c.sampling, "settling": c.truncation,
                "unshot": c.unshot, "unshot_bound": c.unshot_bound, "places": c.samples,
            },
            "seconds": {
                "load": s.load, "open": s.open, "mesh": s.mesh, "draw": s.draw, "reduce": s.reduce,
                "readback": s.readback, "solve": s.solve, "vertices": s.vertices,
                "certificate": s.certificate, "write": s.write, "total": s.total,
            },
            "warnings": self.warnings,
        })
    }

    /// Writes the report.
    ///
    /// # Errors
    /// [`crate::ErrorKind::File`] when the file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        write_file(path.as_ref(), |out| writeln!(out, "{:#}", self.to_json()))
    }
}
