//! Whether a bake met the error that was asked for and, if not, what stood in the way.

use std::fmt;

use crate::bake::error_estimate::ErrorEstimate;
use crate::bake::settings::GatherSettings;

/// Whether a bake met the error that was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Outcome {
    /// No error was asked for, but settings or a time.
    Unasked,
    /// The estimated error is at most what was asked for.
    Reached,
    /// It is more, and this stood in the way.
    Missed(Obstacle),
}

/// What kept a bake from the error that was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Obstacle {
    /// More elements were to be split than there may be:
    /// [`RefinementSettings::max_elements`](crate::gather::RefinementSettings::max_elements).
    Elements,
    /// The callback stopped the bake.
    Cancelled,
    /// The time that there was, of [`BakeTarget::Within`](crate::BakeTarget::Within).
    Time,
    /// What was left to refine are settings made by hand.
    Settings,
    /// After all rounds light still changes within elements, as at the edge of a shadow.
    Edges,
    /// After all rounds, with as many rays as allowed, gathers still disagree.
    Rays,
    /// After all rounds a further bounce would still change the light.
    Bounces,
    /// After all rounds paths still find other light than the vertices have, for more than all
    /// other parts: elements blur it, as behind slits, or it falls where no vertex is.
    Sources,
}

impl Obstacle {
    /// What most of `estimate` is from, after all rounds.
    pub(crate) fn largest_part(estimate: &ErrorEstimate) -> Obstacle {
        let ErrorEstimate { mesh, sampling, truncation, unshot, sources, .. } = *estimate;
        let parts = [
            (mesh, Obstacle::Edges),
            (sampling, Obstacle::Rays),
            (libm::hypot(truncation, unshot), Obstacle::Bounces),
            (sources, Obstacle::Sources),
        ];
        let largest = parts.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        largest.map_or(Obstacle::Edges, |(_, obstacle)| obstacle)
    }

    /// The same, and what could be done about it.
    pub fn remedy(self, settings: Option<&GatherSettings>) -> String {
        match self {
            Obstacle::Elements => {
                let count = settings.map_or(0, |s| s.refinement.max_elements);
                format!("allow more than {count} elements, which takes memory and time")
            }
            Obstacle::Cancelled => "start it again and give it time".into(),
            Obstacle::Time => "give it more time, or allow a larger error".into(),
            Obstacle::Settings => "leave settings to the bake".into(),
            Obstacle::Edges => "allow a larger error, or look at the worst groups".into(),
            Obstacle::Rays => "look for small bright sources that are no emitters".into(),
            Obstacle::Bounces => "lower reflectances that are near one".into(),
            Obstacle::Sources => "smaller errors have finer elements, which may resolve it".into(),
        }
    }
}

impl fmt::Display for Obstacle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Obstacle::Elements => "the limit of elements",
            Obstacle::Cancelled => "it was stopped",
            Obstacle::Time => "the time was up",
            Obstacle::Settings => "settings made by hand",
            Obstacle::Edges => "edges of light that the mesh does not resolve",
            Obstacle::Rays => "noise, with as many rays as allowed",
            Obstacle::Bounces => "light that is still on its way",
            Obstacle::Sources => "light that elements blur, as behind slits",
        })
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Outcome::Unasked => f.write_str("no error asked for"),
            Outcome::Reached => f.write_str("reached"),
            Outcome::Missed(obstacle) => write!(f, "missed: {obstacle}"),
        }
    }
}
