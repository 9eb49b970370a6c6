//! Time and memory for an ordinary large scan: `cargo test --release --test nrrd_speed -- --ignored --nocapture`.

use crate::support::folder;

use folder::folder;
use glam::DVec3;
use std::path::Path;
use std::time::{Duration, Instant};
use typodont_formats::nrrd;
use typodont_formats::nrrd::segmentation;
use typodont_formats::nrrd::segmentation::{NamedSegment, Segmentation};
use typodont_formats::nrrd::{CoordinateSystem, Encoding, Geometry, Samples, VoxelImage};

const DIMS: [u32; 3] = [512, 512, 322];

/// Shells of different densities with a scanner's noise.
fn scan() -> Vec<u8> {
    let mut state = 1u32;
    let mut noise = || {
        state = state.wrapping_mul(1664525).wrapping_add(1013904223);
        (state >> 28) as f32 * 0.7 - 5.6
    };
    let mut sample = |x: u32, y: u32, z: u32| {
        let from_middle = DVec3::new(f64::from(x) - 256.0, f64::from(y) - 256.0, (f64::from(z) - 161.0) * 1.4);
        let density = match from_middle.length() as u32 {
            0..80 => 60.0,
            80..150 => 160.0,
            150..180 => 230.0,
            _ => 70.0,
        };
        (density + noise()) as u8
    };
    let mut samples = Vec::with_capacity(DIMS.iter().map(|&n| n as usize).product());
    for z in 0..DIMS[2] {
        for y in 0..DIMS[1] {
            samples.extend((0..DIMS[0]).map(|x| sample(x, y, z)));
        }
    }
    samples
}

#[test]
#[ignore = "a measurement: some seconds and 250 MB of disk"]
fn a_large_scan_is_read_in_one_copy() {
    // Aim: reading takes no more memory than the samples. Method: the largest resident set while reading, against the
    // one before; the whole program does nothing else.
    const SLACK_KIB: u64 = 2 << 10;
    let folder = folder("speed");
    let geometry = Geometry {
        dims: DIMS,
        steps: [DVec3::X * 0.1, DVec3::Y * 0.1, DVec3::Z * 0.1],
        origin: DVec3::ZERO,
        space: CoordinateSystem::LeftPosteriorSuperior,
    };
    let segment = |label_value| {
        let name = format!("tissue {label_value}");
        NamedSegment { id: name.clone(), name, label_value, color: [0.5; 3] }
    };
    {
        let image = VoxelImage { geometry: geometry.clone(), samples: Samples::U8(scan()), keys: Vec::new() };
        for (name, encoding) in [("raw.nrrd", Encoding::Raw), ("gzip.nrrd", Encoding::Gzip)] {
            written(name, || std::fs::write(folder.join(name), nrrd::bytes(&image, encoding).unwrap()).unwrap());
        }
        let Samples::U8(samples) = &image.samples else { unreachable!() };
        let wide: Vec<u16> = samples.iter().map(|&v| u16::from(v) * 16).collect();
        let image = VoxelImage { geometry: geometry.clone(), samples: Samples::U16(wide), keys: Vec::new() };
        let bytes = nrrd::bytes(&image, Encoding::Raw).unwrap();
        std::fs::write(folder.join("raw_u16.nrrd"), bytes).unwrap();
        let labels = samples.iter().map(|&v| [3, 0, 2, 1][usize::from(v / 64)]).collect();
        let segmentation = Segmentation { geometry, labels, segments: [1, 2, 3].map(segment).to_vec() };
        let path = folder.join("labels.seg.nrrd");
        written("labels.seg.nrrd", || std::fs::write(path, segmentation::bytes(&segmentation).unwrap()).unwrap());
    }
    let voxels = DIMS.iter().map(|&n| u64::from(n)).product::<u64>();
    for (name, width) in [("raw.nrrd", 1), ("gzip.nrrd", 1), ("raw_u16.nrrd", 2)] {
        let taken = measured(name, || nrrd::read(&folder.join(name)).unwrap().samples.len());
        assert!(taken.is_none_or(|kib| kib < (voxels * width / 1024) + SLACK_KIB), "{name} takes {taken:?} KiB");
    }
    let path = folder.join("labels.seg.nrrd");
    let taken = measured("labels.seg.nrrd", || segmentation::read(&path).unwrap().labels.len());
    assert!(taken.is_none_or(|kib| kib < (voxels / 1024) + SLACK_KIB), "labels take {taken:?} KiB");
    std::fs::remove_dir_all(&folder).unwrap();
}

fn written(name: &str, write: impl FnOnce()) {
    let start = Instant::now();
    write();
    println!("{name}: written in {:.0?}", start.elapsed());
}

/// Reads five times, prints the best and the worst, and returns the KiB that the first took.
fn measured(name: &str, read: impl Fn() -> usize) -> Option<u64> {
    let before = resident_kib("VmRSS:");
    std::fs::write("/proc/self/clear_refs", "5").ok();
    let start = Instant::now();
    let voxels = read();
    let first = start.elapsed();
    let taken = resident_kib("VmHWM:").zip(before).map(|(high, before)| high.saturating_sub(before));
    let times = (0..5).map(|_| {
        let start = Instant::now();
        assert_eq!(read(), voxels);
        start.elapsed()
    });
    let mut times: Vec<Duration> = times.chain([first]).collect();
    times.sort();
    let mebi = |count: f64| count / f64::from(1 << 20);
    println!(
        "{name}: {:.1} Mi voxels read in {:.1?} to {:.1?}, taking {:.1?} MiB",
        mebi(voxels as f64),
        times[0],
        times[times.len() - 1],
        taken.map(|kib| mebi(kib as f64 * 1024.0)),
    );
    taken
}

fn resident_kib(name: &str) -> Option<u64> {
    let status = std::fs::read_to_string(Path::new("/proc/self/status")).ok()?;
    status.lines().find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?.parse().ok()
}
