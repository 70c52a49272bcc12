//! A whole bake: from a scene to radiosity at vertices, as far as an effort goes, or until an
//! accuracy is reached.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::certificate::{Certificate, Judged};
use crate::device::Device;
use crate::device::backed::{Backed, DeviceRelay};
use crate::effort::Effort;
use crate::error::Error;
use crate::form_factor::FormFactors;
use crate::form_factor::near::NearRepair;
use crate::form_factor::viewpoints::Viewpoints;
use crate::gather::Gather;
use crate::mesh::Mesh;
use crate::scene::Scene;
use crate::solve::{Go, Progress, Solution, Stop};
use crate::vertex::gathering::{GatherProgress, GatheredRadiosity, Gathering};
use crate::vertex::refined::Refined;

/// What came out of a bake.
#[derive(Clone, Debug)]
pub struct Baked {
    /// The mesh that light was shot on.
    pub mesh: Mesh,
    /// The light of its elements.
    pub solution: Solution,
    /// Radiosity at vertices, each with the error it may have.
    pub light: GatheredRadiosity,
    /// How far off that is.
    pub certificate: Certificate,
    /// The settings that were used in the end.
    pub effort: Effort,
    /// Rows drawn or cast, those of all rotations and viewpoints counted.
    pub hemicubes: u64,
    /// Hemicubes drawn at each resolution; none where rays were cast.
    pub hemicubes_by_resolution: Vec<(u32, u64)>,
    /// Share of a row that the proximity repair moved, in the mean.
    pub near_moved: f64,
    /// What the graphics device failed of, if it did; from then on rays on the CPU saw.
    pub failure: Option<Error>,
    /// Where the time went.
    pub seconds: BakeSeconds,
}

/// Seconds of wall time by stage.
#[derive(Clone, Copy, Debug, Default)]
pub struct BakeSeconds {
    /// Cutting the scene into elements, and getting the device ready.
    pub mesh: f64,
    /// Rendering item buffers, or casting rays.
    pub draw: f64,
    /// Adding up pixel weights.
    pub reduce: f64,
    /// Getting rows from the device.
    pub readback: f64,
    /// Shooting along rows, repairs of rows included.
    pub solve: f64,
    /// Elements to vertices, gathering and splitting included.
    pub vertices: f64,
    /// Judging what was found.
    pub certificate: f64,
}

impl BakeSeconds {
    /// All of it.
    pub fn total(&self) -> f64 {
        let rows = self.draw + self.reduce + self.readback;
        self.mesh + rows + self.solve + self.vertices + self.certificate
    }
}

/// What a bake is at, told often.
#[derive(Clone, Debug)]
pub enum Stage {
    /// Light is shot.
    Shooting(Progress),
    /// Vertices gather.
    Gathering(GatherProgress),
    /// Random places are looked at, to judge by.
    Judging {
        /// Places looked at so far.
        places: usize,
        /// How many there are.
        of: usize,
    },
    /// The solution was judged.
    Judged(Certificate),
    /// The graphics device failed. Nothing is lost: rays on the CPU go on from here, in more time, or
    /// what was reached is returned.
    Failed(Error),
}

/// Whoever is told of the stages of a bake, and may stop it.
pub(crate) type Tell<'a> = &'a mut dyn FnMut(&Stage) -> Go;

impl Effort {
    /// Bakes `scene` as far as these settings go. `progress` may stop it at any time: what was
    /// reached is returned.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Setting`] for a setting out of range; [`crate::ErrorKind::Device`] and
    /// [`crate::ErrorKind::Memory`] when the device cannot even start. One that fails later is in
    /// [`Baked::failure`].
    pub fn bake(
        &self,
        scene: impl Into<Arc<Scene>>,
        device: &Device,
        mut progress: impl FnMut(&Stage) -> Go,
    ) -> Result<Baked, Error> {
        self.bake_until(&scene.into(), device, &Goal::None, &mut progress)
    }

    /// As [`Effort::bake`], and on until `goal` is reached.
    pub(crate) fn bake_until(
        &self,
        scene: &Arc<Scene>,
        device: &Device,
        goal: &Goal,
        progress: Tell,
    ) -> Result<Baked, Error> {
        let device = &Backed::new(device);
        let shot = Shot::new(self, scene, device, progress)?;
        let light = GatheredRadiosity::from_elements(&shot.mesh, &shot.solution.radiosity)?;
        let (light, certificate, shot, effort) = match &self.gather {
            Some(gather) if shot.solution.stop != Stop::Cancelled => {
                let mesh = Mesh::new(scene.clone(), gather.element_size)?;
                let mesh = mesh.split_at_contacts(gather.contacts);
                let state = Refined::new(mesh.clone(), &light);
                let looks = device.gather(&mesh, gather.rays, gather.noise, state.dim())?;
                Settling { effort: self.clone(), state, looks, device, shot }
                    .until(goal, progress)?
            }
            _ => shot.judge(self, light, device, progress)?,
        };
        let Shot {
            mesh, solution, hemicubes, hemicubes_by_resolution, near_moved, seconds, ..
        } = shot;
        Ok(Baked {
            mesh,
            solution,
            light,
            certificate,
            effort,
            hemicubes,
            hemicubes_by_resolution,
            near_moved,
            failure: device.failure(),
            seconds,
        })
    }
}

