//! Long work: on threads of its own, without the interpreter's lock, and stopped by Ctrl-C.
//!
//! ```text
//!   calling thread                               pool, made for this call
//!   waits, 20 times a second: signals and  ◄──── newest report
//!   the caller's function           ──── stop ─► asked for at the next report
//! ```
//!
//! A pool for each call works after a fork too, where threads of an older one are gone.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use pyo3::exceptions::{PyMemoryError, PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use radiosity::{Error, ErrorKind};

/// Time between looks at signals and calls of the caller's function.
const INTERVAL: Duration = Duration::from_millis(50);

/// As much as the main thread has elsewhere.
const STACK_BYTES: usize = 8 << 20;

/// What the caller's function is called with.
#[derive(Clone, Debug, Default)]
struct State {
    stage: &'static str,
    /// In [0, 1]; none where it is not known.
    done: Option<f64>,
    error: Option<f64>,
    is_new: bool,
    is_over: bool,
}

/// Where work reports how far it is, and learns whether to go on.
#[derive(Debug, Default)]
pub struct Reporter {
    state: Mutex<State>,
    changed: Condvar,
    stop: AtomicBool,
}

impl Reporter {
    /// Reports the `stage`, and which share of it is done.
    pub fn report(&self, stage: &'static str, done: Option<f64>) -> ControlFlow<()> {
        self.change(|state| (state.stage, state.done, state.is_new) = (stage, done, true));
        self.flow()
    }

    /// Reports how many of how many parts of a stage are done.
    pub fn count(&self, stage: &'static str, done: usize, of: usize) -> ControlFlow<()> {
        self.report(stage, (of > 0).then(|| done as f64 / of as f64))
    }

    /// Reports an estimate of the error.
    pub fn error(&self, error: f64) -> ControlFlow<()> {
        self.change(|state| (state.error, state.is_new) = (Some(error), true));
        self.flow()
    }

    /// Whether the work was asked to stop.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn flow(&self) -> ControlFlow<()> {
        if self.is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn change(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// Waits until the work is over, and at most for an interval; the state then.
    fn wait(&self) -> State {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.changed.wait_timeout_while(state, INTERVAL, |state| !state.is_over);
        let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let now = state.clone();
        state.is_new = false;
        now
    }
}

/// Says that the work is over, however it ends.
struct Over<'a>(&'a Reporter);

impl Drop for Over<'_> {
    fn drop(&mut self) {
        self.0.change(|state| state.is_over = true);
        self.0.changed.notify_all();
    }
}

/// What work came to.
pub struct Done<T> {
    pub result: T,
    /// What stopped it: `KeyboardInterrupt`, or what the caller's function raised.
    pub raised: Option<PyErr>,
}

/// Runs `work` on `threads` threads, 0 for as many as there are cores. `progress` is the caller's
/// function of (stage, done, error, seconds), which stops the work by `False` or by raising.
pub fn run<T: Send>(
    py: Python<'_>,
    threads: usize,
    progress: Option<Bound<'_, PyAny>>,
    work: impl FnOnce(&Reporter) -> Result<T, Error> + Send,
) -> PyResult<Done<T>> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).stack_size(STACK_BYTES);
    let pool = pool.build().map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
    let progress = progress.map(Bound::unbind);
    let (reporter, start) = (Reporter::default(), Instant::now());
    let mut raised = None;
    let result = py.detach(|| {
        std::thread::scope(|scope| {
            let worker = scope.spawn(|| {
                let _over = Over(&reporter);
                pool.install(|| work(&reporter))
            });
            loop {
                let state = reporter.wait();
                if state.is_over {
                    return worker.join();
                }
                if let Err(e) = look(&state, progress.as_ref(), start, &reporter) {
                    reporter.stop.store(true, Ordering::Relaxed);
                    raised.get_or_insert(e);
                }
            }
        })
    });
    match result {
        Ok(result) => Ok(Done { result: result.map_err(raise)?, raised }),
        Err(_) => Err(PyRuntimeError::new_err("the library panicked: please report it")),
    }
}

/// As [`run`], where stopped work leaves nothing: what stopped it is raised.
pub fn run_whole<T: Send>(
    py: Python<'_>,
    threads: usize,
    progress: Option<Bound<'_, PyAny>>,
    work: impl FnOnce(&Reporter) -> Result<Option<T>, Error> + Send,
) -> PyResult<T> {
    let Done { result, raised } = run(py, threads, progress, work)?;
    match (result, raised) {
        (_, Some(raised)) => Err(raised),
        (Some(result), None) => Ok(result),
        (None, None) => Err(Stopped::new_err("stopped by the progress function")),
    }
}

/// As [`run_whole`], for work that is done in a moment: what it does in parallel is on threads of
/// its own, too.
pub fn run_at_once<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<T, Error> + Send,
) -> PyResult<T> {
    run_whole(py, 0, None, |_| work().map(Some))
}

pyo3::create_exception!(
    radiosity,
    Stopped,
    PyRuntimeError,
    "The progress function stopped work that leaves nothing until it is done."
);

/// Handles signals, and calls the caller's function if there is something new.
fn look(
    state: &State,
    progress: Option<&Py<PyAny>>,
    start: Instant,
    reporter: &Reporter,
) -> PyResult<()> {
    Python::attach(|py| {
        py.check_signals()?;
        let Some(progress) = progress.filter(|_| state.is_new && !reporter.is_stopped()) else {
            return Ok(());
        };
        let seconds = start.elapsed().as_secs_f64();
        let answer = progress.call1(py, (state.stage, state.done, state.error, seconds))?;
        if answer.bind(py).is(&*pyo3::types::PyBool::new(py, false)) {
            reporter.stop.store(true, Ordering::Relaxed);
        }
        Ok(())
    })
}

/// The exception for an error of the library.
pub fn raise(error: Error) -> PyErr {
    let message = error.to_string();
    match error.kind() {
        ErrorKind::File => PyOSError::new_err(message),
        ErrorKind::Memory => PyMemoryError::new_err(message),
        ErrorKind::Device => PyRuntimeError::new_err(message),
        _ => PyValueError::new_err(message),
    }
}
