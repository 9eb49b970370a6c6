//! Ears for tests: levels, spectra, and loads to listen to.
// Each test program hears with some of it only.
#![allow(dead_code)]

#[cfg(all(unix, not(target_os = "macos")))]
pub mod server;

use realfft::RealFftPlanner;
use typodont_audio::{DrillLoad, Tool};

pub const RATE: u32 = 48_000;

/// Samples of a window: 43 ms, 23 Hz from line to line.
const WINDOW: usize = 2048;

pub fn idle() -> DrillLoad {
    DrillLoad { tool: Tool::AirTurbine, is_running: true, speed: 300_000.0, ..DrillLoad::default() }
}

/// A bur of 1 mm that cuts enamel with so many newtons.
pub fn grinding(force: f32) -> DrillLoad {
    DrillLoad { is_touching: true, is_cutting: true, force, surface_speed: 15_700.0, hardness: 300.0, ..idle() }
}

/// A probe that is drawn over enamel.
pub fn scratching() -> DrillLoad {
    DrillLoad {
        tool: Tool::Hand,
        is_touching: true,
        force: 0.5,
        surface_speed: 20.0,
        hardness: 300.0,
        ..DrillLoad::default()
    }
}

/// Root of the mean square.
pub fn level(samples: &[f32]) -> f32 {
    (samples.iter().map(|s| s * s).sum::<f32>() / samples.len().max(1) as f32).sqrt()
}

/// The largest step from one sample to the next.
pub fn largest_step(samples: &[f32]) -> f32 {
    samples.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max)
}

/// Power by frequency: of each line the middle one of all windows, so that a gap in a recording changes nothing.
pub struct Spectrum {
    lines: Vec<f32>,
}

impl Spectrum {
    pub fn of(samples: &[f32]) -> Spectrum {
        assert!(samples.len() >= WINDOW, "{} samples are too few to tell a spectrum", samples.len());
        let transform = RealFftPlanner::<f32>::new().plan_fft_forward(WINDOW);
        let mut windows = Vec::new();
        for start in (0..=samples.len() - WINDOW).step_by(WINDOW / 2) {
            let mut time: Vec<f32> = samples[start..start + WINDOW].to_vec();
            for (i, sample) in time.iter_mut().enumerate() {
                *sample *= 0.5 - 0.5 * (std::f32::consts::TAU * i as f32 / WINDOW as f32).cos();
            }
            let mut frequency = transform.make_output_vec();
            transform.process(&mut time, &mut frequency).unwrap();
            windows.push(frequency.iter().map(|line| line.norm_sqr()).collect::<Vec<f32>>());
        }
        let middle = |line: usize| {
            let mut powers: Vec<f32> = windows.iter().map(|window| window[line]).collect();
            powers.sort_by(f32::total_cmp);
            powers[powers.len() / 2]
        };
        Spectrum { lines: (0..=WINDOW / 2).map(middle).collect() }
    }

    /// Power above that of another spectrum, by line.
    pub fn beyond(&self, other: &Spectrum) -> Spectrum {
        Spectrum { lines: self.lines.iter().zip(&other.lines).map(|(a, b)| (a - b).max(0.0)).collect() }
    }

    /// Power between two frequencies, Hz.
    pub fn power(&self, from: f32, to: f32) -> f32 {
        self.within(from, to).map(|(_, power)| power).sum()
    }

    /// Frequency of maximum power between two frequencies, Hz.
    pub fn peak(&self, from: f32, to: f32) -> f32 {
        self.within(from, to).max_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0
    }

    /// The mean frequency, weighted by power, Hz: what the ear calls brightness.
    pub fn brightness(&self) -> f32 {
        let weighted: f32 = self.within(50.0, 20_000.0).map(|(hertz, power)| hertz * power).sum();
        weighted / self.power(50.0, 20_000.0)
    }

    fn within(&self, from: f32, to: f32) -> impl Iterator<Item = (f32, f32)> {
        let lines = self.lines.iter().enumerate().map(|(i, p)| (i as f32 * RATE as f32 / WINDOW as f32, *p));
        lines.filter(move |(hertz, _)| (from..to).contains(hertz))
    }
}
