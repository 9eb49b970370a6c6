//! Files that the user gives to the window: chosen in the browser, or dropped.

/// A file that the user gave to the window.
#[derive(Debug)]
pub struct GivenFile {
    pub name: String,
    pub content: GivenContent,
    /// Number of files that were given with it and are left out.
    pub left_out: usize,
}

/// Content of a [`GivenFile`].
#[derive(Debug)]
pub enum GivenContent {
    /// The bytes, or the reason why they cannot be read.
    Read(Result<Vec<u8>, String>),
    /// A file on this computer.
    #[cfg(not(target_family = "wasm"))]
    OnDisk(std::path::PathBuf),
}

impl GivenContent {
    /// The bytes.
    ///
    /// # Errors
    /// The reason why they cannot be read.
    pub fn read(self) -> Result<Vec<u8>, String> {
        match self {
            GivenContent::Read(read) => read,
            #[cfg(not(target_family = "wasm"))]
            GivenContent::OnDisk(path) => typodont_formats::read_file(&path).map_err(|complaint| complaint.headline()),
        }
    }
}
