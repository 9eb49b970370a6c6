//! GPU access: choice of the adapter, its errors, and loss of the device.

use super::error::RenderError;
use std::sync::{Arc, Mutex, PoisonError};

/// A device with its queue, for rendering without a window.
pub struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    /// Name of the adapter, with its driver and back-end.
    pub name: String,
    /// True if the processor draws, by a software driver.
    pub is_software: bool,
    pub error_listener: DeviceErrorListener,
}

impl Gpu {
    /// Opens the best available adapter, which may be a software renderer.
    ///
    /// # Errors
    /// Fails if there is no adapter, or if opening a device on it fails.
    pub fn open() -> Result<Gpu, RenderError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..Default::default()
        };
        let found = pollster::block_on(instance.request_adapter(&options));
        let adapter = found.map_err(|e| RenderError::NoAdapter { why: e.to_string() })?;
        let info = adapter.get_info();
        let name = format!("{} ({}, {:?})", info.name, info.driver_info, info.backend);
        let is_software = info.device_type == wgpu::DeviceType::Cpu;
        let asked = wgpu::DeviceDescriptor {
            label: Some("typodont"),
            // All that the adapter offers: large volumes need large textures.
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let opened = pollster::block_on(adapter.request_device(&asked));
        let (device, queue) =
            opened.map_err(|e| RenderError::NoDevice { adapter: name.clone(), why: e.to_string() })?;
        let error_listener = DeviceErrorListener::attach(&device);
        Ok(Gpu { device, queue, name, is_software, error_listener })
    }
}

/// Records the loss of a device and its uncaptured errors, so that they become errors of the program instead of
/// panics.
#[derive(Clone)]
pub struct DeviceErrorListener(Arc<Mutex<Option<RenderError>>>);

impl DeviceErrorListener {
    /// Starts listening to a device. A device has one listener: attaching a second one replaces the first.
    pub fn attach(device: &wgpu::Device) -> DeviceErrorListener {
        let first_error: Arc<Mutex<Option<RenderError>>> = Arc::default();
        let record = |heard: &Arc<Mutex<Option<RenderError>>>, error: RenderError| {
            // The first error is the cause and later ones are its consequences; but the loss of the device overrides
            // all.
            let mut heard = heard.lock().unwrap_or_else(PoisonError::into_inner);
            if heard.is_none() || matches!(error, RenderError::Lost { .. }) {
                *heard = Some(error);
            }
        };
        let lost = first_error.clone();
        device.set_device_lost_callback(move |reason, why| {
            record(&lost, RenderError::Lost { why: if why.is_empty() { format!("{reason:?}") } else { why } });
        });
        let refused = first_error.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            record(&refused, RenderError::Refused { why: error.to_string() });
        }));
        DeviceErrorListener(first_error)
    }

    /// Returns the first error since the last call. Loss of the device overrides all others and is reported by every
    /// call.
    ///
    /// # Errors
    /// Fails if the device was lost, or if it reported an error since the last call.
    pub fn check(&self) -> Result<(), RenderError> {
        let mut first_error = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let lost = first_error.as_ref().filter(|e| matches!(e, RenderError::Lost { .. })).cloned();
        match lost.or_else(|| first_error.take()) {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }
}
