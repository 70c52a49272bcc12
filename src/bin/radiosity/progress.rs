//! What is under way, on standard error: a bar on a terminal, which vanishes when the work is done,
//! else a line every few seconds, so that a log of a long bake tells where it is.
//!
//! ```text
//!   stage       share of it that is done                        what is left
//!   reading     –                                               –
//!   meshing     –                                               –
//!   shooting    orders of magnitude of the unshot share         time so far × (1 − share) / share
//!   gathering   vertices of this pass                           the same
//!   estimating  points                                          the same
//!   drawing     pixels                                          the same
//!   writing     –                                               –
//! ```
//!
//! The seconds between lines go on from stage to stage, so that many short ones are no silence.

use std::cell::Cell;
use std::fs::File;
use std::io::Read;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use radiosity::bake::BakeProgress;
use radiosity::gather::Progress as GatherProgress;
use radiosity::solver::Progress;
use radiosity::work::{alone, is_first};
use radiosity::{Error, ErrorKind, Solver};
use serde_json::{Value, json};
use xxhash_rust::xxh3::Xxh3;

use crate::interrupt;

/// Steps of a bar from empty to full.
const STEPS: u64 = 1000;

/// Between lines where standard error is no terminal. Chosen by hand.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// Takes the progress of a bake.
pub type OfBake<'a> = &'a mut dyn FnMut(&BakeProgress) -> ControlFlow<()>;

/// Takes how much is done, and of how much.
pub type OfCount<'a> = &'a mut dyn FnMut(usize, usize) -> ControlFlow<()>;

/// Runs `work` with the progress of a bake shown, and stops it on Ctrl-C. `work` may set the share
/// of unshot light at which shooting ends.
pub fn of_bake<T>(work: impl FnOnce(&Cell<f64>, OfBake) -> T) -> T {
    let mut display = Display::new("meshing");
    let unshot_goal = Cell::new(Solver::default().unshot);
    work(&unshot_goal, &mut |progress| {
        interrupt::catch();
        show(&mut display, progress, unshot_goal.get());
        interrupt::flow()
    })
}

/// Runs `work` with the progress shown of what is counted: `unit` done, of how many. Ctrl-C stops
/// it.
pub fn of_count<T>(unit: &str, work: impl FnOnce(OfCount) -> T) -> T {
    counted(unit, work, interrupt::flow)
}

/// The same where `unit` is that of a result of what Ctrl-C stopped: for as long as the program may
/// go on after that.
pub fn of_result<T>(unit: &str, work: impl FnOnce(OfCount) -> T) -> T {
    counted(unit, work, interrupt::flow_of_results)
}

fn counted<T>(
    unit: &str,
    work: impl FnOnce(OfCount) -> T,
    flow: impl Fn() -> ControlFlow<()>,
) -> T {
    let mut display = Display::new(unit);
    work(&mut |done, of| {
        display.show(unit, share(done, of), &format!("{done} of {of} {unit}"));
        flow()
    })
}

/// Runs `work` with its name shown, and for how long it has run.
pub fn of_stage<T>(name: &str, work: impl FnOnce() -> T) -> T {
    let _display = Display::new(name);
    work()
}

/// Runs `work`, which reads this file, with that shown.
pub fn of_reading<T>(path: &Path, work: impl FnOnce() -> T) -> T {
    of_stage(&format!("reading {}", path.display()), work)
}

/// Runs `work`, which writes this file, with that shown. If it cannot be written there, it is
/// written to the system's folder for temporary files; none if that fails too. Other files are
/// written nevertheless, and [`report_unwritten`] says at the end which were not. Of several
/// processes the first writes.
pub fn of_writing<T>(path: &Path, work: impl Fn(&Path) -> Result<T, Error>) -> Option<T> {
    if !is_first() {
        return None;
    }
    let stage = format!("writing {}", path.display());
    let work = |path: &Path| alone(|| work(path));
    let error = match of_stage(&stage, || work(path)) {
        Ok(done) => {
            locked(&WRITTEN).push(path.into());
            return Some(done);
        }
        Err(error) => error,
    };
    // What no file can hold is not tried again.
    let other = if error.kind() == ErrorKind::File { elsewhere(path).ok() } else { None };
    let done = other.and_then(|other| match work(&other) {
        Ok(done) => Some((done, other)),
        Err(_) => {
            // Its folder goes where nothing else is in it.
            _ = other.parent().map(std::fs::remove_dir);
            None
        }
    });
    let place = match &done {
        Some((_, other)) => format!("; it is in {}", other.display()),
        None => String::new(),
    };
    locked(&UNWRITTEN).push(format!("{error}{place}"));
    done.map(|(done, _)| done)
}

