//! Remedies, in the words of each operating system.

/// Operating system whose words a remedy uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OperatingSystem {
    Linux,
    Windows,
    MacOs,
}

impl OperatingSystem {
    pub const CURRENT: OperatingSystem = if cfg!(windows) {
        OperatingSystem::Windows
    } else if cfg!(target_os = "macos") {
        OperatingSystem::MacOs
    } else {
        OperatingSystem::Linux
    };
}

/// Defect of a station. The remedy for a device is that of its driver.
// A build without a part, and a system without rules for devices, cannot meet all of them.
#[cfg_attr(not(all(feature = "desktop", feature = "audio", target_os = "linux")), allow(dead_code))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StationFault {
    NoDisplay,
    NoGraphics,
    SoftwareGraphics,
    NoSound,
    NoRealtime,
    NoDeviceRules,
    OneProcessor,
    WrongClock,
    NotAFolder,
    FolderNotWritable,
    DiskFull,
    FileSizeLimit,
    InterruptedSession,
    WrongSettings,
    NoExercises,
    WrongStation,
    OldExercises,
}

impl StationFault {
    pub const fn remedy(self, system: OperatingSystem) -> &'static str {
        use OperatingSystem::{Linux, MacOs, Windows};
        match (self, system) {
            (StationFault::NoDisplay, Linux) => {
                "start the program on the desktop of the person at the machine (DISPLAY or WAYLAND_DISPLAY names it); without \
                 one use `typodont run SCENARIO --headless`"
            }
            (StationFault::NoDisplay, _) => "log in at the machine itself and start the program on its desktop",
            (StationFault::NoGraphics, Linux) => {
                "install a Vulkan driver (Debian and Ubuntu: `sudo apt install mesa-vulkan-drivers`; Fedora: `sudo dnf install \
                 mesa-vulkan-drivers`; for NVIDIA the vendor's driver)"
            }
            (StationFault::NoGraphics, Windows) => {
                "install the graphics driver of the computer's or the card's maker, or run Windows Update with optional \
                 driver updates; Direct3D 12 or Vulkan is needed"
            }
            (StationFault::NoGraphics, MacOs) => "use a Mac whose graphics processor supports Metal (2012 or later)",
            (StationFault::SoftwareGraphics, Linux) => {
                "install the driver of the graphics card; without a card choose the display mode \"Surface (triangle mesh)\""
            }
            (StationFault::SoftwareGraphics, Windows) => {
                "install the graphics driver of the card's maker (Device Manager, Display adapters, shows which card there \
                 is); without a card choose the display mode \"Surface (triangle mesh)\""
            }
            (StationFault::SoftwareGraphics, MacOs) => "choose the display mode \"Surface (triangle mesh)\"",
            (StationFault::NoSound, Linux) => {
                "start PipeWire with its PulseAudio service (`systemctl --user start pipewire-pulse`), or PulseAudio, as the \
                 user at the machine"
            }
            (StationFault::NoSound, Windows) => {
                "connect loudspeakers or headphones and select them in Settings, System, Sound, Output"
            }
            (StationFault::NoSound, MacOs) => {
                "connect loudspeakers or headphones and select them in System Settings, Sound, Output"
            }
            (StationFault::NoRealtime, Linux) => {
                "add the user to the group haptics (`sudo groupadd -f haptics; sudo usermod -aG haptics NAME`), write \
                 `@haptics - rtprio 30` into a file in /etc/security/limits.d/ (the package has done that) and log in again; \
                 or install and start RealtimeKit (rtkit)"
            }
            (StationFault::NoRealtime, Windows) => {
                "let the program raise its priority: an administrator's policy (Local Security Policy, User Rights \
                 Assignment, Increase scheduling priority) must include the users of this machine"
            }
            (StationFault::NoRealtime, MacOs) => "close other programs while a session is held",
            (StationFault::NoDeviceRules, Linux) => {
                "install the package of Typodont, or copy content/devices/70-typodont.rules to /etc/udev/rules.d/ and run \
                 `sudo udevadm control --reload`"
            }
            (StationFault::NoDeviceRules, _) => "install the driver of the device's vendor",
            (StationFault::OneProcessor, Linux) => {
                "give the program two processors or more (`taskset`, a container or a virtual machine may limit it)"
            }
            (StationFault::OneProcessor, Windows) => {
                "give the program two processors or more (Task Manager, Details, Set affinity; or the settings of the virtual \
                 machine)"
            }
            (StationFault::OneProcessor, MacOs) => "give the virtual machine two processors or more",
            (StationFault::WrongClock, Linux) => "set the clock: `sudo timedatectl set-ntp true`, then log in again",
            (StationFault::WrongClock, Windows) => "set the clock: Settings, Time & language, Date & time, Sync now",
            (StationFault::WrongClock, MacOs) => {
                "set the clock: System Settings, General, Date & Time, Set time and date automatically"
            }
            (StationFault::NotAFolder, _) => "remove or rename the file, or name another folder with --out",
            (StationFault::FolderNotWritable, Linux) => {
                "let the user write there (`sudo chown NAME FOLDER`; a file system mounted read-only: `sudo mount -o \
                 remount,rw MOUNTPOINT`), or name another folder with --out"
            }
            (StationFault::FolderNotWritable, Windows) => {
                "let the user write there (Properties, Security, Edit: Modify), exempt the program from Controlled folder \
                 access in Windows Security, or name another folder with --out"
            }
            (StationFault::FolderNotWritable, MacOs) => {
                "let the user write there (Get Info, Sharing & Permissions; System Settings, Privacy & Security, Files and \
                 Folders), or name another folder with --out"
            }
            (StationFault::DiskFull, Linux) => {
                "delete files there (`df -h` shows the disks, `quota` the user's share), or name a folder on another disk \
                 with --out"
            }
            (StationFault::DiskFull, Windows) => {
                "free space (Settings, System, Storage), or name a folder on another drive with --out"
            }
            (StationFault::DiskFull, MacOs) => {
                "free space (System Settings, General, Storage), or name a folder on another disk with --out"
            }
            (StationFault::FileSizeLimit, _) => {
                "raise the limit for the size of files (`ulimit -f unlimited`, or fsize in /etc/security/limits.d/)"
            }
            (StationFault::InterruptedSession, _) => "complete it with `typodont finish FOLDER`",
            (StationFault::WrongSettings, _) => {
                "correct or delete the file that is named, or choose the value again in the window's settings (F2)"
            }
            (StationFault::WrongStation, _) => {
                "correct the file that is named; `typodont check FILE` shows every mistake at its place"
            }
            (StationFault::OldExercises, _) => {
                "run `typodont station sync`; if it fails, connect the network or the disk that holds the exercises, or ask the \
                 server's administrator"
            }
            (StationFault::NoExercises, _) => {
                "connect the drive or the network folder, or enter another folder in the window's list of exercises"
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FAULTS: [StationFault; 17] = [
        StationFault::NoDisplay,
        StationFault::NoGraphics,
        StationFault::SoftwareGraphics,
        StationFault::NoSound,
        StationFault::NoRealtime,
        StationFault::NoDeviceRules,
        StationFault::OneProcessor,
        StationFault::WrongClock,
        StationFault::NotAFolder,
        StationFault::FolderNotWritable,
        StationFault::DiskFull,
        StationFault::FileSizeLimit,
        StationFault::InterruptedSession,
        StationFault::WrongSettings,
        StationFault::NoExercises,
        StationFault::WrongStation,
        StationFault::OldExercises,
    ];

    #[test]
    fn a_remedy_speaks_only_of_its_own_system() {
        // Aim: nobody at a Windows machine is told to use apt, and nobody at a Mac to open Device Manager. Method: the
        // words of each system in the remedies of the others. A limit on the size of files exists only on Unix.
        let words = [
            (OperatingSystem::Linux, &["sudo", "apt ", "udev", "systemctl", "/etc/", "mount"][..]),
            (OperatingSystem::Windows, &["Task Manager", "Device Manager", "Windows", "Direct3D", "drive "][..]),
            (OperatingSystem::MacOs, &["System Settings", "Mac ", "Metal"][..]),
        ];
        let is_of_unix = |fault| matches!(fault, StationFault::FileSizeLimit | StationFault::NoExercises);
        for fault in FAULTS.into_iter().filter(|fault| !is_of_unix(*fault)) {
            for (system, _) in words {
                let foreign = words.iter().filter(|(other, _)| *other != system).flat_map(|(_, words)| *words);
                for word in foreign {
                    let remedy = fault.remedy(system);
                    assert!(!remedy.contains(word), "{fault:?} on {system:?} says \"{word}\": {remedy}");
                }
            }
        }
    }
}
