//! Errors of rendering, on a GPU or on the CPU.

use std::fmt;

/// Reason why an image could not be rendered. The message says what to do.
#[derive(Clone, Debug, PartialEq)]
pub enum RenderError {
    /// wgpu found no usable adapter.
    NoAdapter { why: String },
    /// The adapter was found, but opening a device on it failed.
    NoDevice { adapter: String, why: String },
    /// The device was lost: driver reset, cable, or sleep. Create a new renderer on a new device.
    Lost { why: String },
    /// The device rejected a command: out of memory, or a bug in this program.
    Refused { why: String },
    /// The adapter lacks a required capability.
    Missing { what: String },
    /// The scene or the requested image is invalid.
    Impossible { why: String },
}

impl fmt::Display for RenderError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            RenderError::NoAdapter { why } => write!(
                f,
                "no-adapter: cannot find a graphics adapter: {why}. Images are rendered on the CPU; \
                 a Vulkan driver (Debian: mesa-vulkan-drivers) makes rendering faster"
            ),
            RenderError::NoDevice { adapter, why } => {
                write!(f, "no-device: cannot open {adapter}: {why}. Images are rendered on the CPU")
            }
            RenderError::Lost { why } => write!(f, "device-lost: the graphics device was lost: {why}. Open it again"),
            RenderError::Refused { why } => write!(f, "refused: the graphics device rejected a command: {why}"),
            RenderError::Missing { what } => {
                write!(f, "missing: the graphics adapter lacks {what}. Choose another adapter, or render on the CPU")
            }
            RenderError::Impossible { why } => write!(f, "impossible-picture: {why}"),
        }
    }
}

impl std::error::Error for RenderError {}
