//! Uses one row maker or gatherer until its device fails, then another.
//!
//! ```text
//! request ─► first ─ ok, or an error other than of the device ─► result
//!              │
//!              └ device error e ─► next(e) ─► second: this and all later requests
//! ```
//!
//! Rows and light made by the first stay in use: the solution up to the failure is kept.

use std::fmt;

use crate::error::Error;
use crate::form_factor::{FormFactors, Row};
use crate::gather::{Gather, GatherPoint, IrradianceSample, RadiosityField};
use crate::mesh::{Mesh, NodeId};

/// A first row maker, or gatherer, and a second one that replaces it when its device fails.
///
/// The change is transparent to a solver that uses it as its [`FormFactors`]: flux already
/// distributed stays distributed, and the second makes the remaining rows.
pub struct Fallback<'a, A, B = A> {
    first: A,
    second: Option<B>,
    make_second: MakeSecond<'a, B>,
}

type MakeSecond<'a, B> = Box<dyn FnMut(Error) -> Result<B, Error> + 'a>;

impl<'a, A, B> Fallback<'a, A, B> {
    /// `first` until it fails with an error that [is of its device](Error::is_device_error); then
    /// what `make_second` returns, which gets that error and may return an error instead.
    pub fn new(
        first: A,
        make_second: impl FnMut(Error) -> Result<B, Error> + 'a,
    ) -> Fallback<'a, A, B> {
        Fallback { first, second: None, make_second: Box::new(make_second) }
    }

    /// The first row maker.
    pub fn first(&self) -> &A {
        &self.first
    }

    /// The second row maker, if the first has failed.
    pub fn second(&self) -> Option<&B> {
        self.second.as_ref()
    }

    fn request<T>(
        &mut self,
        first: impl FnOnce(&mut A) -> Result<T, Error>,
        second: impl FnOnce(&mut B) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let maker = match &mut self.second {
            Some(maker) => maker,
            None => match first(&mut self.first) {
                Err(e) if e.is_device_error() => self.second.insert((self.make_second)(e)?),
                done => return done,
            },
        };
        second(maker)
    }
}

impl<A: FormFactors, B: FormFactors> FormFactors for Fallback<'_, A, B> {
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], weight: f64) -> Result<Vec<Row>, Error> {
        self.request(
            |first| first.rows(mesh, patches, weight),
            |second| second.rows(mesh, patches, weight),
        )
    }

    fn preferred_batch_len(&self) -> usize {
        match &self.second {
            Some(second) => second.preferred_batch_len(),
            None => self.first.preferred_batch_len(),
        }
    }

    fn fingerprint(&self) -> String {
        match &self.second {
            Some(second) => second.fingerprint(),
            None => self.first.fingerprint(),
        }
    }
}

impl<A: Gather, B: Gather> Gather for Fallback<'_, A, B> {
    fn gather(
        &mut self,
        field: &RadiosityField,
        points: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error> {
        self.request(|first| first.gather(field, points), |second| second.gather(field, points))
    }

    fn gather_weighted(
        &mut self,
        field: &RadiosityField,
        points: &[GatherPoint],
        weights: &[f64],
    ) -> Result<Vec<IrradianceSample>, Error> {
        self.request(
            |first| first.gather_weighted(field, points, weights),
            |second| second.gather_weighted(field, points, weights),
        )
    }

    fn gather_both(
        &mut self,
        fields: [&RadiosityField; 2],
        points: &[GatherPoint],
    ) -> Result<[Vec<IrradianceSample>; 2], Error> {
        self.request(
            |first| first.gather_both(fields, points),
            |second| second.gather_both(fields, points),
        )
    }

    fn preferred_batch_len(&self) -> usize {
        match &self.second {
            Some(second) => second.preferred_batch_len(),
            None => self.first.preferred_batch_len(),
        }
    }
}

impl<A: fmt::Debug, B: fmt::Debug> fmt::Debug for Fallback<'_, A, B> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut fields = f.debug_struct("Fallback");
        fields.field("first", &self.first).field("second", &self.second).finish_non_exhaustive()
    }
}
