//! An open graphics device: errors of wgpu become errors of the crate, and waits time out.
//!
//! ```text
//! with_error_scopes(work)      push scopes → work() → pop scopes → an error, or work's result
//! retry_with_smaller_batches   make(batch), make(batch/2), … until it fits in memory
//! wait                         until all submitted work is done
//! ```
//!
//! A lost device stays lost: the reason is recorded once, and every later use returns it.

use std::sync::{Arc, Mutex};

use futures_channel::oneshot;

use super::error::{device_error, invalid_result, message};
use super::limits::{self, GpuLimits};
use super::memory::{Memory, MemoryBudget};
use super::traced_scene::TracedScene;
use super::tracing::Tracing;
use super::{adapters, wait};
use crate::backend::adapter::{AdapterInfo, AdapterKind};
use crate::error::{Error, ErrorKind};
use crate::gather::lights::Lights;
use crate::scene::Scene;

/// An open graphics device. Clones are the same device.
#[derive(Clone, Debug)]
pub struct Gpu {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    adapter: AdapterInfo,
    assumed: AdapterKind,
    limits: GpuLimits,
    /// Why the device is lost, or an error outside of any error scope.
    lost: Arc<Mutex<Option<String>>>,
    budget: Arc<MemoryBudget>,
    pub(super) tracing: Arc<Tracing>,
}

impl Gpu {
    /// Opens an adapter whose name contains `name` in any case, or the best one: discrete before
    /// integrated before virtual before software.
    ///
    /// Without a `name`, wgpu's environment variables choose: `WGPU_ADAPTER_NAME` and
    /// `WGPU_BACKEND` (`vulkan`, `metal`, `dx12`).
    ///
    /// # Errors
    /// [`ErrorKind::Device`] when there is no such adapter; the message lists the available ones,
    /// or names the packages that install one.
    pub fn new(name: Option<&str>) -> Result<Gpu, Error> {
        Gpu::within(name, &GpuLimits::NONE)
    }

