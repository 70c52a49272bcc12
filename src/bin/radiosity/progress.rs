//! Progress bars on standard error; they vanish when the work is done, and where standard error is
//! no terminal there are none.

use std::ops::ControlFlow;

use indicatif::{ProgressBar, ProgressStyle};
use radiosity::BakeProgress;
use radiosity::gather::Progress as GatherProgress;
use radiosity::solver::Progress;

/// Steps of a bar from empty to full.
const STEPS: usize = 1000;

/// Takes the progress of a bake.
pub type OfBake<'a> = &'a mut dyn FnMut(&BakeProgress) -> ControlFlow<()>;

/// Takes how much is done, and of how much.
pub type OfCount<'a> = &'a mut dyn FnMut(usize, usize) -> ControlFlow<()>;

/// A bar that fills from 0 to [`STEPS`], with a message behind it.
fn bar() -> ProgressBar {
    let bar = ProgressBar::new(STEPS as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {msg}") {
        bar.set_style(style);
    }
    bar
}

/// Runs `work` with a bar that shows the progress of a bake.
pub fn of_bake<T>(work: impl FnOnce(OfBake) -> T) -> T {
    let bar = bar();
    let result = work(&mut |progress| {
        show(&bar, progress);
        ControlFlow::Continue(())
    });
    bar.finish_and_clear();
    result
}

/// Runs `work` with a bar for what is counted: `unit` done, of how many.
pub fn of_count<T>(unit: &str, work: impl FnOnce(OfCount) -> T) -> T {
    let bar = bar();
    let result = work(&mut |done, of| {
        bar.set_position(share(done, of));
        bar.set_message(format!("{done} of {of} {unit}"));
        ControlFlow::Continue(())
    });
    bar.finish_and_clear();
    result
}

fn share(done: usize, of: usize) -> u64 {
    (STEPS * done / of.max(1)) as u64
}

/// The bar fills while light is shot with the share of it that is shot, else with what is counted.
fn show(bar: &ProgressBar, progress: &BakeProgress) {
    match progress {
        BakeProgress::Shooting(Progress { shots, rows_made, unshot_share, elapsed, .. }) => {
            bar.set_position((STEPS as f64 * (1.0 - unshot_share).clamp(0.0, 1.0)) as u64);
            bar.set_message(format!(
                "shooting, {:.3} % unshot, {shots} shots, {rows_made} hemicubes, {:.1} s",
                100.0 * unshot_share,
                elapsed.as_secs_f64()
            ));
        }
        BakeProgress::Gathering(gather) => {
            let GatherProgress {
                pass: sweep,
                refinements: level,
                elements,
                gathered,
                total: of,
                ..
            } = gather;
            bar.set_position(share(*gathered, *of));
            bar.set_message(format!(
                "gathering, sweep {}, split {level} times, {gathered} of {of} vertices, \
                 {elements} elements",
                sweep + 1
            ));
        }
        BakeProgress::Estimating { samples, of } => {
            bar.set_position(share(*samples, *of));
            bar.set_message(format!("estimating the error, {samples} of {of} points"));
        }
        BakeProgress::Estimated(estimate) => {
            bar.println(format!("estimated error {:.2} %", 100.0 * estimate.total));
        }
        BakeProgress::DeviceFailed(error) => {
            bar.println(format!("rays on the CPU go on: {error}"));
        }
        _ => {}
    }
}
