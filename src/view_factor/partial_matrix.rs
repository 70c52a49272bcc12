//! A partial matrix: the exchange of some of its polygons with later ones.
//!
//! Pairs are computed once, in the row of the earlier polygon. So half of the exchange of a group
//! is in its own rows and half in those of others: rows become a matrix when all are there.

use std::collections::VecDeque;
use std::ops::{ControlFlow, Range};

use rayon::prelude::*;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

use super::matrix::{Estimate, Factor, Missing, ViewFactors};
use super::matrix_rows::MatrixRows;
use super::scene_polygons::ScenePolygons;
use crate::error::{Error, ErrorKind, quoted};
use crate::scene::Scene;
use crate::work::{Batches, agree, is_first};

/// Begins every file; the last byte is the version.
const MAGIC: &[u8; 8] = b"radipar\x02";

/// Bytes of the checksum at the end of every file.
const CHECKSUM_BYTES: usize = 8;

/// Pieces of rows of the first batch, or as many as there are threads. Plain choice.
const BATCH: usize = 4;

/// Method of computing a matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Method {
    Exact,
    Sparse,
}

/// Finished rows of a matrix of view factors, of some groups or all.
///
/// For distributing work between independent processes, and for resuming a stopped process: it can
/// be stored as bytes, and [`PartialMatrix::merge`] combines several. The matrix has the same bits
/// however its rows were combined.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartialMatrix {
    /// Hash of the scene and the settings.
    input: u64,
    method: Method,
    matrix_rows: MatrixRows,
    /// Divisor of all lengths.
    unit: f64,
    /// Area of each row of the matrix, in squares of `unit`.
    areas: Vec<f64>,
    /// Row of the matrix of each polygon, ascending.
    groups: Vec<u32>,
    /// Row of each polygon, if it is done.
    rows: Vec<Option<PolygonRow>>,
}

/// A₁F₁₂ from one polygon to later polygons of its own group and to later groups, in squares of the
/// unit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct PolygonRow {
    /// By ascending group.
    pub fronts: Vec<Exchange>,
    /// To the backs of all groups together.
    pub back: Exchange,
}

/// Exchange of a polygon with a group.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Exchange {
    /// The group.
    pub to: u32,
    /// Standard error.
    pub error: f32,
    pub value: f64,
}

impl Exchange {
    pub fn new(to: u32, of: Estimate) -> Exchange {
        Exchange { to, value: of.value, error: of.error as f32 }
    }

    pub fn estimate(&self) -> Estimate {
        Estimate { value: self.value, error: self.error.into() }
    }
}

/// Rows being computed, and their progress callback.
pub(super) struct Making<'a> {
    pub part: PartialMatrix,
    pub progress: &'a mut dyn FnMut(&PartialMatrix, usize, usize) -> ControlFlow<()>,
}

impl Making<'_> {
    /// Reports progress; `None` if that stops the work in any process.
    pub fn report(&mut self, done: usize, of: usize) -> Option<()> {
        agree((self.progress)(&self.part, done, of)).is_continue().then_some(())
    }

    /// Makes the rows of the polygons `wanted`, ascending, from `pieces` of them in that order:
    /// `work` of each piece, and `row` of all results of a polygon. `progress` turns the number of
    /// rows done into what is reported. `None` if stopped. Of several processes the first has the
    /// rows.
    pub fn rows_of_pieces<P: Sync, R: Send + Sync + Serialize + DeserializeOwned>(
        &mut self,
        wanted: &[u32],
        pieces: &[(u32, P)],
        progress: impl Fn(usize) -> (usize, usize),
        work: impl Fn(u32, &P) -> R + Sync,
        row: impl Fn(u32, Vec<R>) -> PolygonRow,
    ) -> Option<()> {
        let (mut left, mut remaining) = (wanted, pieces);
        let mut batches = Batches::new(BATCH).at_least(rayon::current_num_threads());
        let mut made: VecDeque<(u32, R)> = VecDeque::new();
        while !left.is_empty() {
            if !remaining.is_empty() {
                let work = |(s, piece): &(u32, P)| work(*s, piece);
                let (batch, results) = batches
                    .next(&mut remaining, |batch| batch.par_iter().map(work).collect::<Vec<R>>());
                made.extend(batch.iter().map(|(s, _)| *s).zip(results));
            }
            // Rows are whole up to that of the next piece.
            let next = remaining.first().map_or(u32::MAX, |(s, _)| *s);
            let (whole, rest) = left.split_at(left.partition_point(|&s| s < next));
            for &s in whole {
                let own = made.iter().take_while(|(of, _)| *of == s).count();
                let results = made.drain(..own).map(|(_, result)| result).collect();
                let row = row(s, results);
                if is_first() {
                    self.part.rows[s as usize] = Some(row);
                }
            }
            left = rest;
            let (done, of) = progress(wanted.len() - left.len());
            self.report(done, of)?;
        }
        Some(())
    }
}

