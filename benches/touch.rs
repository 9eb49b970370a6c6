//! Time of a tick, which must not grow with the volume: `cargo bench`.

#[path = "../tests/support/phantom.rs"]
mod phantom;

use divan::{Bencher, black_box};
use phantom::{SOFT, setup, volume};
use typodont_core::device::Reading;
use typodont_core::frame::Vec3;
use typodont_core::sim::Simulation;
use typodont_core::touch::WorkingEnd;
use typodont_core::volume::{Label, Volume, distance};

fn main() {
    divan::main();
}

const SIZES: [&str; 3] = ["128x128x80", "256x256x161", "512x512x322"];

const BUR: WorkingEnd = WorkingEnd::Ball { radius: 0.7 };

/// A block of decay 22 mm wide with its top at z = 0.
fn block(size: &str) -> Volume {
    let dims: Vec<u32> = size.split('x').map(|n| n.parse().unwrap()).collect();
    let spacing = 22.0 / dims[0] as f32;
    volume([dims[0], dims[1], dims[2]], spacing, |p| (p.z, SOFT))
}

/// Turns a world along circles at a height, one tick per call.
fn circle(bencher: Bencher, size: &str, end: WorkingEnd, cuts: bool, height: impl Fn(u32) -> f32 + Sync) {
    let mut sim = Simulation::new(setup(block(size), end, cuts));
    let mut tick = 0;
    sim.step(&Reading::at(Vec3::Z * 5.0));
    bencher.bench_local(|| {
        let turn = tick as f32 * 0.004;
        let hand = Vec3::new(2.0 * libm::cosf(turn), 2.0 * libm::sinf(turn), height(tick));
        tick += 1;
        black_box(sim.step(&Reading::at(hand)))
    });
}

#[divan::bench(args = SIZES)]
fn free(bencher: Bencher, size: &str) {
    circle(bencher, size, WorkingEnd::Point, false, |_| 3.0);
}

#[divan::bench(args = SIZES)]
fn slide(bencher: Bencher, size: &str) {
    circle(bencher, size, WorkingEnd::Point, false, |t| if t < 10 { 0.5 } else { -0.3 });
}

#[divan::bench(args = SIZES)]
fn bur_slide(bencher: Bencher, size: &str) {
    circle(bencher, size, BUR, false, |t| if t < 10 { 1.0 } else { 0.3 });
}

#[divan::bench(args = SIZES, sample_count = 2000)]
fn bur_cut(bencher: Bencher, size: &str) {
    // Decay yields when the hand is 2.2 mm beyond the bur: quickly there, then slowly deeper, so that it cuts throughout.
    circle(bencher, size, BUR, true, |t| 1.0 - (t as f32 * 0.02).min(3.2) - t as f32 * 0.0008);
}

#[divan::bench(args = SIZES, sample_count = 5)]
fn distance_to_matter(bencher: Bencher, size: &str) {
    let block = block(size);
    bencher.bench_local(|| distance::to_set(block.grid(), |i| block.tissue(i) != Label::AIR));
}
