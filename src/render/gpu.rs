//! The adapter: which one draws, what it cannot do, and whether it is still there.

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

/// Why there is no picture, and what to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Error {
    /// No adapter that wgpu can use.
    NoAdapter { why: String },
    /// There is one, but it gives no device.
    NoDevice { adapter: String, why: String },
    /// The device is gone: driver reset, cable, or sleep. A new renderer on a new device goes on.
    Lost { why: String },
    /// The device refused what it was told: too little memory, or a fault of ours.
    Refused { why: String },
    /// The adapter cannot do what a picture needs.
    Missing { what: String },
    /// The scene or the picture asked for is not possible.
    Impossible { why: String },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Error::NoAdapter { why } => write!(
                f,
                "no-adapter: looking for a graphics adapter: {why}. Pictures are drawn by the processor; \
                 a Vulkan driver (Debian: mesa-vulkan-drivers) makes them faster"
            ),
            Error::NoDevice { adapter, why } => {
                write!(f, "no-device: opening {adapter}: {why}. Pictures are drawn by the processor")
            }
            Error::Lost { why } => write!(f, "device-lost: the graphics device is gone: {why}. Open it again"),
            Error::Refused { why } => write!(f, "refused: the graphics device refused a picture: {why}"),
            Error::Missing { what } => {
                write!(f, "missing: the graphics adapter lacks {what}. Choose another, or let the processor draw")
            }
            Error::Impossible { why } => write!(f, "impossible-picture: {why}"),
        }
    }
}

impl std::error::Error for Error {}

/// A device of our own, for pictures without a window.
pub struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    /// The adapter's name, with what drives it.
    pub name: String,
    pub watch: Watch,
}

impl Gpu {
    /// Opens the best adapter there is; one in software is better than none.
    pub fn open() -> Result<Gpu, Error> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..Default::default()
        };
        let found = pollster::block_on(instance.request_adapter(&options));
        let adapter = found.map_err(|e| Error::NoAdapter { why: e.to_string() })?;
        let info = adapter.get_info();
        let name = format!("{} ({}, {:?})", info.name, info.driver_info, info.backend);
        let asked = wgpu::DeviceDescriptor {
            label: Some("typodont"),
            // All that the adapter offers: large volumes need large textures.
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let opened = pollster::block_on(adapter.request_device(&asked));
        let (device, queue) = opened.map_err(|e| Error::NoDevice { adapter: name.clone(), why: e.to_string() })?;
        let watch = Watch::over(&device);
        Ok(Gpu { device, queue, name, watch })
    }
}

/// Hears when a device is lost or refuses something, so that it becomes an error and no crash.
#[derive(Clone)]
pub struct Watch(Arc<Mutex<Option<Error>>>);

impl Watch {
    /// Listens to a device from now on. A device has one listener: who makes a second takes the first one's place.
    pub fn over(device: &wgpu::Device) -> Watch {
        let heard: Arc<Mutex<Option<Error>>> = Arc::default();
        let note = |heard: &Arc<Mutex<Option<Error>>>, error: Error| {
            // The first is the cause, what follows are its consequences; but a lost device outweighs all.
            let mut heard = heard.lock().unwrap_or_else(PoisonError::into_inner);
            if heard.is_none() || matches!(error, Error::Lost { .. }) {
                *heard = Some(error);
            }
        };
        let lost = heard.clone();
        device.set_device_lost_callback(move |reason, why| {
            note(&lost, Error::Lost { why: if why.is_empty() { format!("{reason:?}") } else { why } });
        });
        let refused = heard.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            note(&refused, Error::Refused { why: error.to_string() });
        }));
        Watch(heard)
    }

    /// What was heard first since the last call, a lost device before all else. A lost one is told again every time.
    pub fn check(&self) -> Result<(), Error> {
        let mut heard = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let lost = heard.as_ref().filter(|e| matches!(e, Error::Lost { .. })).cloned();
        match lost.or_else(|| heard.take()) {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }
}
