//! The device, and what can be wrong with it.

use crate::scene::Layouts;
use std::sync::{Arc, OnceLock};
use wgpu::{DownlevelFlags, Features, Limits};

/// Why something did not happen on the GPU.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GpuError {
    /// The machine has no GPU that can be used, nor a driver that does without.
    #[error("there is no GPU to be used: {reason}")]
    NoAdapter {
        /// What the driver says.
        reason: String,
    },
    /// The GPU cannot do what is needed.
    #[error("{adapter} is too old: {lacks}")]
    TooOld {
        /// Its name.
        adapter: String,
        /// The limit or feature it lacks.
        lacks: String,
    },
    /// The device is gone, with all that was on it: unplugged, reset or destroyed.
    #[error("the GPU was lost: {reason}")]
    Lost {
        /// What the driver says.
        reason: String,
    },
    /// Something is larger than the device takes.
    #[error("{what} is {size}, and the GPU's {limit} is {allowed}")]
    TooLarge {
        /// Such as a picture's width.
        what: String,
        /// How large it is.
        size: u64,
        /// The name of the limit, as WebGPU calls it.
        limit: &'static str,
        /// The most there can be.
        allowed: u64,
    },
    /// Numbers of 24 bits do not tell well enough where something lies.
    #[error("the GPU's numbers of 24 bits are too coarse for {what}")]
    Imprecise {
        /// Such as an object's name.
        what: String,
    },
    /// The driver refused or ran out of memory.
    #[error("the GPU failed: {reason}")]
    Failed {
        /// What it says.
        reason: String,
    },
}

/// A device and its queue.
///
/// All functions that take one return an error once the device is lost, and go on doing so.
#[derive(Debug)]
pub struct Gpu {
    info: wgpu::AdapterInfo,
    device: wgpu::Device,
    queue: wgpu::Queue,
    lost: Arc<OnceLock<String>>,
    pub(crate) layouts: Layouts,
}

/// What shaders need beyond what every WebGPU device has.
const NEEDED: DownlevelFlags = DownlevelFlags::VERTEX_STORAGE
    .union(DownlevelFlags::FRAGMENT_STORAGE)
    .union(DownlevelFlags::FRAGMENT_WRITABLE_STORAGE)
    .union(DownlevelFlags::INDEPENDENT_BLEND);

impl Gpu {
    /// The fastest GPU of the machine; where it has none, a software driver, if one is installed.
    ///
    /// # Errors
    ///
    /// When there is no adapter, it is too old, or it does not give a device.
    pub fn new() -> Result<Self, GpuError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        Self::with_adapter(&Self::adapter(&instance)?)
    }

    /// The adapter that [`Self::new`] takes, for programs that need it for a window of their own.
    ///
    /// # Errors
    ///
    /// When there is none.
    pub fn adapter(instance: &wgpu::Instance) -> Result<wgpu::Adapter, GpuError> {
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..Default::default()
        };
        let adapter = pollster::block_on(instance.request_adapter(&options));
        adapter.map_err(|error| GpuError::NoAdapter {
            reason: error.to_string(),
        })
    }

    /// A device of an adapter that was chosen for instance because it can draw into some window.
    ///
    /// # Errors
    ///
    /// When the adapter is too old or does not give a device.
    pub fn with_adapter(adapter: &wgpu::Adapter) -> Result<Self, GpuError> {
        let info = adapter.get_info();
        if let Some(lacks) = lacking(adapter) {
            let adapter = info.name;
            return Err(GpuError::TooOld { adapter, lacks });
        }
        let descriptor = wgpu::DeviceDescriptor {
            required_features: adapter.features() & Features::TIMESTAMP_QUERY,
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let device = pollster::block_on(adapter.request_device(&descriptor));
        let (device, queue) = device.map_err(|error| GpuError::Failed {
            reason: error.to_string(),
        })?;
        let lost = Arc::new(OnceLock::new());
        let note = Arc::clone(&lost);
        device.set_device_lost_callback(move |why, message| {
            // The first reason is the one that counts.
            let _ = note.set(match message.is_empty() {
                true => format!("{why:?}"),
                false => message,
            });
        });
        let layouts = Layouts::new(&device);
        Ok(Self {
            info,
            device,
            queue,
            lost,
            layouts,
        })
    }

    /// The adapter's name, as its driver tells it.
    pub fn name(&self) -> &str {
        &self.info.name
    }

    /// Whether a driver does on the CPU what a GPU would do.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// The device, for what else a program draws.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// The device's queue.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// Whether the GPU's own time can be told.
    pub(crate) fn has_timestamps(&self) -> bool {
        self.device.features().contains(Features::TIMESTAMP_QUERY)
    }

    /// Does something on the device, and tells what went wrong in it.
    pub(crate) fn guarded<T>(
        &self,
        work: impl FnOnce() -> Result<T, GpuError>,
    ) -> Result<T, GpuError> {
        self.check()?;
        let filters = [
            wgpu::ErrorFilter::OutOfMemory,
            wgpu::ErrorFilter::Validation,
            wgpu::ErrorFilter::Internal,
        ];
        let scopes = filters.map(|filter| self.device.push_error_scope(filter));
        let result = work();
        let mut failed = None;
        for scope in scopes.into_iter().rev() {
            failed = pollster::block_on(scope.pop()).or(failed);
        }
        // What else is said of a lost device only follows from the loss.
        self.check()?;
        match failed {
            Some(error) => Err(GpuError::Failed {
                reason: error.to_string(),
            }),
            None => result,
        }
    }

    /// Waits until all that was submitted is done.
    pub(crate) fn wait(&self) -> Result<(), GpuError> {
        let waited = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.check()?;
        waited.map(|_| ()).map_err(|error| GpuError::Failed {
            reason: error.to_string(),
        })
    }

    /// An error if `size` is above a limit of the device.
    pub(crate) fn check_limit(
        &self,
        what: impl Fn() -> String,
        size: u64,
        limit: &'static str,
        allowed: impl Fn(&Limits) -> u64,
    ) -> Result<(), GpuError> {
        let allowed = allowed(&self.device.limits());
        match size > allowed {
            true => Err(GpuError::TooLarge {
                what: what(),
                size,
                limit,
                allowed,
            }),
            false => Ok(()),
        }
    }

    fn check(&self) -> Result<(), GpuError> {
        match self.lost.get() {
            Some(reason) => Err(GpuError::Lost {
                reason: reason.clone(),
            }),
            None => Ok(()),
        }
    }
}

/// The first limit or feature that an adapter has less of than is needed.
fn lacking(adapter: &wgpu::Adapter) -> Option<String> {
    let missing = NEEDED - adapter.get_downlevel_capabilities().flags;
    if let Some((name, _)) = missing.iter_names().next() {
        return Some(format!("it lacks {name}"));
    }
    let mut lacks = None;
    let needed = Limits::default();
    needed.check_limits_with_fail_fn(&adapter.limits(), true, |name, needed, has| {
        lacks = Some(format!("its {name} is {has}, and {needed} is needed"));
    });
    lacks
}
