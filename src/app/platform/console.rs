//! The console that Windows opens for a program that is started by its icon.

#![cfg_attr(windows, allow(unsafe_code))]

/// Closes the console if it belongs to this program alone, so that only the window remains. A program that is started in
/// a terminal shares the terminal's console and keeps it.
#[cfg(windows)]
pub fn close_own_console() {
    use windows_sys::Win32::System::Console::{FreeConsole, GetConsoleProcessList};
    let mut processes = [0_u32; 2];
    // SAFETY: the list has room for as many entries as is said, and the system keeps no pointer to it.
    unsafe {
        if GetConsoleProcessList(processes.as_mut_ptr(), processes.len() as u32) == 1 {
            FreeConsole();
        }
    }
}

/// Other systems, and a page, open no console.
#[cfg(not(windows))]
pub fn close_own_console() {}