    /// As [`Gpu::new`], but as if the device had at most `limits`: to leave memory for other
    /// programs, or to test a scene on a lesser device.
    ///
    /// # Errors
    /// Those of [`Gpu::new`].
    pub fn within(name: Option<&str>, limits: &GpuLimits) -> Result<Gpu, Error> {
        let adapter = adapters::choose(name)?;
        let (device, queue) = adapters::open(&adapter, limits)?;
        let gpu = Gpu::from_parts(device, queue, limits);
        let lost = gpu.lost.clone();
        gpu.device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| record(&lost, message(&e))));
        let lost = gpu.lost.clone();
        gpu.device.set_device_lost_callback(move |reason, message| {
            let why = match reason {
                wgpu::DeviceLostReason::Destroyed => "closed",
                _ => message.trim(),
            };
            record(&lost, format!("the device was lost: {why}"));
        });
        // All passes of rays are ready when the scene is loaded. Browsers compile on their own.
        if gpu.assumed != AdapterKind::Cpu && cfg!(not(target_family = "wasm")) {
            let (device, tracing) = (gpu.device.clone(), gpu.tracing.clone());
            std::thread::spawn(move || {
                tracing.gather_pipelines(&device);
                tracing.row_pipelines(&device);
            });
        }
        Ok(gpu)
    }

    /// Uses a device and queue of the caller's, within `limits`.
    ///
    /// No feature is required; with [`wgpu::Features::TIMESTAMP_QUERY`] the passes are timed
    /// separately ([`crate::bake::Timings`]). The limits of [`wgpu::Limits::default`], WebGPU's,
    /// are sufficient; larger buffers and textures allow larger scenes and resolutions.
    ///
    /// The caller's callbacks for uncaptured errors and for a lost device are kept. Errors of this
    /// crate's own calls are caught in error scopes, which belong to the calling thread, and
    /// returned; a lost device is detected when results do not arrive. All queued work is waited
    /// for, the caller's included. [`Gpu::close`] destroys the device for the caller too.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when the device was opened with limits too low for the passes; the
    /// message names the limit and its minimum.
    pub fn from_wgpu(
        device: wgpu::Device,
        queue: wgpu::Queue,
        limits: &GpuLimits,
    ) -> Result<Gpu, Error> {
        wait::check()?;
        limits::check_device(&device.adapter_info().name, &device.limits())?;
        Ok(Gpu::from_parts(device, queue, limits))
    }

    fn from_parts(device: wgpu::Device, queue: wgpu::Queue, limits: &GpuLimits) -> Gpu {
        let adapter = adapters::describe(device.adapter_info());
        let limits = limits.within(&device.limits());
        let budget = Arc::new(MemoryBudget::new(limits.memory));
        Gpu {
            device,
            queue,
            assumed: adapter.kind,
            adapter,
            limits,
            lost: Arc::default(),
            budget,
            tracing: Arc::default(),
        }
    }

    /// Description of the adapter.
    pub fn adapter(&self) -> &AdapterInfo {
        &self.adapter
    }

    /// The same device, with row makers and gatherers chosen as on an adapter of this `kind`: lets
    /// a software device run the methods of hardware, which takes longer.
    pub fn assuming(self, kind: AdapterKind) -> Gpu {
        Gpu { assumed: kind, ..self }
    }

    /// The kind of adapter that choices are based on: its own, unless another is assumed.
    pub(crate) fn assumed_kind(&self) -> AdapterKind {
        self.assumed
    }

    /// Destroys the device. All clones and users of it get [`ErrorKind::Device`] from now on.
    pub fn close(&self) {
        self.device.destroy();
    }

    /// Usable limits of the device: its own, or lower requested ones.
    pub(super) fn limits(&self) -> GpuLimits {
        self.limits
    }

    /// Allocates buffers and textures within this device's budget.
    pub(super) fn memory(&self) -> Memory {
        let (device, queue) = (self.device.clone(), self.queue.clone());
        Memory::new(device, queue, self.adapter.name.clone(), self.budget.clone())
    }

    /// Runs `work` and returns an error of the device during it: in this order a loss, out of
    /// memory, or a validation error; each is likely to cause the next. The device stays usable
    /// unless it was lost.
    pub(super) fn with_error_scopes<T>(
        &self,
        work: impl FnOnce() -> Result<T, Error>,
    ) -> Result<T, Error> {
        use wgpu::ErrorFilter::{Internal, OutOfMemory, Validation};
        self.check()?;
        let scopes = [Internal, Validation, OutOfMemory].map(|f| self.device.push_error_scope(f));
        let result = work();
        // Scopes are popped in reverse order, all before the first is waited for.
        let popped: Vec<_> = scopes.into_iter().rev().map(wgpu::ErrorScopeGuard::pop).collect();
        let errors: Vec<wgpu::Error> = popped.into_iter().filter_map(wait::block_on).collect();
        self.check()?;
        let Some(error) = errors.into_iter().next() else { return result };
        let kind = match error {
            wgpu::Error::OutOfMemory { .. } => ErrorKind::Memory,
            _ => ErrorKind::Device,
        };
        Err(self.device_error(kind, message(&error)).with_source(error))
    }

    /// The result of `make` for the largest batch that fits in memory: `batch`, or a half, a
    /// quarter … of it.
    pub(super) fn retry_with_smaller_batches<T>(
        &self,
        mut batch: u32,
        make: impl Fn(Memory, u32) -> Result<T, Error>,
    ) -> Result<T, Error> {
        loop {
            match self.with_error_scopes(|| make(self.memory(), batch)) {
                Err(e) if e.kind() == ErrorKind::Memory && batch > 1 => {
                    batch /= 2;
                    self.free_unused()?;
                }
                made => return made,
            }
        }
    }

    /// Frees buffers and textures that have been dropped: once writes to them have completed.
    pub(super) fn free_unused(&self) -> Result<(), Error> {
        self.with_error_scopes(|| {
            self.queue.submit([]);
            self.wait()
        })
    }

    /// The scene of `lights`, which is `scene`, on the device: uploaded unless it is the previous
    /// one.
    pub(super) fn traced_scene(
        &self,
        scene: &Arc<Scene>,
        lights: &Lights,
    ) -> Result<Arc<TracedScene>, Error> {
        let upload = || self.with_error_scopes(|| TracedScene::new(self.memory(), lights));
        self.tracing.scene(scene, upload)
    }

    /// Waits until all submitted work is done.
    pub(super) fn wait(&self) -> Result<(), Error> {
        let (sender, receiver) = oneshot::channel();
        self.queue.on_submitted_work_done(move || _ = sender.send(()));
        self.answer(None, receiver)
    }

    /// What `receiver` is sent once this submission and all before it are done; with `None`, once
    /// all are.
    fn answer<T>(
        &self,
        submission: Option<wgpu::SubmissionIndex>,
        receiver: oneshot::Receiver<T>,
    ) -> Result<T, Error> {
        self.check()?;
        let is_lost = || self.check().is_err();
        let answer = wait::answer(&self.device, &self.queue, submission, receiver, is_lost);
        self.check()?;
        answer.map_err(|why| {
            record(&self.lost, why.clone());
            self.device_error(ErrorKind::Device, why)
        })
    }

    /// Calls `read` with the bytes that `submission` has copied to a mappable buffer. The caller
    /// unmaps it.
    pub(super) fn read_mapped<T>(
        &self,
        slice: wgpu::BufferSlice,
        submission: wgpu::SubmissionIndex,
        read: impl FnOnce(&[u8]) -> T,
    ) -> Result<T, Error> {
        let (sender, receiver) = oneshot::channel();
        slice.map_async(wgpu::MapMode::Read, move |result| _ = sender.send(result));
        let failed = |found: String| self.device_error(ErrorKind::Device, found);
        self.answer(Some(submission), receiver)?
            .map_err(|_| failed("results could not be read back".into()))?;
        let view = slice.get_mapped_range().map_err(|e| failed(e.to_string()))?;
        Ok(read(&view))
    }

    /// An error if the device was lost.
    fn check(&self) -> Result<(), Error> {
        let lost = self.lost.lock().unwrap_or_else(std::sync::PoisonError::into_inner).clone();
        lost.map_or(Ok(()), |found| Err(self.device_error(ErrorKind::Device, found)))
    }

    /// An error of this device, with a remedy.
    pub(super) fn device_error(&self, kind: ErrorKind, found: String) -> Error {
        device_error(&self.adapter.name, kind, found)
    }

    /// An error for results that no working device returns.
    pub(super) fn invalid_result(&self, found: String) -> Error {
        invalid_result(&self.adapter.name, found)
    }
}

