//! A sound server of a test's own, and what comes out of it.

use super::RATE;
use std::fs::{self, File};
use std::io::Read;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Far longer than anything here takes: whoever waits as long waits in vain.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// A program that ends with the test.
pub struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A folder of this test's own. Sockets have short paths, so it is not below the target folder.
pub fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("typodont-{name}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

pub fn wait_for<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let begun = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(begun.elapsed() < PATIENCE, "{what} did not come");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// A private PulseAudio with a null sink; `None`, said loudly, where it is not installed.
pub fn server(folder: &Path) -> Option<Running> {
    let socket = folder.join("socket");
    let protocol = format!("module-native-protocol-unix socket={} auth-anonymous=1", socket.display());
    let sink = "module-null-sink sink_name=ear format=float32le rate=48000 channels=1";
    let mut pulseaudio = Command::new("pulseaudio");
    pulseaudio.args(["-n", "--daemonize=no", "--use-pid-file=no", "--exit-idle-time=-1", "--disable-shm=yes"]);
    pulseaudio.args(["--high-priority=no", "-L", &protocol, "-L", sink]);
    pulseaudio.env("HOME", folder).env("XDG_RUNTIME_DIR", folder).stdout(Stdio::null()).stderr(Stdio::null());
    let has_recorder = Command::new("parec").arg("--version").stdout(Stdio::null()).status().is_ok();
    let Some(child) = has_recorder.then(|| pulseaudio.spawn().ok()).flatten() else {
        crate::support::tools::skip("there is no pulseaudio with parec: no sound is played to a real server");
        return None;
    };
    let running = Running(child);
    // The file is there before the server listens on it.
    wait_for("the server's socket", || UnixStream::connect(&socket).ok());
    Some(running)
}

/// Recorder of the null sink's output.
pub struct Recorder {
    file: File,
    _parec: Running,
}

impl Recorder {
    pub fn start(folder: &Path) -> Recorder {
        let path = folder.join("heard.raw");
        let mut parec = Command::new("parec");
        parec.args(["-d", "ear.monitor", "--raw", "--format=float32le", "--rate=48000", "--channels=1"]);
        parec.arg("--latency-msec=10").stdout(File::create(&path).unwrap()).stderr(Stdio::null());
        parec.env("HOME", folder).env("PULSE_SERVER", format!("unix:{}", folder.join("socket").display()));
        let parec = Running(parec.spawn().unwrap());
        Recorder { file: File::open(path).unwrap(), _parec: parec }
    }

    /// The next seconds of the recording, as far as it has come.
    pub fn take(&mut self, seconds: f32) -> Vec<f32> {
        samples(&self.bytes((seconds * RATE as f32) as usize * 4))
    }

    /// All that was recorded since.
    pub fn rest(&mut self) -> Vec<f32> {
        let mut rest = Vec::new();
        self.file.read_to_end(&mut rest).unwrap();
        // Half a sample may be there already; its other half follows.
        rest.extend(self.bytes(rest.len().wrapping_neg() % 4));
        samples(&rest)
    }

    fn bytes(&mut self, count: usize) -> Vec<u8> {
        let (mut bytes, mut read) = (vec![0; count], 0);
        wait_for("the recording", || {
            read += self.file.read(&mut bytes[read..]).unwrap();
            (read == count).then_some(())
        });
        bytes
    }

    /// Goes on to what is recorded from now on.
    pub fn catch_up(&mut self) {
        self.rest();
    }
}

fn samples(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
}
