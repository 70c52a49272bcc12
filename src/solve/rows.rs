//! Rows for a solver: kept within a memory budget, made again beyond it.

use std::collections::HashMap;
use std::rc::Rc;

use crate::error::Error;
use crate::form_factor::{FormFactors, Row, checked_rows};
use crate::mesh::{Mesh, NodeId};

/// Rows by patch. Once the budget is full, nothing more is kept and nothing is given up: shooting
/// takes the brightest patches first, and those are the ones that shoot again; and who goes through
/// all rows in the same order again and again finds a part of them each time, which giving up the
/// oldest would spoil.
pub(super) struct Rows<'a> {
    mesh: &'a Mesh,
    maker: &'a mut dyn FormFactors,
    kept: HashMap<NodeId, Rc<Row>>,
    free: usize,
    /// Rows made so far.
    pub made: u64,
}

impl<'a> Rows<'a> {
    /// Rows of `mesh` by `maker`, of which `budget` bytes are kept.
    pub fn new(mesh: &'a Mesh, maker: &'a mut dyn FormFactors, budget: usize) -> Rows<'a> {
        Rows { mesh, maker, kept: HashMap::new(), free: budget, made: 0 }
    }

    /// How many rows are best made at once.
    pub fn batch(&self) -> usize {
        self.maker.batch().max(1)
    }

    pub fn get(&self, patch: NodeId) -> Option<&Row> {
        self.kept.get(&patch).map(|row| &**row)
    }

    /// Keeps `row` if it fits.
    pub fn keep(&mut self, patch: NodeId, row: impl Into<Rc<Row>>) {
        let row = row.into();
        if let Some(free) = self.free.checked_sub(row.bytes()) {
            self.free = free;
            self.kept.insert(patch, row);
        }
    }

    /// Makes the rows of `patches`, of which the most that one is about to shoot is `unshot_share`.
    pub fn make(&mut self, patches: &[NodeId], unshot_share: f64) -> Result<Vec<Row>, Error> {
        let made = checked_rows(self.maker, self.mesh, patches, unshot_share)?;
        self.made += made.len() as u64;
        Ok(made)
    }

    /// The rows of the first of `elements`, in their order: as far as one batch of rows made reaches,
    /// and of one element at least. All with the same trouble taken, whatever light they carry, so
    /// that the equations stay what they are from one sweep to the next.
    pub fn next(&mut self, elements: &[usize]) -> Result<Vec<Rc<Row>>, Error> {
        let (mut missing, batch) = (vec![], self.batch());
        let patches = elements.iter().map(|&e| self.mesh.element(e));
        let reached: Vec<NodeId> = patches
            .take_while(|patch| {
                if !self.kept.contains_key(patch) {
                    missing.push(*patch);
                }
                missing.len() <= batch
            })
            .collect();
        missing.truncate(batch);
        let mut made = match missing.is_empty() {
            true => vec![],
            false => self.make(&missing, 1.0)?,
        }
        .into_iter();
        let row = |patch: NodeId| match self.kept.get(&patch) {
            Some(row) => Some(row.clone()),
            None => {
                let row = Rc::new(made.next()?);
                self.keep(patch, row.clone());
                Some(row)
            }
        };
        Ok(reached.into_iter().filter_map(row).collect())
    }
}