impl PartialMatrix {
    /// The matrix of `scene` without any row.
    pub(super) fn none(
        scene: &Scene,
        error: f64,
        two_sided: &[usize],
        method: Method,
        polygons: &ScenePolygons,
    ) -> PartialMatrix {
        let fronts = &polygons.fronts;
        let groups: Vec<u32> = fronts.polygons.iter().map(|polygon| polygon.group).collect();
        PartialMatrix {
            input: input_hash(scene, error, two_sided),
            method,
            matrix_rows: fronts.rows.clone(),
            unit: polygons.unit,
            areas: fronts.areas.clone(),
            rows: vec![None; groups.len()],
            groups,
        }
    }

    /// Indices of the rows of the matrix that are missing.
    pub fn missing(&self) -> Vec<usize> {
        let rows = self.rows.iter().zip(&self.groups).filter(|(row, _)| row.is_none());
        let mut missing: Vec<usize> = rows.map(|(_, &group)| group as usize).collect();
        missing.dedup();
        missing
    }

    /// Combines the rows of `parts`.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `parts` is empty, or they belong to different scenes or
    /// settings.
    pub fn merge(parts: impl IntoIterator<Item = PartialMatrix>) -> Result<PartialMatrix, Error> {
        let mut parts = parts.into_iter();
        let Some(mut merged) = parts.next() else {
            let remedy = "give one or more";
            return Err(Error::new(ErrorKind::Setting, "parts of a matrix", "none", remedy));
        };
        for (part, number) in parts.zip(2..) {
            merged.check_fits(&part, &format!("part {number} of a matrix"))?;
            for (row, other) in merged.rows.iter_mut().zip(part.rows) {
                *row = row.take().or(other);
            }
        }
        Ok(merged)
    }

    /// The method of computing it.
    pub(super) fn method(&self) -> Method {
        self.method
    }

    /// The polygons of these rows of the matrix that have no row yet.
    pub(super) fn polygons_without_rows(&self, groups: Range<usize>) -> Vec<u32> {
        let is_wanted = |&s: &u32| {
            groups.contains(&(self.groups[s as usize] as usize)) && self.rows[s as usize].is_none()
        };
        (0..self.groups.len() as u32).filter(is_wanted).collect()
    }

    /// Whether `other` belongs to the same input.
    pub(super) fn check_fits(&self, other: &PartialMatrix, place: &str) -> Result<(), Error> {
        let same = self.input == other.input
            && self.method == other.method
            && self.matrix_rows == other.matrix_rows
            && self.areas == other.areas
            && self.groups == other.groups;
        if same {
            return Ok(());
        }
        let (found, remedy) = ("rows of another scene, or of other settings", "make them anew");
        Err(Error::new(ErrorKind::Setting, place, found, remedy))
    }

    /// The matrix.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when rows are missing; names some of their groups.
    pub fn into_matrix(self) -> Result<ViewFactors, Error> {
        let missing = self.missing();
        if !missing.is_empty() {
            let names = &self.matrix_rows.names;
            let some: Vec<&str> = missing.iter().take(3).map(|&i| names[i].as_str()).collect();
            let found = format!("rows of {} groups missing: {}", missing.len(), quoted(&some));
            let remedy = "make them, and merge them with these";
            return Err(Error::new(ErrorKind::Setting, "parts of a matrix", found, remedy));
        }
        let areas = &self.areas;
        let counts = self.most_factors();
        let mut factors: Vec<Vec<Factor>> = counts.into_iter().map(Vec::with_capacity).collect();
        let mut back = vec![Estimate::default(); areas.len()];
        let mut rows = self.rows.into_iter().zip(&self.groups).peekable();
        for i in 0..areas.len() {
            // Of all polygons of group i.
            let (mut to_fronts, mut to_backs) = (vec![], vec![]);
            while let Some((row, _)) = rows.next_if(|(_, group)| **group as usize == i) {
                let PolygonRow { fronts, back } = row.unwrap_or_default();
                to_fronts.extend(fronts);
                to_backs.push(back.estimate());
            }
            back[i] = Estimate::sum(to_backs).over(areas[i]);
            to_fronts.sort_by_key(|exchange| exchange.to);
            for of_group in to_fronts.chunk_by(|a, b| a.to == b.to) {
                let to = of_group[0].to;
                // Pairs within a group are computed once and count both ways.
                let ways = if i == to as usize { 2.0 } else { 1.0 };
                let both_ways = |exchange: &Exchange| exchange.estimate().times(ways);
                let sum = Estimate::sum(of_group.iter().map(both_ways));
                let mut push = |from: usize, to: u32| {
                    let Estimate { value, error } = sum.over(areas[from]);
                    factors[from].push(Factor { to, value, error });
                };
                push(i, to);
                if to as usize != i {
                    push(to as usize, i as u32);
                }
            }
        }
        let open = open_shares(&factors, &back, areas);
        let areas = areas.iter().map(|area| area * self.unit * self.unit).collect();
        let absent = match self.method {
            Method::Exact => Missing::Zero,
            Method::Sparse => Missing::Unmet,
        };
        let MatrixRows { names, back_of } = self.matrix_rows;
        Ok(ViewFactors { names, back_of, areas, factors, open, back, absent })
    }