/// Keeps the first message.
fn record(slot: &Mutex<Option<String>>, message: String) {
    slot.lock().unwrap_or_else(std::sync::PoisonError::into_inner).get_or_insert(message);
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::super::HemicubeRows;
    use super::super::test_support::{gpu, scene};
    use super::*;
    use crate::form_factor::{FormFactors, Row};
    use crate::mesh::Mesh;

    /// Memory that is both mapped by the host and written by shaders does not exist.
    fn not_valid(gpu: &Gpu) -> Result<wgpu::Buffer, Error> {
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::STORAGE;
        gpu.memory().buffer("odd", 16, usage)
    }

    #[test]
    #[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
    fn validation_error_keeps_device_usable() {
        let gpu = gpu();
        let e = gpu.with_error_scopes(|| not_valid(&gpu)).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::Device);
        assert!(e.to_string().contains("odd"), "names what it is about: {e}");
        assert!(std::error::Error::source(&e).is_some());
        assert_eq!(gpu.with_error_scopes(|| Ok(7)).unwrap(), 7);
    }

    #[test]
    #[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
    fn unscoped_error_is_reported_by_wait() {
        let gpu = gpu();
        not_valid(&gpu).unwrap();
        let e = gpu.wait().unwrap_err();
        assert!(e.kind() == ErrorKind::Device && e.to_string().contains("odd"), "{e}");
        assert!(gpu.with_error_scopes(|| Ok(())).is_err());
    }

    #[test]
    #[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
    fn device_lost_in_scope_is_an_error() {
        let gpu = gpu();
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let result = gpu.with_error_scopes(|| {
            let buffer = gpu.memory().buffer("staging", 16, usage)?;
            buffer.slice(..).map_async(wgpu::MapMode::Read, |_| ());
            gpu.close();
            gpu.wait()
        });
        let e = result.unwrap_err();
        assert!(e.kind() == ErrorKind::Device && e.to_string().contains("lost: closed"), "{e}");
        let e = gpu.memory().uniform("late", &[0; 16]).and_then(|_| gpu.wait()).unwrap_err();
        assert!(e.to_string().contains("lost: closed"), "{e}");
    }

    #[test]
    #[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
    fn batches_are_halved_until_there_is_memory() {
        let gpu = gpu();
        let tried = RefCell::new(vec![]);
        let most = |most: u32, kind: ErrorKind| {
            tried.borrow_mut().clear();
            gpu.retry_with_smaller_batches(16, |_, batch| {
                tried.borrow_mut().push(batch);
                if batch > most { Err(gpu.device_error(kind, "refused".into())) } else { Ok(batch) }
            })
        };
        assert_eq!(
            (most(3, ErrorKind::Memory).unwrap(), &tried.borrow()[..]),
            (2, &[16, 8, 4, 2][..])
        );
        assert_eq!(most(0, ErrorKind::Memory).unwrap_err().kind(), ErrorKind::Memory);
        assert_eq!(tried.borrow()[..], [16, 8, 4, 2, 1]);
        // A smaller batch does not help against other errors.
        assert!(most(3, ErrorKind::Device).is_err() && tried.borrow()[..] == [16]);
    }

    #[test]
    #[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
    fn memory_is_counted_and_given_back() {
        let gpu = gpu();
        let gpu = Gpu { budget: Arc::new(MemoryBudget::new(1000)), ..gpu };
        let usage = wgpu::BufferUsages::STORAGE;
        let memory = gpu.memory();
        memory.buffer("first", 600, usage).unwrap();
        let e = gpu.memory().buffer("second", 600, usage).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::Memory);
        let text = e.to_string();
        assert!(text.contains("600 bytes for second when 600 of 1000 are taken"), "{text}");
        drop(memory);
        gpu.memory().buffer("second", 600, usage).unwrap();
    }

    /// A device that a caller might have opened, with these limits.
    fn callers_device(limits: wgpu::Limits) -> (wgpu::Device, wgpu::Queue) {
        let adapter = adapters::choose(None).unwrap();
        let descriptor = wgpu::DeviceDescriptor { required_limits: limits, ..Default::default() };
        wait::block_on(adapter.request_device(&descriptor)).unwrap()
    }

    fn rows(gpu: &Gpu, mesh: &Mesh) -> Result<Vec<Row>, Error> {
        HemicubeRows::new(gpu, mesh, 16)?.rows(mesh, &[mesh.element(0)], 1.0)
    }

    #[test]
    #[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
    fn from_wgpu_makes_the_same_rows() {
        let own = gpu();
        let mesh = scene();
        let (device, queue) = callers_device(wgpu::Limits::default());
        let gpu = Gpu::from_wgpu(device.clone(), queue, &GpuLimits::NONE).unwrap();
        assert_eq!(gpu.adapter(), own.adapter());
        assert_eq!(rows(&gpu, &mesh).unwrap(), rows(&own, &mesh).unwrap());
        let limits = GpuLimits { memory: 1000, ..GpuLimits::NONE };
        let small = Gpu::from_wgpu(device.clone(), gpu.queue.clone(), &limits).unwrap();
        assert_eq!(rows(&small, &mesh).unwrap_err().kind(), ErrorKind::Memory);
        device.destroy();
        assert_eq!(rows(&gpu, &mesh).unwrap_err().kind(), ErrorKind::Device);
    }

    #[test]
    #[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
    fn from_wgpu_rejects_low_limits() {
        let (device, queue) = callers_device(wgpu::Limits::downlevel_webgl2_defaults());
        let e = Gpu::from_wgpu(device, queue, &GpuLimits::NONE).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::Setting);
        let text = e.to_string();
        assert!(text.contains("max_storage_buffers_per_shader_stage = 0"), "{text}");
        assert!(text.contains("at least 8"), "{text}");
    }
}
