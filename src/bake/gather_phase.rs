//! The second half of a bake: vertices gather, are judged, and gather again where that is needed.

use crate::bake::error_estimate::{ErrorEstimate, ErrorEstimator, LEAST_PLACES};
use crate::bake::fallback::ResilientBackend;
use crate::bake::pipeline::ErrorTarget;
use crate::bake::progress::{BakeProgress, ProgressCallback, report};
use crate::bake::settings::BakeSettings;
use crate::bake::shooting_phase::ShootingPhase;
use crate::error::Error;
use crate::gather::Gather;
use crate::progress::StopReason;
use crate::progress::lap;
use crate::vertex::adaptive::AdaptiveGather;
use crate::vertex::gathering::{GatherProgress, GatheredMesh, RefinementSettings};
use std::ops::ControlFlow;

/// Vertices that gather what was shot.
pub(super) struct GatherPhase<'a> {
    pub effort: BakeSettings,
    pub state: AdaptiveGather<'a>,
    pub looks: Box<dyn Gather + 'a>,
    pub device: &'a ResilientBackend<'a>,
    pub shot: ShootingPhase,
}

impl<'a> GatherPhase<'a> {
    /// Gathers as the effort says, and on until the goal is reached or nothing is left to be done.
    pub fn until(
        mut self,
        goal: Option<ErrorTarget>,
        progress: ProgressCallback,
    ) -> Result<(GatheredMesh, ErrorEstimate, ShootingPhase, BakeSettings), Error> {
        if let Some(ErrorTarget { error: wanted, overrides: adjust }) = goal {
            self.look(wanted, adjust)?;
        }
        let device = self.device;
        let mut tell = |stage: BakeProgress| report(device, &stage, progress);
        let gather = self.effort.gather.as_ref().expect("vertices gather");
        let mut rough = match gather.refinement.sweeps {
            0 | 1 => None,
            _ => Some(self.looks(ROUGH)?),
        };
        let mut stop = gather.refinement.settle(
            &mut self.state,
            &mut *self.looks,
            rough.as_mut().map(|r| &mut **r as &mut dyn Gather),
            &mut |p| tell(BakeProgress::Gathering(*p)),
        )?;
        for round in 0.. {
            let (mut light, rest) = self.state.curved(self.gathering())?;
            self.shot.seconds.vertices += lap(&mut self.shot.since);
            let ledger = &self.shot.solution.ledger;
            let (sources, sweeps) = (self.state.light(), self.gathering().sweeps);
            let judged = ErrorEstimator { light: &light, sources, rest: &rest, ledger, sweeps };
            let count = (light.gathers as usize / GATHERS_A_PLACE).clamp(LEAST_PLACES, MOST_PLACES);
            let mut cancelled = stop == StopReason::Cancelled;
            let (certificate, error) = judged.judge(count, &mut *self.looks, &mut |samples| {
                cancelled =
                    cancelled || tell(BakeProgress::Estimating { samples, of: count }).is_break();
                if cancelled { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            })?;
            light.surface.error = error;
            light.stop = stop;
            self.shot.seconds.estimate += lap(&mut self.shot.since);
            let go = tell(BakeProgress::Estimated(certificate));
            let Some(ErrorTarget { error: wanted, overrides: adjust }) = goal else {
                return Ok((light, certificate, self.shot, self.effort));
            };
            let done = certificate.total <= SURE * wanted
                || stop != StopReason::Converged
                || go.is_break()
                || cancelled
                || round == ROUNDS;
            let again = if done { None } else { self.improve(&certificate, wanted, adjust)? };
            let Some(again) = again else {
                return Ok((light, certificate, self.shot, self.effort));
            };
            let gathering = self.gathering().clone();
            let mut tell = |p: &GatherProgress| tell(BakeProgress::Gathering(*p));
            stop = match again {
                NextStep::All => self.state.sweep(&gathering, &mut *self.looks, &mut tell)?,
                NextStep::Split => self.state.refine(&gathering, &mut *self.looks, &mut tell)?,
                NextStep::Settle => {
                    let mut rough = self.looks(ROUGH)?;
                    match self.state.settle(&mut *rough, &mut tell)? {
                        StopReason::Converged => {
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
    fn look(&mut self, wanted: f64, adjust: &dyn Fn(&mut BakeSettings)) -> Result<(), Error> {
        let (light, ledger) = (self.state.light(), &self.shot.solution.ledger);
        let judged = ErrorEstimator { light, sources: light, rest: &[], ledger, sweeps: 0 };
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
            (gather.rays, gather.noise_tolerance) = (rays.ceil() as u32, OUTLIER * most);
            adjust(&mut effort);
        }
        self.effort = effort;
        self.looks = self.looks(1)?;
        Ok(())
    }

    /// Whoever gathers as the effort says, with a part of the looks.
    fn looks(&self, fewer: u32) -> Result<Box<dyn Gather + 'a>, Error> {
        let gather = self.effort.gather.as_ref().expect("vertices gather");
        let (rays, noise) =
            (gather.rays.div_ceil(fewer), gather.noise_tolerance * f64::from(fewer));
        self.device.gather(&self.shot.mesh, rays, noise, self.state.dim())
    }

    fn gathering(&self) -> &RefinementSettings {
        &self.effort.gather.as_ref().expect("vertices gather").refinement
    }

    /// Sets more effort against the parts of the error that are most of it, if there is any to be set.
    fn improve(
        &mut self,
        certificate: &ErrorEstimate,
        wanted: f64,
        adjust: &dyn Fn(&mut BakeSettings),
    ) -> Result<Option<NextStep>, Error> {
        let ErrorEstimate { sampling, mesh, truncation: settling, unshot, .. } = *certificate;
        let mut effort = self.effort.clone();
        let Some(gather) = &mut effort.gather else { return Ok(None) };
        let most = highest([sampling, mesh, settling], unshot, AIM * SURE * wanted);
        if settling > most {
            gather.refinement.sweeps += 1;
        }
        if sampling > most {
            let more = (sampling / most).powf(1.0 / NOISE).clamp(1.25, 8.0);
            gather.rays = (f64::from(gather.rays) * more) as u32;
            gather.noise_tolerance *= (most / sampling).clamp(0.25, 0.8);
        }
        if mesh > most {
            let finer = (most / mesh).clamp(0.6, 0.8);
            gather.refinement.tolerance *= finer;
            gather.refinement.smallest *= finer;
            gather.refinement.curve *= finer;
        }
        adjust(&mut effort);
        if effort == self.effort {
            return Ok(None);
        }
        let (Some(old), Some(new)) = (&self.effort.gather, &effort.gather) else { return Ok(None) };
        let again = if (new.rays, new.noise_tolerance) != (old.rays, old.noise_tolerance) {
            if new.refinement.sweeps != old.refinement.sweeps {
                self.state.shine();
            }
            NextStep::All
        } else if new.refinement.sweeps != old.refinement.sweeps {
            NextStep::Settle
        } else {
            NextStep::Split
        };
        self.effort = effort;
        self.looks = self.looks(1)?;
        Ok(Some(again))
    }
}

/// What is to be done again.
enum NextStep {
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
const MOST_PLACES: usize = 1024;
