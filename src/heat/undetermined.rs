//! Detects groups with an undetermined temperature.

use super::bodies::{Body, bodies};
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
    let bodies = bodies(factors, surfaces);
    // The nodes at which a body absorbs.
    let absorbing = |body: &Body| {
        let rows = body.sides.iter().map(|side| side.row);
        let nodes = rows.flat_map(|row| (0..bands).map(move |band| (row, band)));
        let absorbs = |&(row, band): &(usize, usize)| surfaces[row].emissivity[band] > 0.0;
        nodes.filter(absorbs).map(|(row, band)| node(row, band)).collect::<Vec<usize>>()
    };
    let has_flux = |body: &&Body| matches!(body.boundary, Boundary::NetFlux(_));
    for body in bodies.iter().filter(has_flux) {
        let nodes = absorbing(body);
        nodes.iter().for_each(|&node| sets.join(nodes[0], node));
    }
    let mut is_anchored = vec![false; surfaces.len() * bands];
    // Shares below 1e-12 are rounding.
    let lost_to_backs = (0..surfaces.len())
        .filter(|&i| factors.back[i].value > 3.0 * factors.back[i].error + 1e-12);
    for i in factors.open_rows().into_iter().chain(lost_to_backs) {
        (0..bands).for_each(|band| is_anchored[sets.find(node(i, band))] = true);
    }
    for body in bodies.iter().filter(|body| !has_flux(body)) {
        absorbing(body).iter().for_each(|&node| is_anchored[sets.find(node)] = true);
    }
    for body in bodies.iter().filter(has_flux) {
        if let Some(&first) = absorbing(body).first()
            && !is_anchored[sets.find(first)]
        {
            let found = "a net flux, and nothing in sight that has a temperature and absorbs";
            let remedy = "give one group of its enclosure a temperature and an emissivity above 0";
            return Err(of_group(&factors.names[body.sides[0].row], found, remedy));
        }
    }
    Ok(())
}
