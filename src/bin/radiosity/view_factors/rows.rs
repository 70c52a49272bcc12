//! Rows of a matrix: all or some, kept while they are made, and gone on from.

use std::ops::{ControlFlow, Range};
use std::path::Path;
use std::time::{Duration, Instant};

use radiosity::io::view_factors::{read_rows, write_rows};
use radiosity::view_factor::PartialMatrix;
use radiosity::work::is_first;
use radiosity::{Error, ErrorKind, Scene, ViewFactors};

use super::{ToError, group_indices};
use crate::args::{self, Parsed, Stop, give};
use crate::{interrupt, progress};

/// `A..B`.
pub fn range(text: &str) -> Parsed<Range<usize>> {
    let ends = text.split_once("..").and_then(|(a, b)| Some(a.parse().ok()?..b.parse().ok()?));
    let rising = ends.filter(|range: &Range<usize>| range.start < range.end);
    rising.ok_or_else(|| give("A..B, from 0, such as 0..500"))
}

/// GiB.
pub fn memory(text: &str) -> Parsed<f64> {
    let positive = text.parse().ok().filter(|gib: &f64| *gib > 0.0);
    positive.ok_or_else(|| give("GiB, more than 0, such as 8"))
}

impl ToError {
    /// The whole matrix, in the first process.
    pub fn matrix(&self, scene: &Scene) -> Result<Option<ViewFactors>, Stop> {
        let all = 0..self.matrix_rows(scene)?.names.len();
        let rows = self.rows(scene, all)?;
        Ok(if is_first() { Some(rows.into_matrix()?) } else { None })
    }

    /// Makes `rows` and writes them, beside others with this `stem`.
    pub fn write_rows(&self, scene: &Scene, rows: Range<usize>, stem: &Path) -> Result<(), Stop> {
        let path = stem.with_added_extension(format!("{}-{}.rows", rows.start, rows.end));
        args::check_writable(&path)?;
        let part = self.rows(scene, rows)?;
        progress::of_writing(&path, |path| write_rows(path, &part));
        say!("{}: rows of {} groups are missing", path.display(), part.missing().len());
        Ok(())
    }

    /// Those of `rows` that are not in the checkpoint, if there is one, and all that is in it.
    fn rows(&self, scene: &Scene, rows: Range<usize>) -> Result<PartialMatrix, Stop> {
        let groups = group_indices(scene, &self.two_sided, self.facets)?;
        self.check_memory(scene, &groups)?;
        let Some(checkpoint) = &self.checkpoint else {
            let go = |_: &PartialMatrix| ControlFlow::Continue(());
            return Ok(self.make(scene, &groups, rows, None, go)?);
        };
        args::check_writable(checkpoint)?;
        let done = match checkpoint.exists() {
            true => Some(progress::of_reading(checkpoint, || read_rows(checkpoint))?),
            false => None,
        };
        interrupt::catch();
        let second = Duration::from_secs(1);
        let (mut written, mut interval, mut failure) = (Instant::now(), second, None);
        let part = self.make(scene, &groups, rows, done, |part| {
            if is_first() && written.elapsed() > interval {
                let start = Instant::now();
                failure = write_rows(checkpoint, part).err();
                // Writing takes a twentieth of the time at most.
                interval = second.max(20 * start.elapsed());
                written = Instant::now();
            }
            match failure {
                Some(_) => ControlFlow::Break(()),
                None => interrupt::flow(),
            }
        })?;
        if let Some(failure) = failure {
            return Err(failure.into());
        }
        if is_first() {
            write_rows(checkpoint, &part)?;
        }
        if interrupt::stopped() { Err(Stop::Interrupted) } else { Ok(part) }
    }

    /// Whether the whole matrix will likely do with the memory that it may take.
    fn check_memory(&self, scene: &Scene, two_sided: &[usize]) -> Result<(), Error> {
        let Some(allowed) = self.memory else { return Ok(()) };
        let predict = || ViewFactors::predicted_size(scene, self.error, two_sided);
        let size = progress::of_stage("predicting the size of the matrix", predict)?;
        let gib = size.bytes as f64 / f64::from(1 << 30);
        let predicted = format!("about {} factors, {gib:.2} GiB", size.factors);
        if gib > allowed {
            let remedy = "allow more, or ask for a larger --error";
            return Err(Error::new(ErrorKind::Setting, "--memory", predicted, remedy));
        }
        say!("predicted: {predicted}");
        Ok(())
    }

    fn make(
        &self,
        scene: &Scene,
        groups: &[usize],
        rows: Range<usize>,
        done: Option<PartialMatrix>,
        mut keep: impl FnMut(&PartialMatrix) -> ControlFlow<()>,
    ) -> Result<PartialMatrix, Error> {
        progress::of_count("polygons", |report| {
            let told = |part: &PartialMatrix, done, of| {
                report(done, of)?;
                keep(part)
            };
            PartialMatrix::make(scene, self.error, groups, rows, done, told)
        })
    }
}
