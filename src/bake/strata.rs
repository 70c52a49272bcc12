//! The groups of a scene as strata: how many random points each gets.
//!
//! Every group has some points however small it is, and the rest follow its share of the area or of
//! the light, whichever is larger. Where there are very many groups the small ones are one stratum.

use std::ops::Range;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::sampling::octaves::Part;

/// Groups that are strata of their own: the largest. All others are one stratum.
const MAX_GROUPS: usize = 64;

/// How many random points there are to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SampleCounts {
    /// Over all.
    pub total: usize,
    /// On each group, at least, as far as there are not too many groups.
    pub per_group: usize,
}

/// A face that reflects, or a part of it. There is one for every face: small, so that they take
/// less memory than the mesh.
pub(super) struct SampledPart {
    pub face: u32,
    pub group: u32,
    pub part: Part,
    /// The area times the relative error that is expected there. Its square would be what the part
    /// is expected to add to the squared error; but errors are seldom what is expected, and of four
    /// bakes with some 50 000 points each, squared errors varied least by points spread like this:
    /// their variance was 0.84, 0.41, 0.85 and 0.10 of that by squares relative to the mean light.
    pub error: f64,
    /// The area times the reflected radiosity, W: a length over the channels.
    pub flux: f64,
}

/// The parts of a stratum, and the points that it gets.
pub(super) struct StratumParts {
    pub group: Option<u32>,
    /// Where its parts are in the list of all.
    pub parts: Range<usize>,
    pub area: f64,
    pub flux: f64,
    pub samples: usize,
}

/// The strata of `parts`: the largest groups, and one for all others if there are too many. Brings
/// the parts of each together, otherwise in the order that they had.
pub(super) fn strata_of(parts: &mut [SampledPart], counts: SampleCounts) -> Vec<StratumParts> {
    let mut by_group: Vec<StratumParts> = vec![];
    let mut index = FxHashMap::default();
    for part in &*parts {
        let k = *index.entry(part.group).or_insert_with(|| {
            let group = Some(part.group);
            by_group.push(StratumParts { group, parts: 0..0, area: 0.0, flux: 0.0, samples: 0 });
            by_group.len() - 1
        });
        by_group[k].area += part.part.area;
        by_group[k].flux += part.flux;
        by_group[k].parts.end += 1;
    }
    let total: f64 = by_group.iter().map(|s| s.area).sum();
    let total_flux: f64 = by_group.iter().map(|s| s.flux).sum::<f64>().max(f64::MIN_POSITIVE);
    by_group.sort_by(|a, b| b.area.total_cmp(&a.area).then(a.group.cmp(&b.group)));
    let rank_of = |(rank, stratum): (usize, &StratumParts)| Some((stratum.group?, rank));
    let rank: FxHashMap<u32, usize> = by_group.iter().enumerate().filter_map(rank_of).collect();
    parts.par_sort_by_key(|part| rank[&part.group]);
    let single = if counts.per_group > 0 { MAX_GROUPS } else { 0 };
    if by_group.len() > single.max(1) {
        let small = by_group.split_off(single);
        let area = small.iter().map(|s| s.area).sum();
        let flux = small.iter().map(|s| s.flux).sum();
        let count = small.iter().map(|s| s.parts.len()).sum();
        by_group.push(StratumParts { group: None, parts: 0..count, area, flux, samples: 0 });
    }
    let mut first = 0;
    for stratum in &mut by_group {
        let share = (stratum.area / total).max(stratum.flux / total_flux);
        let even = (share * counts.total as f64).round() as usize;
        stratum.samples = even.max(counts.per_group).max(1);
        stratum.parts = first..first + stratum.parts.len();
        first = stratum.parts.end;
    }
    by_group
}

#[cfg(test)]
mod tests {
    use super::*;

    fn face(group: u32, area: f64, flux: f64) -> SampledPart {
        let part = Part { corners: None, area, angular: area };
        SampledPart { face: group, group, part, error: 0.0, flux }
    }

    #[test]
    fn small_and_bright_groups_have_points() {
        let mut faces = vec![face(0, 1e6, 1.0), face(1, 1.0, 99.0), face(2, 1.0, 0.0)];
        let strata = strata_of(&mut faces, SampleCounts { total: 200, per_group: 8 });
        let found: Vec<_> = strata.iter().map(|s| (s.group, s.samples)).collect();
        // By area, by light, and the least.
        assert_eq!(found, [(Some(0), 200), (Some(1), 198), (Some(2), 8)]);
    }

    #[test]
    fn groups_beyond_the_largest_are_one_stratum() {
        let count = MAX_GROUPS as u32 + 10;
        let mut faces: Vec<SampledPart> =
            (0..count).map(|g| face(g, f64::from(g + 1), 1.0)).collect();
        let strata = strata_of(&mut faces, SampleCounts { total: 100, per_group: 1 });
        assert_eq!(strata.len(), MAX_GROUPS + 1);
        assert_eq!(strata[0].group, Some(count - 1), "the largest first");
        let rest = &strata[MAX_GROUPS];
        assert_eq!((rest.group, rest.parts.len(), rest.area), (None, 10, 55.0));
        let groups = faces[rest.parts.clone()].iter().map(|part| part.group);
        assert!(groups.eq((0..10).rev()), "the others, in one place");
        let all = strata_of(
            &mut [face(3, 1.0, 0.0), face(4, 1.0, 0.0)],
            SampleCounts { total: 64, per_group: 0 },
        );
        assert_eq!((all.len(), all[0].group, all[0].samples), (1, None, 64), "for a pilot");
    }
}
