//! Detects groups with an undetermined temperature.

use super::surface::{Boundary, Surface, of_group};
use crate::error::Error;
use crate::geometry::union_find::UnionFind;
use crate::view_factor::ViewFactors;

/// Whether each group with given flux exchanges heat, directly or through others, with something
/// that has a temperature: a group that absorbs, the surroundings, or backs of surfaces, which are
/// cold.
pub(super) fn check(
    factors: &ViewFactors,
    surfaces: &[Surface],
    bands: usize,
) -> Result<(), Error> {
    // A node for each group in each band: light stays in its band, except where groups with given
    // flux absorb it and emit again.
    let node = |group: usize, band: usize| group * bands + band;
    let mut sets = UnionFind::new(surfaces.len() * bands);
    for (i, row) in factors.factors.iter().enumerate() {
        for factor in row.iter().filter(|f| f.value > 0.0) {
            (0..bands).for_each(|band| sets.join(node(i, band), node(factor.to as usize, band)));
        }
    }
    let absorbing = |i: usize| (0..bands).filter(move |&band| surfaces[i].emissivity[band] > 0.0);
    let has_flux = |i: usize| matches!(surfaces[i].boundary, Boundary::NetFlux(_));
    for i in (0..surfaces.len()).filter(|&i| has_flux(i)) {
        if let Some(first) = absorbing(i).next() {
            absorbing(i).for_each(|band| sets.join(node(i, first), node(i, band)));
        }
    }
    let mut is_anchored = vec![false; surfaces.len() * bands];
    // Shares below 1e-12 are rounding.
    let lost_to_backs = (0..surfaces.len())
        .filter(|&i| factors.back[i].value > 3.0 * factors.back[i].error + 1e-12);
    for i in factors.open_rows().into_iter().chain(lost_to_backs) {
        (0..bands).for_each(|band| is_anchored[sets.find(node(i, band))] = true);
    }
    for i in (0..surfaces.len()).filter(|&i| !has_flux(i)) {
        absorbing(i).for_each(|band| is_anchored[sets.find(node(i, band))] = true);
    }
    for i in (0..surfaces.len()).filter(|&i| has_flux(i)) {
        if let Some(first) = absorbing(i).next()
            && !is_anchored[sets.find(node(i, first))]
        {
            let found = "a net flux, and nothing in sight that has a temperature and absorbs";
            let remedy = "give one group of its enclosure a temperature and an emissivity above 0";
            return Err(of_group(&factors.names[i], found, remedy));
        }
    }
    Ok(())
}
