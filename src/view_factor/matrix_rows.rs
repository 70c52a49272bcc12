//! The rows of a matrix: the front of each group, then the back of each two-sided group.

use std::collections::HashSet;

use serde::{Deserialize, Serialize};

/// Names and sides of the rows of a matrix, which are those of its columns.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MatrixRows {
    /// Fronts have the names of their groups, backs the same with ` (back)`. No two are equal.
    pub names: Vec<String>,
    /// Per row, the row of the front that it is the back of; `None` for fronts.
    pub back_of: Vec<Option<u32>>,
}

impl MatrixRows {
    /// The rows for `groups`, of which those of index `two_sided` have two sides.
    ///
    /// # Panics
    /// When there is no such group.
    pub fn new(groups: &[String], two_sided: &[usize]) -> MatrixRows {
        let mut rows = MatrixRows { names: groups.to_vec(), back_of: vec![None; groups.len()] };
        let mut sheets = two_sided.to_vec();
        sheets.sort_unstable();
        sheets.dedup();
        let mut known: HashSet<String> = HashSet::new();
        if !sheets.is_empty() {
            known.extend(groups.iter().cloned());
        }
        for sheet in sheets {
            let back = unused(format!("{} (back)", groups[sheet]), |name| known.contains(name));
            known.insert(back.clone());
            rows.names.push(back);
            rows.back_of.push(Some(sheet as u32));
        }
        rows
    }

    /// Number of rows.
    pub(super) fn count(&self) -> usize {
        self.names.len()
    }

    /// Per row, the row of its back; `None` for backs, and for fronts of one-sided groups.
    pub(super) fn backs(&self) -> Vec<Option<u32>> {
        let mut backs = vec![None; self.count()];
        for (row, front) in (0..).zip(&self.back_of) {
            if let Some(front) = front {
                backs[*front as usize] = Some(row);
            }
        }
        backs
    }

    /// Whether each row has a side, and backs are those of fronts, one each: rows that were read
    /// from a file may be anything.
    pub(super) fn is_consistent(&self) -> bool {
        self.back_of.len() == self.count() && are_sides(&self.back_of)
    }
}

/// Whether these are fronts, and backs of fronts, at most one of each.
pub(crate) fn are_sides(back_of: &[Option<u32>]) -> bool {
    let is_front = |row: &u32| back_of.get(*row as usize) == Some(&None);
    let mut known = HashSet::new();
    back_of.iter().flatten().all(|front| is_front(front) && known.insert(front))
}

/// `name`, in as many parentheses as it takes to differ from all that are used.
pub(super) fn unused(mut name: String, is_used: impl Fn(&str) -> bool) -> String {
    while is_used(&name) {
        name = format!("({name})");
    }
    name
}