/// A path for the file of this `path` in the system's folder for temporary files.
fn elsewhere(path: &Path) -> std::io::Result<PathBuf> {
    let folder = std::env::temp_dir().join(format!("radiosity-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    Ok(folder.join(path.file_name().unwrap_or_default()))
}

/// The files that were written.
static WRITTEN: Mutex<Vec<PathBuf>> = Mutex::new(vec![]);

/// What is said of those that were not.
static UNWRITTEN: Mutex<Vec<String>> = Mutex::new(vec![]);

/// Adds a file that could not be written.
pub fn add_unwritten(error: &Error) {
    locked(&UNWRITTEN).push(error.to_string());
}

/// Says which files could not be written, if any.
pub fn report_unwritten() -> bool {
    let unwritten = locked(&UNWRITTEN);
    unwritten.iter().for_each(|error| eprintln!("error: {error}"));
    !unwritten.is_empty()
}

/// The files that were written, each with its size and the XXH3-64 of its bytes, as JSON.
pub fn written_files() -> Value {
    let file = |path: &PathBuf| {
        let (bytes, hash) = size_and_hash(path).ok()?;
        let name = path.file_name()?.to_string_lossy();
        Some(json!({ "name": name, "bytes": bytes, "xxh3": format!("{hash:016x}") }))
    };
    // Pipes have no content to be read again.
    locked(&WRITTEN).iter().filter(|path| path.is_file()).filter_map(file).collect()
}

/// The number of bytes of a file, and their XXH3-64: piece by piece, since a file can be large.
pub fn size_and_hash(path: &Path) -> std::io::Result<(u64, u64)> {
    let (mut file, mut hash) = (File::open(path)?, Xxh3::new());
    let (mut buffer, mut size) = (vec![0; 1 << 16], 0);
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok((size, hash.digest())),
            count => {
                hash.update(&buffer[..count]);
                size += count as u64;
            }
        }
    }
}

/// A line of the files that were written, if there are any.
pub fn written() -> Option<String> {
    let files = locked(&WRITTEN);
    let names: Vec<String> = files.iter().map(|path| path.display().to_string()).collect();
    (!names.is_empty()).then(|| format!("wrote      {}", names.join(", ")))
}

/// Prints that line.
pub fn print_written() {
    if let Some(line) = written() {
        say!("{line}");
    }
}

fn share(done: usize, of: usize) -> f64 {
    done as f64 / of.max(1) as f64
}

/// Of the way from 1 to the goal, on a logarithmic scale: each order of magnitude takes about as
/// long as the one before.
fn shot_share(unshot: f64, goal: f64) -> f64 {
    let share = libm::log(unshot) / libm::log(goal);
    if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }
}

fn show(display: &mut Display, progress: &BakeProgress, unshot_goal: f64) {
    match progress {
        BakeProgress::Shooting(Progress { shots, rows_made, unshot_share, .. }) => {
            let text = format!(
                "shooting, {:.3} % unshot, {shots} shots, {rows_made} rows",
                100.0 * unshot_share
            );
            display.show("shooting", shot_share(*unshot_share, unshot_goal), &text);
        }
        BakeProgress::Gathering(gather) => {
            let GatherProgress { pass, refinements, elements, gathered, total, .. } = gather;
            let text = format!(
                "gathering, pass {}, split {refinements} times, {gathered} of {total} vertices, \
                 {elements} elements",
                pass + 1
            );
            let stage = format!("gathering {pass} {refinements}");
            display.show(&stage, share(*gathered, *total), &text);
        }
        BakeProgress::Estimating { samples, of } => {
            let text = format!("estimating the error, {samples} of {of} points");
            display.show("estimating", share(*samples, *of), &text);
        }
        BakeProgress::Estimated(estimate) => {
            display.error = Some(estimate.total);
            display.note(&format!("estimated error {:.2} %", 100.0 * estimate.total));
        }
        BakeProgress::DeviceFailed(error) => {
            display.note(&format!("rays on the CPU go on: {error}"));
        }
        _ => {}
    }
}

/// Shows the stage that is under way, until dropped.
struct Display {
    bar: ProgressBar,
    /// Where standard error is no terminal.
    lines: Option<Lines>,
    stage: String,
    /// When the stage began.
    start: Instant,
    /// The last estimate of the error, a share; none before the first.
    error: Option<f64>,
}

impl Display {
    /// Begins with a stage whose share is not known yet.
    fn new(stage: &str) -> Display {
        let bar = ProgressBar::new(STEPS);
        bar.set_style(style("{spinner} {msg}, {elapsed}"));
        bar.set_message(stage.to_string());
        let lines = bar.is_hidden().then(|| Lines::new(stage));
        if lines.is_none() {
            bar.enable_steady_tick(Duration::from_millis(200));
        }
        Display { bar, lines, stage: stage.to_string(), start: Instant::now(), error: None }
    }

