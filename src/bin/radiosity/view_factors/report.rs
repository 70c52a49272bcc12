//! What is printed of a matrix: its checks, and its factors.

use radiosity::view_factor::{BackMet, ErrorStats, Estimate, Missing};
use radiosity::{Scene, ViewFactors};

/// Groups in a warning at most.
const PRINTED: usize = 8;

/// Prints closure, reciprocity and bounds of the raw numbers, and which groups see out.
pub fn print_checks(m: &ViewFactors) {
    let checks = m.checks();
    let name = |i: usize| &m.names[i];
    let r = checks.reciprocity;
    say!("closure: {:.1e} RMS, {:.1e} worst", checks.closure.rms, checks.closure.max);
    say!("reciprocity: {:.1e} RMS, {:.1e} worst", r.rms, r.max);
    if let Some((from, to)) = m.worst_out_of_bounds() {
        let Estimate { value, error } = m.factor(from, to);
        let largest = (m.areas[to] / m.areas[from]).min(1.0);
        let (excess, from, to) = ((value - largest).max(-value), name(from), name(to));
        say!("bounds: exceeded by up to {excess:.1e} ± {error:.1e}, from {from} to {to}");
    } else {
        say!("bounds: kept within rounding and errors");
    }
    let ErrorStats { max: excess, at: (row, _), .. } = checks.row_sums;
    // Above the rounding of sums of thousands of factors.
    if excess > 1e-12 {
        let error = m.open[row].error;
        say!("sums of rows: above 1 by up to {excess:.1e} ± {error:.1e}, in {}", name(row));
    } else {
        say!("sums of rows: none above 1");
    }
    if let Some(&worst) = m.rows_over_unity().first() {
        // Rays meet surfaces in one place once.
        let cause = match m.absent {
            Missing::Zero => "are two surfaces in one place?",
            Missing::Unmet => "that is more than three of its standard errors, which are too small",
        };
        let (name, Estimate { value, error }) = (name(worst), m.open[worst]);
        let excess = -value;
        eprintln!(
            "warning: more than all of {name}'s flux arrives, {excess:.3e} ± {error:.1e} too much: \
             {cause}"
        );
    }
    print_losses(m);
}

/// Prints which groups see out of the scene, and which see backs.
fn print_losses(m: &ViewFactors) {
    let (count, leaks, to_backs) = (m.names.len(), m.open_rows(), m.rows_that_meet_backs());
    if let Some(&worst) = leaks.first() {
        let (name, share) = (&m.names[worst], m.open[worst].value);
        eprintln!(
            "warning: {} of {count} groups see out of the scene; {name} loses most, {share:.3e}",
            leaks.len()
        );
    }
    if !to_backs.is_empty() {
        let share = |&i: &usize| format!("{} {:.3} %", m.names[i], 100.0 * m.back[i].value);
        let shares: Vec<String> = to_backs.iter().take(PRINTED).map(share).collect();
        eprintln!(
            "warning: {} of {count} groups see backs of surfaces, where their flux is lost: \
             {}{}; a sheet that has space on both sides is a group of --two-sided, a surface that \
             faces the wrong way has its corners in the wrong order",
            to_backs.len(),
            shares.join(", "),
            and_more(to_backs.len())
        );
    }
    if leaks.is_empty() && to_backs.is_empty() {
        say!("closed: no group sees out, none sees a back");
    }
}

/// Prints at whose backs the flux of group `from` arrives, and what to try.
pub fn print_backs_met(m: &ViewFactors, scene: &Scene, from: usize, met: &[BackMet]) {
    let name = |back: &BackMet| scene.groups()[back.group].as_str();
    let share = |back: &BackMet| format!("{:.3} % at that of {}", 100.0 * back.share, name(back));
    let shares: Vec<String> = met.iter().take(PRINTED).map(share).collect();
    let options = met.iter().take(PRINTED).map(|back| format!("--two-sided \"{}\"", name(back)));
    eprintln!(
        "  backs that {} sees: {}{}; for sheets {}",
        m.names[from],
        shares.join(", "),
        and_more(met.len()),
        options.collect::<Vec<_>>().join(" ")
    );
}

/// The number of those after the printed ones.
fn and_more(count: usize) -> String {
    match count.saturating_sub(PRINTED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    }
}

/// Warns of groups that are called as columns of the tables are.
pub fn print_column_names(m: &ViewFactors) {
    for own in ["open", "back", "area"] {
        let column = m.column_name(own);
        if column != own {
            eprintln!("warning: a group is called '{own}': the column of this name is '{column}'");
        }
    }
}

/// Prints the factors of every group, each with its error.
pub fn print_factors(m: &ViewFactors) {
    let [open, back] = ["open", "back"].map(|name| m.column_name(name));
    let names = m.names.iter().chain([&open, &back]);
    let width = names.map(|n| n.chars().count()).max().unwrap_or(0);
    say!("{:>width$} → {:<width$} {:>12} {:>9}", "from", "to", "F", "± error");
    let line = |from: &str, to: &str, e: Estimate| {
        say!("{from:>width$} → {to:<width$} {:12.9} {:9.1e}", e.value, e.error);
    };
    for (i, from) in m.names.iter().enumerate() {
        for f in &m.factors[i] {
            let e = Estimate { value: f.value, error: f.error };
            line(from, &m.names[f.to as usize], e);
        }
        line(from, &open, m.open[i]);
        line(from, &back, m.back[i]);
    }
}
