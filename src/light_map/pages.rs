//! Several maps: pages of one size, or one for each group, side by side in one texture.
//!
//! ```text
//!   ┌────────┬─────┬──┐
//!   │ page 1 │  2  │3 │     What gathers, corrects and fills texels knows one texture. Charts keep
//!   │        ├─────┘  │     their padding from the borders of pages, so that no page shows in
//!   ├────┬───┤        │     another.
//!   │ 4  │ 5 │        │
//!   └────┴───┴────────┘
//! ```

/// What has a light map of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Maps {
    /// All surfaces have one.
    #[default]
    One,
    /// Surfaces are spread over as many as they need, with so many texels along a side.
    Pages(u32),
    /// Each group of the scene has one, with coordinates in [0, 1] of its own.
    EachGroup,
}

/// A rectangle of texels of an atlas: a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Page {
    /// The only group in it, as an index of [`Scene::groups`](crate::Scene::groups), where each has
    /// a map.
    pub group: Option<u32>,
    /// Column and row of its first texel in the atlas.
    pub origin: [u32; 2],
    /// Texels in a row, and rows.
    pub size: [u32; 2],
}

/// Pages of these `sizes` and `groups`, in rows from left to right, the highest first, and the size
/// of all of them.
pub(super) fn arranged(sizes: &[[u32; 2]], groups: &[Option<u32>]) -> (Vec<Page>, [u32; 2]) {
    let area: f64 = sizes.iter().map(|[w, h]| f64::from(*w) * f64::from(*h)).sum();
    let widest = sizes.iter().map(|size| size[0]).max().unwrap_or(0);
    let width = widest.max(area.sqrt().ceil() as u32);
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|&k| std::cmp::Reverse(sizes[k][1]));
    let mut pages: Vec<Page> = sizes
        .iter()
        .zip(groups)
        .map(|(&size, &group)| Page { group, origin: [0, 0], size })
        .collect();
    let ([mut x, mut y], mut row, mut used) = ([0, 0], 0, 0);
    for k in order {
        let [w, h] = sizes[k];
        if x + w > width {
            ([x, y], row) = ([0, y + row], 0);
        }
        pages[k].origin = [x, y];
        x += w;
        (row, used) = (row.max(h), used.max(x));
    }
    (pages, [used, y + row])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_are_apart_and_fill_most_of_the_texture() {
        let sizes: Vec<[u32; 2]> = (0..40u32).map(|k| [8 + k * 37 % 90, 8 + k * 53 % 70]).collect();
        let (pages, size) = arranged(&sizes, &[None; 40]);
        let mut owners = vec![0; (size[0] * size[1]) as usize];
        for Page { origin: [x, y], size: [w, h], .. } in pages {
            for (column, row) in (x..x + w).flat_map(|c| (y..y + h).map(move |r| (c, r))) {
                owners[(row * size[0] + column) as usize] += 1;
            }
        }
        assert!(owners.iter().all(|&count| count <= 1));
        let filled = owners.iter().sum::<u32>() as f64 / owners.len() as f64;
        assert!(filled > 0.7, "{filled}");
        let (pages, size) = arranged(&[[64, 32]], &[Some(3)]);
        assert_eq!((pages[0].origin, size), ([0, 0], [64, 32]));
    }
}
