//! A matrix held against exact rows, drawn at random.

use radiosity::{Scene, ViewFactors};

use crate::args::Stop;
use crate::progress;

/// What the comparison of some rows has found.
#[derive(Default)]
struct Comparison {
    factors: usize,
    /// Factors within two standard errors of the exact ones; of those that are left out, within
    /// the error asked for.
    within: usize,
    largest_error: f64,
    /// Of factors that are left out.
    largest_missing: f64,
}

/// Compares `rows` rows of `matrix`, of `scene` with these settings, and prints what was found.
pub fn check(
    scene: &Scene,
    matrix: &ViewFactors,
    error: f64,
    two_sided: &[usize],
    rows: usize,
) -> Result<(), Stop> {
    let drawn = draw(rows, matrix.names.len());
    let exact = progress::of_count("rows to check", |report| {
        ViewFactors::exact_rows(scene, error, two_sided, &drawn, report)
    })?;
    let exact = exact.ok_or(Stop::Interrupted)?;
    let mut found = Comparison::default();
    for (&i, row) in drawn.iter().zip(&exact) {
        let mut row = row.iter().peekable();
        for factor in &matrix.factors[i] {
            while let Some(missing) = row.next_if(|exact| exact.to < factor.to) {
                found.add_missing(missing.value, error);
            }
            let exact = row.next_if(|exact| exact.to == factor.to).map_or(0.0, |f| f.value);
            found.add((factor.value - exact).abs(), factor.error);
        }
        row.for_each(|missing| found.add_missing(missing.value, error));
    }
    let Comparison { factors, within, largest_error, largest_missing } = found;
    say!(
        "checked: {factors} factors of {} rows, largest error {largest_error:.1e}, {:.2} % within \
         two standard errors; largest factor left out {largest_missing:.1e}",
        drawn.len(),
        100.0 * within as f64 / factors.max(1) as f64
    );
    Ok(())
}

impl Comparison {
    fn add(&mut self, off: f64, standard_error: f64) {
        self.factors += 1;
        // Rounding of sums, below anything that is told.
        self.within += usize::from(off <= 2.0 * standard_error + 1e-12);
        self.largest_error = self.largest_error.max(off);
    }

    fn add_missing(&mut self, exact: f64, error: f64) {
        self.factors += 1;
        self.within += usize::from(exact <= error);
        self.largest_error = self.largest_error.max(exact);
        self.largest_missing = self.largest_missing.max(exact);
    }
}

/// `count` different numbers below `of`, or all of them: the same on every run.
fn draw(count: usize, of: usize) -> Vec<usize> {
    let mut numbers: Vec<usize> = (0..of).collect();
    fastrand::Rng::with_seed(1).shuffle(&mut numbers);
    numbers.truncate(count);
    numbers.sort_unstable();
    numbers
}