/// What is asked of the certificate.
pub(crate) enum Goal<'a> {
    /// Nothing: the settings say how far to go.
    None,
    /// That it is below an error; whatever settings that takes are then adjusted by hand.
    Error(f64, &'a dyn Fn(&mut Effort)),
}

/// Light that was shot.
struct Shot {
    mesh: Mesh,
    solution: Solution,
    hemicubes: u64,
    hemicubes_by_resolution: Vec<(u32, u64)>,
    near_moved: f64,
    seconds: BakeSeconds,
    since: Instant,
}

impl Shot {
    fn new(
        effort: &Effort,
        scene: &Arc<Scene>,
        device: &Backed,
        progress: Tell,
    ) -> Result<Shot, Error> {
        let mut since = Instant::now();
        effort.check()?;
        let mesh =
            Mesh::new(scene.clone(), effort.element_size)?.split_at_contacts(effort.contacts);
        let rows = device.rows(&mesh, effort)?;
        let near = NearRepair::new(rows, &mesh, effort.near);
        let levels = if effort.viewpoints.is_some() { u32::MAX } else { 0 };
        let mut rows = Viewpoints::new(near, effort.viewpoints.unwrap_or(1.0), levels);
        let mut seconds = BakeSeconds { mesh: lap(&mut since), ..Default::default() };
        let mut tell = |p: &Progress| device.tell(&Stage::Shooting(*p), progress);
        let mut solution = solve(effort, &mesh, &mut rows, &mut tell)?;
        if effort.ambient {
            solution.ledger.add_ambient(&mesh, &mut solution.radiosity);
        }
        let relay: &DeviceRelay = rows.inner().inner();
        let mut in_rows = 0.0;
        for maker in [relay.first()].into_iter().chain(relay.second()) {
            let (draw, reduce, readback) = maker.stages();
            seconds.draw += draw;
            seconds.reduce += reduce;
            seconds.readback += readback;
            in_rows += maker.seconds();
        }
        seconds.solve = lap(&mut since) - in_rows;
        let rotations = u64::from(effort.rotations.get());
        let hemicubes = (solution.rows_made + rows.extra()) * rotations;
        let near_moved = rows.inner().moved();
        let hemicubes_by_resolution = relay.first().drawn_by_resolution();
        drop(rows);
        Ok(Shot { mesh, solution, hemicubes, hemicubes_by_resolution, near_moved, seconds, since })
    }

    /// The elements' own light, as it is.
    fn judge(
        mut self,
        effort: &Effort,
        mut light: GatheredRadiosity,
        device: &Backed,
        progress: Tell,
    ) -> Result<(GatheredRadiosity, Certificate, Shot, Effort), Error> {
        self.seconds.vertices = lap(&mut self.since);
        let spread = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|v| light.reflected[v as usize]);
            a.distance(b).max(b.distance(c)).max(c.distance(a)) / 4.0
        };
        let rest: Vec<f64> = light.corners.iter().map(spread).collect();
        let mut looks = device.gather(&self.mesh, LOOKS, f64::INFINITY, 0.0)?;
        let ledger = &self.solution.ledger;
        let judged = Judged { light: &light, sources: &light, rest: &rest, ledger, sweeps: 0 };
        let of = LEAST_PLACES;
        let mut cancelled = self.solution.stop == Stop::Cancelled;
        let (certificate, error) = judged.judge(of, &mut *looks, &mut |places| {
            cancelled =
                cancelled || device.tell(&Stage::Judging { places, of }, progress).is_break();
            if cancelled { Go::Break(()) } else { Go::Continue(()) }
        })?;
        light.surface.error = error;
        self.seconds.certificate = lap(&mut self.since);
        let _ = device.tell(&Stage::Judged(certificate), progress);
        Ok((light, certificate, self, effort.clone()))
    }
}

