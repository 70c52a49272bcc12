//! Bakes the radiosity of any OBJ scene to its vertices.
//!
//!     cargo run --release --example bake -- SCENE.obj [options]

mod support;

use std::ffi::OsString;
use std::process::ExitCode;

use glam::DVec3;
use lexopt::prelude::*;
use radiosity::Camera;
use support::{Bake, Device, Gathers};

const USAGE: &str = "\
usage: bake SCENE.obj [--out STEM] [--element-size X] [--hemicube N] [--near R]
            [--viewpoints TOL] [--rotations K] [--unshot F] [--shots N] [--row-memory MB]
            [--patch-tolerance X] [--patch-level N] [--camera ex,ey,ez,tx,ty,tz,vfov_deg]
            [--image W,H] [--pixel-gather] [--elements] [--gather none|needed|all] [--bend T]
            [--smallest X] [--max-elements N] [--contacts N] [--ambient]
            [--adapter NAME | --cpu]

Writes STEM.ply (radiosity at vertices), STEM.json (a report) and, with a camera, STEM.exr
(linear radiance) and STEM.png. STEM is the scene without its ending, unless given.

  --element-size X  longest edge of an element, in the scene's unit [diagonal / 32; / 20 if
                    vertices gather]
  --gather WHO      vertices that look at the settled light for themselves: none, those needed
                    for the light to be linear in between (elements are split where it is not),
                    or all of twice finer elements [none]
  --bend T          split where a side's middle is off by this share of its radiosity [0.02]
  --smallest X      elements with no longer edge are not split [largest edge / 24]
  --contacts N      levels that elements are split which other surfaces touch [3]
  --max-elements N  elements there may be [524288]
  --ambient         add the light not yet shot, spread evenly; the files say so
  --hemicube N      pixels along an edge of a hemicube's top face, even [128]
  --near R          closed forms for receivers within R patch diameters; -1 for none [1]
  --viewpoints TOL  see a patch from its parts too, and go down to the elements where more than
                    this share of its light lands on other triangles by them; four times the
                    hemicubes or more [not done]
  --rotations K     hemicubes a viewpoint, each turned further, averaged [1]
  --unshot F        stop at this share of unshot flux [0.0001]
  --shots N         stop after this many shots
  --row-memory MB   memory for form-factor rows that are kept [1024]
  --patch-tolerance X  how much of its light a patch may send wrong for being large; 0 makes all
                    patches as small as they can be [0.004]
  --patch-level N   the smallest patches are 4^N elements [0]
  --camera ...      eye, target, vertical field of view in degrees
  --image W,H       size of the picture in pixels [512,512]
  --pixel-gather    every pixel of the picture looks at the settled light for itself
  --elements        write STEM.elements.ply too: each element with its own value, not smoothed
  --adapter NAME    a graphics adapter with NAME in its name; WGPU_ADAPTER_NAME does the same
  --cpu             rays on the CPU instead of hemicubes, K N squared a row";

fn main() -> ExitCode {
    let bake = match parse(lexopt::Parser::from_env()) {
        Ok(Some(bake)) => bake,
        Ok(None) => {
            println!("{USAGE}");
            return ExitCode::SUCCESS;
        }
        Err(e) => {
            eprintln!("error: {e}\n\n{USAGE}");
            return ExitCode::from(2);
        }
    };
    match bake.run() {
        Ok(report) => {
            println!("{}", support::table(&report));
            ExitCode::SUCCESS
        }
        Err(e) => {
            eprintln!("error: {e}");
            ExitCode::FAILURE
        }
    }
}

/// The settings asked for, or `None` for help.
fn parse(mut args: lexopt::Parser) -> Result<Option<Bake>, lexopt::Error> {
    let mut scene: Option<OsString> = None;
    let mut bake = Bake::new("");
    let mut out = None;
    while let Some(arg) = args.next()? {
        match arg {
            Long("help") | Short('h') => return Ok(None),
            Long("out") => out = Some(args.value()?),
            Long("element-size") => bake.element_size = Some(args.value()?.parse()?),
            Long("hemicube") => bake.hemicube = args.value()?.parse()?,
            Long("near") => bake.near = args.value()?.parse()?,
            Long("viewpoints") => bake.viewpoints = Some(args.value()?.parse()?),
            Long("rotations") => bake.rotations = args.value()?.parse()?,
            Long("unshot") => bake.shooting.unshot = args.value()?.parse()?,
            Long("shots") => bake.shooting.shots = Some(args.value()?.parse()?),
            Long("row-memory") => {
                let megabytes: usize = args.value()?.parse()?;
                bake.shooting.row_memory = megabytes.saturating_mul(1 << 20);
            }
            Long("patch-tolerance") => bake.shooting.tolerance = args.value()?.parse()?,
            Long("patch-level") => bake.shooting.level = args.value()?.parse()?,
            Long("camera") => {
                let [a, b, c, d, e, f, vertical_fov] = args.value()?.parse_with(numbers)?;
                let (eye, target) = (DVec3::new(a, b, c), DVec3::new(d, e, f));
                bake.camera = Some(Camera { eye, target, vertical_fov });
            }
            Long("image") => bake.image = args.value()?.parse_with(numbers).map(|[w, h]| (w, h))?,
            Long("pixel-gather") => bake.pixel_gather = true,
            Long("elements") => bake.elements = true,
            Long("gather") => bake.gather = args.value()?.parse_with(gathers)?,
            Long("bend") => bake.bend = args.value()?.parse()?,
            Long("smallest") => bake.smallest = Some(args.value()?.parse()?),
            Long("contacts") => bake.contacts = args.value()?.parse()?,
            Long("max-elements") => bake.max_elements = args.value()?.parse()?,
            Long("ambient") => bake.ambient = true,
            Long("adapter") => bake.device = Device::Gpu(Some(args.value()?.string()?)),
            Long("cpu") => bake.device = Device::Cpu,
            Value(path) if scene.is_none() => scene = Some(path),
            _ => return Err(arg.unexpected()),
        }
    }
    bake.scene = scene.ok_or("no scene given")?.into();
    bake.out = out.map_or_else(|| bake.scene.with_extension(""), Into::into);
    Ok(Some(bake))
}

fn gathers(text: &str) -> Result<Gathers, String> {
    match text {
        "none" => Ok(Gathers::None),
        "needed" => Ok(Gathers::Needed),
        "all" => Ok(Gathers::All),
        other => Err(format!("'{other}' is not one of none, needed, all")),
    }
}

/// Exactly `N` numbers with commas between.
fn numbers<T: std::str::FromStr, const N: usize>(text: &str) -> Result<[T; N], String> {
    let parts: Vec<T> = text
        .split(',')
        .map(|part| part.trim().parse().map_err(|_| format!("'{part}' is not a number")))
        .collect::<Result<_, _>>()?;
    let count = parts.len();
    parts.try_into().map_err(|_| format!("{count} numbers, {N} wanted"))
}
