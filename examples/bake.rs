//! Bakes the radiosity of any OBJ scene to its vertices.
//!
//!     cargo run --release --example bake -- SCENE.obj [options]

mod support;

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use glam::DVec3;
use lexopt::prelude::*;
use radiosity::{BakeSettings, Camera, GatherSettings, Method};
use support::{Bake, Choice, Goal};

const USAGE: &str = "\
usage: bake SCENE.obj [--out STEM] [--error X | --time SECONDS | --gather none|needed|all]
            [settings] [--camera ex,ey,ez,tx,ty,tz,vfov_deg] [--image W,H] [--pixel-gather]
            [--elements] [--adapter NAME | --cpu]

Writes STEM.ply (radiosity at vertices, and how far it may be off), STEM.json (a report) and, with
a camera, STEM.exr (linear radiance) and STEM.png. STEM is the scene without its ending, unless
given.

How far to go:
  --error X         until the radiosity of the vertices is off by less than this share, root mean
                    square over the area, by estimate: 0.02 for 2 %
  --time SECONDS    as exact as these seconds allow
  --gather WHO      without either: vertices that look at the settled light for themselves: none,
                    those needed for the light to be linear in between (elements are split where
                    it is not), or all of twice finer elements [none]

Settings, each chosen by what is asked for unless set by hand; in brackets those of --gather none:
  --element-size X  longest edge of an element that light is shot on, scene unit [diagonal / 32]
  --contacts N      levels that elements are split which other surfaces touch [3]
  --hemicube N      pixels along an edge of a hemicube's top face, even, for patches that shoot
                    much; a half or a quarter of them for dim ones, but no less than 16 [128]
  --full-share F    a patch shoots much from this share of the emitted light on; with 0 all do
  --near R          closed forms for receivers within R patch diameters; -1 for none [1]
  --viewpoints TOL  see a patch from its parts too, and go down to the elements where more than
                    this share of its light lands on other triangles by them; four times the
                    hemicubes or more [not done]
  --rotations K     hemicubes a viewpoint, each turned further, averaged [1]
  --unshot F        stop at this share of unshot flux [0.0001]
  --solver NAME     how light is spread: shooting, overshoot, jacobi, gauss-seidel, gmres or direct
                    [gmres where reflectance is near one, else shooting]
  --shots N         stop after this many shots, or steps of another solver
  --row-memory MB   memory for form-factor rows that are kept [1024]
  --patch-tolerance X  how much of its light a patch may send wrong for being large; 0 makes all
                    patches as small as they can be [0.004]
  --patch-level N   the smallest patches are 4^N elements [0]
  --ambient         add the light not yet shot, spread evenly; the files say so
Of vertices that gather:
  --gather-size X   longest edge of the elements whose corners gather first, scene unit
  --gather-contacts N  levels that these are split which other surfaces touch
  --rays N          looks a vertex takes
  --noise T         up to 16 times as many rays where they disagree by this share; inf for never
  --bend T          split where a side's middle is off by this share of its radiosity
  --curve T         split once more, without a look, where parabolas bend by more; inf for nowhere
  --smallest X      elements with no longer edge are not split
  --max-elements N  elements there may be [524288]
  --sweeps N        times that all vertices gather, the last time what they found before