/// Spreads the light of `mesh`; from a saved state on if there is one, and saves it.
fn solve(
    effort: &Effort,
    mesh: &Mesh,
    rows: &mut dyn FormFactors,
    progress: &mut dyn FnMut(&Progress) -> Go,
) -> Result<Solution, Error> {
    let solver = effort.solver(mesh);
    let Some(path) = &effort.state else { return solver.solve(mesh, rows, progress) };
    let mut solve = match path.exists() {
        true => solver.resume(mesh, rows, path)?,
        false => solver.begin(mesh)?,
    };
    let (mut saved, mut took) = (Instant::now(), Duration::ZERO);
    loop {
        let stop = solve.advance(rows, &mut *progress)?;
        if stop.is_some() || saved.elapsed() >= SAVING * took {
            let start = Instant::now();
            solve.save(path)?;
            (saved, took) = (Instant::now(), start.elapsed());
        }
        if stop.is_some() {
            return solve.into_solution();
        }
    }
}

/// Solving goes on for so many times what saving takes.
const SAVING: u32 = 10;

/// Vertices that gather what was shot.
struct Settling<'a> {
    effort: Effort,
    state: Refined<'a>,
    looks: Box<dyn Gather>,
    device: &'a Backed<'a>,
    shot: Shot,
}

impl Settling<'_> {
    /// Gathers as the effort says, and on until the goal is reached or nothing is left to be done.
    fn until(
        mut self,
        goal: &Goal,
        progress: Tell,
    ) -> Result<(GatheredRadiosity, Certificate, Shot, Effort), Error> {
        if let Goal::Error(wanted, adjust) = goal {
            self.look(*wanted, adjust)?;
        }
        let device = self.device;
        let mut tell = |stage: Stage| device.tell(&stage, progress);
        let gather = self.effort.gather.as_ref().expect("vertices gather");
        let mut rough = match gather.gathering.sweeps {
            0 | 1 => None,
            _ => Some(self.looks(ROUGH)?),
        };
        let mut stop = gather.gathering.settle(
            &mut self.state,
            &mut *self.looks,
            rough.as_mut().map(|r| &mut **r as &mut dyn Gather),
            &mut |p| tell(Stage::Gathering(*p)),
        )?;
        for round in 0.. {
            let (mut light, rest) = self.state.curved(self.gathering())?;
            self.shot.seconds.vertices += lap(&mut self.shot.since);
            let ledger = &self.shot.solution.ledger;
            let (sources, sweeps) = (self.state.light(), self.gathering().sweeps);
            let judged = Judged { light: &light, sources, rest: &rest, ledger, sweeps };
            let count = (light.gathers as usize / GATHERS_A_PLACE).clamp(LEAST_PLACES, MOST_PLACES);
            let mut cancelled = stop == Stop::Cancelled;
            let (certificate, error) = judged.judge(count, &mut *self.looks, &mut |places| {
                cancelled = cancelled || tell(Stage::Judging { places, of: count }).is_break();
                if cancelled { Go::Break(()) } else { Go::Continue(()) }
            })?;
            light.surface.error = error;
            light.stop = stop;
            self.shot.seconds.certificate += lap(&mut self.shot.since);
            let go = tell(Stage::Judged(certificate));
            let Goal::Error(wanted, adjust) = goal else {
                return Ok((light, certificate, self.shot, self.effort));
            };
            let done = certificate.total <= SURE * wanted
                || stop != Stop::Converged
                || go.is_break()
                || cancelled
                || round == ROUNDS;
            let again = if done { None } else { self.improve(&certificate, *wanted, adjust)? };
            let Some(again) = again else {
                return Ok((light, certificate, self.shot, self.effort));
            };
            let gathering = self.gathering().clone();
            let mut tell = |p: &GatherProgress| tell(Stage::Gathering(*p));
            stop = match again {
                Again::All => self.state.sweep(&gathering, &mut *self.looks, &mut tell)?,
                Again::Split => self.state.refine(&gathering, &mut *self.looks, &mut tell)?,
                Again::Settle => {
                    let mut rough = self.looks(ROUGH)?;
                    match self.state.settle(&mut *rough, &mut tell)? {
                        Stop::Converged => {
                            self.state.refine(&gathering, &mut *self.looks, &mut tell)?
                        }
                        stop => stop,
                    }
                }
            };
        }
        unreachable!("rounds end")
    }

    /// Chooses how many looks a vertex takes, by how much they disagree at a few places.
    fn look(&mut self, wanted: f64, adjust: &dyn Fn(&mut Effort)) -> Result<(), Error> {
        let (light, ledger) = (self.state.light(), &self.shot.solution.ledger);
        let judged = Judged { light, sources: light, rest: &[], ledger, sweeps: 0 };
        let most = SAMPLING * AIM * SURE * wanted;
        // Without more where they disagree: that is for what these few places do not show.
        let mut looks = match &self.effort.gather {
            Some(gather) => self.device.gather(&self.shot.mesh, gather.rays, f64::INFINITY, 0.0)?,
            None => return Ok(()),
        };
        let sampling = judged.sampling(PROBES, &mut *looks)?;
        let mut effort = self.effort.clone();
        if let Some(gather) = &mut effort.gather {
            let more = (sampling / most).powf(1.0 / NOISE);
            let rays = (f64::from(gather.rays) * more).clamp(LEAST_RAYS, MOST_RAYS);
            (gather.rays, gather.noise) = (rays.ceil() as u32, OUTLIER * most);
            adjust(&mut effort);
        }
        self.effort = effort;
        self.looks = self.looks(1)?;
        Ok(())
    }

    /// Whoever gathers as the effort says, with a part of the looks.
    fn looks(&self, fewer: u32) -> Result<Box<dyn Gather>, Error> {
        let gather = self.effort.gather.as_ref().expect("vertices gather");
        let (rays, noise) = (gather.rays.div_ceil(fewer), gather.noise * f64::from(fewer));
        self.device.gather(&self.shot.mesh, rays, noise, self.state.dim())
    }

    fn gathering(&self) -> &Gathering {
        &self.effort.gather.as_ref().expect("vertices gather").gathering
    }

    /// Sets more effort against the parts of the error that are most of it, if there is any to be set.
    fn improve(
        &mut self,
        certificate: &Certificate,
        wanted: f64,
        adjust: &dyn Fn(&mut Effort),
    ) -> Result<Option<Again>, Error> {
        let Certificate { sampling, mesh, settling, unshot, .. } = *certificate;
        let mut effort = self.effort.clone();
        let Some(gather) = &mut effort.gather else { return Ok(None) };
        let most = highest([sampling, mesh, settling], unshot, AIM * SURE * wanted);
        if settling > most {
            gather.gathering.sweeps += 1;
        }
        if sampling > most {
            let more = (sampling / most).powf(1.0 / NOISE).clamp(1.25, 8.0);
            gather.rays = (f64::from(gather.rays) * more) as u32;
            gather.noise *= (most / sampling).clamp(0.25, 0.8);
        }
        if mesh > most {
            let finer = (most / mesh).clamp(0.6, 0.8);
            gather.gathering.tolerance *= finer;
            gather.gathering.smallest *= finer;
            gather.gathering.curve *= finer;
        }
        adjust(&mut effort);
        if effort == self.effort {
            return Ok(None);
        }
        let (Some(old), Some(new)) = (&self.effort.gather, &effort.gather) else { return Ok(None) };
        let again = if (new.rays, new.noise) != (old.rays, old.noise) {
            if new.gathering.sweeps != old.gathering.sweeps {
                self.state.shine();
            }
            Again::All
        } else if new.gathering.sweeps != old.gathering.sweeps {
            Again::Settle
        } else {
            Again::Split
        };
        self.effort = effort;
        self.looks = self.looks(1)?;
        Ok(Some(again))
    }
}