    /// Shows the share of `stage` that is done.
    fn show(&mut self, stage: &str, share: f64, text: &str) {
        if stage != self.stage || self.bar.position() == 0 {
            self.bar.set_style(style("{bar:30} {msg}"));
        }
        if stage != self.stage {
            self.stage = stage.to_string();
            self.start = Instant::now();
        }
        let text = with_time_left(&with_error(text, self.error), share, self.start.elapsed());
        self.bar.set_position((STEPS as f64 * share) as u64);
        if let Some(lines) = &self.lines {
            lines.set(text);
        } else {
            self.bar.set_message(text);
        }
    }

    /// Prints a line that stays, on a terminal.
    fn note(&self, line: &str) {
        self.bar.println(line);
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// `text`, and the error so far, if it is known.
fn with_error(text: &str, error: Option<f64>) -> String {
    match error {
        Some(error) => format!("{text}, error so far {:.2} %", 100.0 * error),
        None => text.to_string(),
    }
}

/// `text`, and how long the rest of a stage takes of which this share is done.
fn with_time_left(text: &str, share: f64, elapsed: Duration) -> String {
    // Before that, the figure jumps.
    if share < 0.02 || elapsed < Duration::from_secs(1) {
        return text.to_string();
    }
    let left = elapsed.as_secs_f64() * (1.0 - share) / share;
    format!("{text}, about {left:.0} s left")
}

/// When the last line was printed, or the program began to work.
static LAST_LINE: Mutex<Option<Instant>> = Mutex::new(None);

/// How long it is `now` until the next line, where the last one was printed at `last`.
fn until_next_line(last: &mut Option<Instant>, now: Instant) -> Duration {
    LINE_INTERVAL.saturating_sub(now.duration_since(*last.get_or_insert(now)))
}

/// A thread that prints a line every few seconds.
struct Lines {
    text: Arc<Mutex<String>>,
    /// Hung up, it ends the thread.
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Lines {
    fn new(text: &str) -> Lines {
        let text = Arc::new(Mutex::new(text.to_string()));
        let (stop, stopped) = mpsc::channel::<()>();
        let shown = Arc::clone(&text);
        let start = Instant::now();
        let until_next = || until_next_line(&mut locked(&LAST_LINE), Instant::now());
        let print = move || {
            while stopped.recv_timeout(until_next()) == Err(RecvTimeoutError::Timeout) {
                eprintln!("{} ({} s)", locked(&shown), start.elapsed().as_secs());
                *locked(&LAST_LINE) = Some(Instant::now());
            }
        };
        Lines { text, stop: Some(stop), thread: Some(std::thread::spawn(print)) }
    }

    fn set(&self, text: String) {
        *locked(&self.text) = text;
    }
}

/// What a mutex holds, which no panic leaves half done.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Drop for Lines {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            // A panic of the thread was printed, and harms nothing.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rest_takes_as_long_as_its_share() {
        let after = |seconds| Duration::from_secs(seconds);
        assert_eq!(with_time_left("drawing", 0.25, after(10)), "drawing, about 30 s left");
        assert_eq!(with_time_left("drawing", 1.0, after(10)), "drawing, about 0 s left");
        for (share, seconds) in [(0.0, 10), (0.01, 10), (0.5, 0)] {
            assert_eq!(with_time_left("drawing", share, after(seconds)), "drawing");
        }
    }

    #[test]
    fn error_is_told_once_it_is_known() {
        assert_eq!(with_error("gathering", None), "gathering");
        assert_eq!(with_error("gathering", Some(0.0512)), "gathering, error so far 5.12 %");
    }

    #[test]
    fn seconds_between_lines_go_on_from_stage_to_stage() {
        let (mut last, start) = (None, Instant::now());
        let after = |seconds| start + Duration::from_secs(seconds);
        assert_eq!(until_next_line(&mut last, start), LINE_INTERVAL);
        assert_eq!(until_next_line(&mut last, after(3)), LINE_INTERVAL - Duration::from_secs(3));
        assert_eq!(until_next_line(&mut last, after(60)), Duration::ZERO);
        assert_eq!(last, Some(start));
    }

    #[test]
    fn each_order_of_magnitude_is_shot_in_the_same_time() {
        for (unshot, want) in [(1.0, 0.0), (0.1, 0.25), (0.01, 0.5), (1e-4, 1.0), (1e-9, 1.0)] {
            assert!((shot_share(unshot, 1e-4) - want).abs() < 1e-12, "{unshot}");
        }
        for (unshot, goal) in [(0.0, 0.0), (f64::NAN, 0.1), (1.0, 1.0), (2.0, 0.1)] {
            assert!((0.0..=1.0).contains(&shot_share(unshot, goal)), "{unshot} {goal}");
        }
    }
}
