//! Long work on many items: in batches with progress between them, shared with other processes,
//! kept in a journal, its costs recorded.
//!
//! ```text
//!                        ┌ in the journal ──────────────────────────────────┐
//! items ─► Batches::next ┤                                                  ├─► results, in order
//!                        └ else ─► alone: one batch, by all threads ────────┤
//!                               └► ranks: parts of a batch, on demand, ─────┘
//!                                         exchanged          └► appended to the journal
//! ```
//!
//! All long loops of the crate are `Batches`. Who computes an item, and when, changes no result:
//! every process runs the same program, and makes the same calls in the same order. What could make
//! them differ is agreed upon: the ends of batches, the clock, and whether to go on
//! ([`agree`]).
//!
//! ```text
//! Batches          a list with progress     parts on demand; results exchanged after each batch
//! map              a list without           the same; one batch
//! map_blocks       a list by its data       each process has the data of its own blocks
//! with_costs ─► Costs ─► simulate           the time that a run would take on more processes
//! ```
//!
//! What is made when it is first asked for ([`std::sync::OnceLock`]) contains none of these: a
//! process may ask earlier than another.
//!
//! Processes and a journal belong to the thread that runs the program, as the thread pool of rayon
//! does: [`with_ranks`], [`with_journal`]. Functions in between know nothing of them.

mod batches;
mod blocks;
mod costs;
mod journal;
mod ranks;
mod simulation;
mod team;

pub(crate) use batches::{Batches, map};
pub(crate) use blocks::{is_own, map_blocks};
pub use costs::Costs;
pub use journal::{Journal, JournalPart};
pub use ranks::{Alone, Ranks};
pub use simulation::{Cluster, SimulatedTime};
pub use team::{
    agree, alone, from_first, is_first, processes, with_costs, with_journal, with_ranks,
};
pub(crate) use team::{is_shared, now};