    /// Factors of each row of the matrix, at most: as many where each group is one polygon.
    fn most_factors(&self) -> Vec<usize> {
        let mut counts = vec![0; self.areas.len()];
        for (row, &from) in self.rows.iter().zip(&self.groups) {
            for exchange in row.iter().flat_map(|row| &row.fronts) {
                counts[from as usize] += 1;
                counts[exchange.to as usize] += usize::from(exchange.to != from);
            }
        }
        // Its polygons may see the same groups.
        counts.into_iter().map(|count| count.min(self.areas.len())).collect()
    }

    /// Serializes the rows, for a file or another process.
    ///
    /// # Panics
    /// Never: serialization to a vector cannot fail.
    pub fn to_bytes(&self) -> Vec<u8> {
        let bytes = postcard::to_extend(self, MAGIC.to_vec());
        let mut bytes = bytes.expect("a vector takes all bytes");
        bytes.extend(xxh3_64(&bytes).to_le_bytes());
        bytes
    }

    /// Reads the bytes that [`PartialMatrix::to_bytes`] wrote.
    ///
    /// # Errors
    /// [`ErrorKind::File`] when these bytes are something else, or damaged.
    pub fn from_bytes(bytes: &[u8]) -> Result<PartialMatrix, Error> {
        let refuse = |found: &str| {
            let remedy = "give rows that this version has written";
            Err(Error::new(ErrorKind::File, "part of a matrix", found, remedy))
        };
        let Some(content) = bytes.strip_prefix(MAGIC) else {
            return refuse("not a part of a matrix, or that of another version");
        };
        let Some((content, checksum)) = content.split_last_chunk::<CHECKSUM_BYTES>() else {
            return refuse("a file that breaks off");
        };
        if xxh3_64(&bytes[..bytes.len() - CHECKSUM_BYTES]).to_le_bytes() != *checksum {
            return refuse("damaged, its checksum does not match");
        }
        match postcard::from_bytes::<PartialMatrix>(content) {
            Ok(part) if part.is_consistent() => Ok(part),
            _ => refuse("damaged, it has numbers that no matrix has"),
        }
    }

    /// Whether this is a valid partial matrix; one that was read from a file may not be.
    fn is_consistent(&self) -> bool {
        let is_size = |x: f64| x.is_finite() && x >= 0.0;
        let groups = self.matrix_rows.count();
        let is_exchange = |e: &Exchange| {
            (e.to as usize) < groups && is_size(e.value) && is_size(f64::from(e.error))
        };
        let is_row = |row: &PolygonRow| {
            row.fronts.iter().chain([&row.back]).all(is_exchange)
                && row.fronts.is_sorted_by(|a, b| a.to < b.to)
        };
        // The group of the exchange with backs is always the first.
        self.matrix_rows.is_consistent()
            && self.areas.len() == groups
            && self.areas.iter().copied().all(is_size)
            && self.unit.is_finite()
            && self.unit > 0.0
            && self.groups.is_sorted()
            && self.groups.last().is_none_or(|&last| (last as usize) < groups)
            && self.rows.len() == self.groups.len()
            && self.rows.iter().flatten().all(is_row)
    }
}

/// A hash of all inputs of a matrix.
fn input_hash(scene: &Scene, error: f64, two_sided: &[usize]) -> u64 {
    let mut hash = Xxh3::new();
    hash.update(&error.to_le_bytes());
    two_sided.iter().for_each(|&group| hash.update(&(group as u64).to_le_bytes()));
    for (t, triangle) in scene.triangles().iter().enumerate() {
        let corners = scene.corners(t).map(|corner| corner.to_array());
        corners.as_flattened().iter().for_each(|x| hash.update(&x.to_le_bytes()));
        hash.update(&triangle.group.to_le_bytes());
    }
    hash.digest()
}

/// The remainder of each row: 1 less all that arrives anywhere.
fn open_shares(factors: &[Vec<Factor>], back: &[Estimate], areas: &[f64]) -> Vec<Estimate> {
    let mut open = Vec::with_capacity(areas.len());
    for ((row, back), &area) in factors.iter().zip(back).zip(areas) {
        if area == 0.0 {
            open.push(Estimate::default());
            continue;
        }
        let sum: f64 = row.iter().map(|f| f.value).sum();
        let squares: f64 = row.iter().map(|f| f.error.powi(2)).sum();
        let error = (squares + back.error.powi(2)).sqrt();
        open.push(Estimate { value: 1.0 - sum - back.value, error });
    }
    open
}
