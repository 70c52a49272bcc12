//! One device until it fails, then another: what was solved by then stays.

use std::fmt;

use crate::error::Error;
use crate::form_factor::{FormFactors, Row};
use crate::gather::{Gather, GatherPoint, IrradianceSample, RadiosityField};
use crate::mesh::{Mesh, NodeId};

/// Who makes rows, or gathers, until its device fails, and who goes on from there.
///
/// A solver that asks a relay for rows never learns that the first device was lost: what was spread
/// stays spread, and the second makes the rows that are still wanted.
pub struct Fallback<'a, A, B = A> {
    first: A,
    second: Option<B>,
    next: Next<'a, B>,
}

type Next<'a, B> = Box<dyn FnMut(Error) -> Result<B, Error> + 'a>;

impl<'a, A, B> Fallback<'a, A, B> {
    /// `first` until it fails with an error that [is of its device](Error::is_of_device); then whom
    /// `next` gives, which is told of the error and may return one instead.
    pub fn new(first: A, next: impl FnMut(Error) -> Result<B, Error> + 'a) -> Fallback<'a, A, B> {
        Fallback { first, second: None, next: Box::new(next) }
    }

    /// Who began.
    pub fn first(&self) -> &A {
        &self.first
    }

    /// Who goes on, once the first has failed.
    pub fn second(&self) -> Option<&B> {
        self.second.as_ref()
    }

    fn ask<T>(
        &mut self,
        first: impl FnOnce(&mut A) -> Result<T, Error>,
        second: impl FnOnce(&mut B) -> Result<T, Error>,
    ) -> Result<T, Error> {
        if self.second.is_none() {
            match first(&mut self.first) {
                Err(e) if e.is_device_error() => self.second = Some((self.next)(e)?),
                done => return done,
            }
        }
        second(self.second.as_mut().expect("set above"))
    }
}

impl<A: FormFactors, B: FormFactors> FormFactors for Fallback<'_, A, B> {
    fn rows(
        &mut self,
        mesh: &Mesh,
        patches: &[NodeId],
        unshot_share: f64,
    ) -> Result<Vec<Row>, Error> {
        self.ask(
            |first| first.rows(mesh, patches, unshot_share),
            |second| second.rows(mesh, patches, unshot_share),
        )
    }

    fn preferred_batch_len(&self) -> usize {
        self.second
            .as_ref()
            .map_or(self.first.preferred_batch_len(), |second| second.preferred_batch_len())
    }

    fn fingerprint(&self) -> String {
        self.second.as_ref().map_or_else(|| self.first.fingerprint(), |second| second.fingerprint())
    }
}

impl<A: Gather, B: Gather> Gather for Fallback<'_, A, B> {
    fn gather(
        &mut self,
        sources: &RadiosityField,
        places: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error> {
        self.ask(|first| first.gather(sources, places), |second| second.gather(sources, places))
    }
}

impl<A: fmt::Debug, B: fmt::Debug> fmt::Debug for Fallback<'_, A, B> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut relay = f.debug_struct("Relay");
        relay.field("first", &self.first).field("second", &self.second).finish_non_exhaustive()
    }
}