/// What is to be done again.
enum Again {
    /// All vertices gather.
    All,
    /// What was reached shines, all gather the difference, then elements are split.
    Settle,
    /// Elements are split.
    Split,
}

/// How high the highest of `parts` may be for the squares of all, and of `rest`, to add up to the square
/// of `whole`, if the higher ones are lowered.
fn highest(mut parts: [f64; 3], rest: f64, whole: f64) -> f64 {
    parts.sort_by(f64::total_cmp);
    let mut left = (whole * whole - rest * rest).max(0.1 * whole * whole);
    for (k, part) in parts.iter().enumerate() {
        let most = (left / (parts.len() - k) as f64).sqrt();
        if *part >= most {
            return most;
        }
        left -= part * part;
    }
    f64::INFINITY
}

/// The estimate is brought to this share of what is allowed, since it does not follow to the letter.
const AIM: f64 = 0.9;

/// What rays may be off by, of what all may be: chosen beforehand, as the others follow.
const SAMPLING: f64 = 0.5;

/// Where vertices only light others, their noise is averaged: they take so many times fewer looks.
const ROUGH: u32 = 4;

/// Places whose rays disagree so many times as much as they should on the average get more of them.
const OUTLIER: f64 = 3.0;

/// The error of n rays falls as n to minus this power, or a little faster.
const NOISE: f64 = 0.75;

/// Seconds since `then`, which becomes now.
fn lap(then: &mut Instant) -> f64 {
    let seconds = then.elapsed().as_secs_f64();
    *then = Instant::now();
    seconds
}

/// The estimate has to be below this share of the error asked for.
const SURE: f64 = 0.75;

/// Places at which it is tried how many looks are enough, and how many these can be.
const PROBES: usize = 64;
const LEAST_RAYS: f64 = 128.0;
const MOST_RAYS: f64 = 65536.0;

/// Times that more is done, at most.
const ROUNDS: u32 = 8;

/// The certificate looks at one place for so many that vertices gathered at, three times each.
const GATHERS_A_PLACE: usize = 48;
const LEAST_PLACES: usize = 192;
const MOST_PLACES: usize = 1024;

/// Looks a place where vertices do not gather.
const LOOKS: u32 = 1024;
