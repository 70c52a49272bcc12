//! Values for texels without one, from their neighbours.
//!
//! ```text
//!   · · · · ·        · 2 2 2 2       ring by ring, each texel the mean of the up to eight
//!   · · · # #   ──►  2 2 1 1 1       neighbours that have a value already
//!   · · · # #        2 1 1 # #
//! ```

use crate::scene::Rgb;

/// Sets those of `texels` that are not `known` to the mean of their known neighbours, ring by ring,
/// up to `rings` times; ends early if no texel is set.
pub(super) fn fill_from_neighbours(
    values: &mut [Rgb],
    known: &mut [bool],
    [width, height]: [u32; 2],
    mut texels: Vec<u32>,
    rings: usize,
) {
    let neighbours = |texel: u32| {
        let (column, row) = (texel % width, texel / width);
        let rows = row.saturating_sub(1)..(row + 2).min(height);
        let columns = column.saturating_sub(1)..(column + 2).min(width);
        rows.flat_map(move |row| columns.clone().map(move |column| row * width + column))
    };
    for _ in 0..rings {
        let mut filled = vec![];
        texels.retain(|&texel| {
            let known = neighbours(texel).filter(|&k| known[k as usize]);
            let (sum, count) =
                known.fold((Rgb::ZERO, 0), |(sum, n), k| (sum + values[k as usize], n + 1));
            if count > 0 {
                filled.push((texel, sum / f64::from(count)));
            }
            count == 0
        });
        if filled.is_empty() {
            break;
        }
        for (texel, value) in filled {
            (values[texel as usize], known[texel as usize]) = (value, true);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rings_are_filled_from_the_inside() {
        // 1 at the left and 4 at the right of seven texels in a row, twice.
        let mut values = vec![Rgb::ZERO; 14];
        let mut known = vec![false; 14];
        for (texel, value) in [(0, 1.0), (7, 1.0), (6, 4.0), (13, 4.0)] {
            (values[texel], known[texel]) = (Rgb::splat(value), true);
        }
        let texels = (0..14).filter(|&k| !known[k as usize]).collect::<Vec<_>>();
        let mut two = (values.clone(), known.clone());
        fill_from_neighbours(&mut two.0, &mut two.1, [7, 2], texels.clone(), 2);
        let row = |values: &[Rgb]| values[..7].iter().map(|v| v.x).collect::<Vec<_>>();
        assert_eq!(row(&two.0), [1.0, 1.0, 1.0, 0.0, 4.0, 4.0, 4.0]);
        assert_eq!(two.1[..7], [true, true, true, false, true, true, true]);
        fill_from_neighbours(&mut values, &mut known, [7, 2], texels, usize::MAX);
        assert_eq!(row(&values), [1.0, 1.0, 1.0, 2.5, 4.0, 4.0, 4.0]);
        assert_eq!(row(&values), row(&values[7..]));
        // Without known texels, nothing is filled.
        let mut nothing = vec![Rgb::ZERO; 4];
        fill_from_neighbours(&mut nothing, &mut [false; 4], [2, 2], vec![0, 1, 2, 3], usize::MAX);
        assert_eq!(nothing, [Rgb::ZERO; 4]);
    }
}