Files and devices:
  --state FILE      write the state of the solve there now and then, and go on from it if it is
                    there: what is killed loses its last moments only; not with --time, which
                    solves many times
  --camera ...      eye, target, vertical field of view in degrees
  --image W,H       size of the picture in pixels [512,512]
  --pixel-gather    every pixel of the picture looks at the settled light for itself
  --elements        write STEM.elements.ply too: each element with its own value, not smoothed
  --adapter NAME    a graphics adapter with NAME in its name; WGPU_ADAPTER_NAME does the same
  --cpu             rays on the CPU instead of hemicubes, K N squared a row that much
                    light goes along";

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
    let (mut out, mut gather, mut state) = (None, None, false);
    while let Some(arg) = args.next()? {
        match arg {
            Long("help") | Short('h') => return Ok(None),
            Long("out") => out = Some(args.value()?),
            Long("error") => bake.goal = Goal::Error(args.value()?.parse()?),
            Long("time") => bake.goal = Goal::Seconds(args.value()?.parse()?),
            Long("gather") => match args.value()?.string()?.as_str() {
                "none" => set(&mut bake, |settings| settings.gather = None),
                "needed" => gather = Some(0),
                "all" => gather = Some(1),
                other => return Err(format!("'{other}' is not one of none, needed, all").into()),
            },
            Long("row-memory") => {
                let megabytes: usize = args.value()?.parse()?;
                let bytes = megabytes.saturating_mul(1 << 20);
                set(&mut bake, move |settings| settings.solve.solver.row_memory = bytes);
            }
            Long("solver") => {
                let method: Method = args.value()?.parse()?;
                set(&mut bake, move |settings| {
                    settings.solve.solver.method = method;
                    settings.solve.gmres_if_bright = false;
                });
            }
            Long("state") => {
                let path = PathBuf::from(args.value()?);
                state = true;
                set(&mut bake, move |settings| settings.solve.checkpoint = Some(path.clone()));
            }
            Long("ambient") => set(&mut bake, |settings| settings.solve.ambient = true),
            Long("element-size") => {
                let value = args.value()?.parse()?;
                set(&mut bake, move |settings| settings.solve.element_size = value);
            }
            Long("contacts") => {
                let value = args.value()?.parse()?;
                set(&mut bake, move |settings| settings.solve.contact_levels = value);
            }
            Long("hemicube") => {
                let value = args.value()?.parse()?;
                set(&mut bake, move |settings| settings.solve.hemicube_resolution = value);
            }
            Long("full-share") => {
                let value = args.value()?.parse()?;
                set(&mut bake, move |settings| settings.solve.full_resolution_share = Some(value));
            }
            Long("near") => {
                let value = args.value()?.parse()?;
                set(&mut bake, move |settings| settings.solve.near_reach = value);
            }
            Long("viewpoints") => {
                let value = args.value()?.parse()?;
                set(&mut bake, move |settings| settings.solve.viewpoint_tolerance = Some(value));
            }
            Long("rotations") => {
                let value = args.value()?.parse()?;
                set(&mut bake, move |settings| settings.solve.rotations = value);
            }
            Long("unshot") => {
                let value = args.value()?.parse()?;
                set(&mut bake, move |settings| settings.solve.solver.unshot = value);
            }
            Long("shots") => {
                let value = args.value()?.parse()?;
                set(&mut bake, move |settings| settings.solve.solver.max_steps = Some(value));
            }
            Long("patch-tolerance") => {
                let value = args.value()?.parse()?;
                set(&mut bake, move |settings| settings.solve.solver.patch_tolerance = value);
            }
            Long("patch-level") => {
                let value = args.value()?.parse()?;
                set(&mut bake, move |settings| settings.solve.solver.min_patch_level = value);
            }
            Long("gather-size") => {
                let value = args.value()?.parse()?;
                set_gather(&mut bake, move |gather| gather.element_size = value);
            }
            Long("gather-contacts") => {
                let value = args.value()?.parse()?;
                set_gather(&mut bake, move |gather| gather.contact_levels = value);
            }
            Long("rays") => {
                let value = args.value()?.parse()?;
                set_gather(&mut bake, move |gather| gather.rays = value);
            }
            Long("noise") => {
                let value = args.value()?.parse()?;
                set_gather(&mut bake, move |gather| gather.noise_tolerance = value);
            }
            Long("bend") => {
                let value = args.value()?.parse()?;
                set_gather(&mut bake, move |gather| gather.refinement.tolerance = value);
            }
            Long("smallest") => {
                let value = args.value()?.parse()?;
                set_gather(&mut bake, move |gather| gather.refinement.smallest = value);
            }
            Long("curve") => {
                let value = args.value()?.parse()?;
                set_gather(&mut bake, move |gather| gather.refinement.curve = value);
            }
            Long("max-elements") => {
                let value = args.value()?.parse()?;
                set_gather(&mut bake, move |gather| gather.refinement.elements = value);
            }
            Long("sweeps") => {
                let value = args.value()?.parse()?;
                set_gather(&mut bake, move |gather| gather.refinement.sweeps = value);
            }
            Long("camera") => {
                let [a, b, c, d, e, f, vertical_fov] = args.value()?.parse_with(numbers)?;
                let (eye, target) = (DVec3::new(a, b, c), DVec3::new(d, e, f));
                bake.camera = Some(Camera { eye, target, vertical_fov });
            }
            Long("image") => bake.image = args.value()?.parse_with(numbers).map(|[w, h]| (w, h))?,
            Long("pixel-gather") => bake.pixel_gather = true,
            Long("elements") => bake.elements = true,
            Long("adapter") => bake.device = Choice::Gpu(Some(args.value()?.string()?)),
            Long("cpu") => bake.device = Choice::Cpu,
            Value(path) if scene.is_none() => scene = Some(path),
            _ => return Err(arg.unexpected()),
        }
    }
    if state && matches!(bake.goal, Goal::Seconds(_)) {
        return Err("--state is for one solve, --time for many: use --error".into());
    }
    if let Some(everywhere) = gather {
        if let Goal::Plain { gather } = &mut bake.goal {
            *gather = true;
        }
        set_gather(&mut bake, move |gather| gather.refinement.everywhere = everywhere);
    }
    bake.scene = scene.ok_or("no scene given")?.into();
    bake.out = out.map_or_else(|| bake.scene.with_extension(""), Into::into);
    Ok(Some(bake))
}

fn set(bake: &mut Bake, change: impl Fn(&mut BakeSettings) + 'static) {
    bake.changes.push(Box::new(change));
}

/// What vertices that do not gather do not need is left alone.
fn set_gather(bake: &mut Bake, change: impl Fn(&mut GatherSettings) + 'static) {
    set(bake, move |settings| settings.gather.iter_mut().for_each(&change));
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
