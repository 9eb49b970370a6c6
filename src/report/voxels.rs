//! Voxels of a session, packed for its page.
//!
//! Takes the volume before and after, and the removal of each voxel. Gives a header and one packed text, small enough
//! for a page that is opened from a disk. From these the page shows the cavity as it was at any moment.

use crate::session_file::ArchJaw;
use base64::Engine;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde::Serialize;
use std::io::Write;
use typodont_core::volume::{CellBox, Grid, Volume};
use typodont_exercise::score::Scored;

/// Most voxels that a page carries: a molar at 0.067 mm, and what a browser unpacks within a second. Of a finer volume every
/// second or third voxel along each axis is carried.
const VOXELS_MAX: usize = 12_000_000;

/// Most bytes of the packed voxels; the pictures take some 2.5 MB, and a page is to stay below 6 MB.
const PACKED_MAX: usize = 3_000_000;

/// Air kept around the tooth, voxels: what a ray needs to find the surface.
const AIR_MARGIN: u32 = 2;

/// Densities are carried in 32 steps: a finer surface is not seen, and solid stays solid.
const DENSITY_STEP_BITS: u32 = 3;

/// Steps of force, N.
const FORCE_STEP: f32 = 0.01;

/// Description of the voxels in a page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VoxelHeader {
    /// Voxels along each axis, the first fastest.
    pub dims: [u32; 3],
    pub spacing_mm: [f32; 3],
    /// Centre of the first, in tooth space.
    pub origin_mm: [f32; 3],
    /// True where y of tooth space runs toward mesial: in the upper left and the lower right.
    pub is_mirrored: bool,
    /// Jaw of which all teeth are shown; they have no common directions.
    pub jaw: Option<ArchJaw>,
    /// Index of the first voxel within the bundle's label maps.
    pub first: [u32; 3],
    /// Step, in voxels of the label maps along each axis, between voxels that the page contains.
    pub stride: u32,
    /// The part in which matter was lost: its first voxel and its size.
    pub changed_low: [u32; 3],
    pub changed_dims: [u32; 3],
    /// Packed parts in their order: names and bytes.
    pub parts: Vec<(&'static str, usize)>,
    /// Changes of instrument: the tick, and the index of the instrument in the tray that removes voxels from then on.
    pub held: Vec<(u64, u8)>,
}

/// The voxels of a page.
#[derive(Clone, Debug, PartialEq)]
pub struct PackedVoxels {
    pub header: VoxelHeader,
    /// All parts joined, compressed (zlib, RFC 1950), in base64.
    pub packed: String,
}

/// Packs what a page shows; `None` where there is no matter.
pub fn pack(scored: &Scored) -> Option<PackedVoxels> {
    let min_stride = StridedBox::of(&scored.replay.workpiece.volume, 1)?.stride_within(VOXELS_MAX);
    let packed = (min_stride..).map(|stride| pack_with_stride(scored, stride));
    packed.map_while(|v| v).find(|v| v.packed.len() <= PACKED_MAX || v.header.dims.iter().all(|&n| n < 16))
}

fn pack_with_stride(scored: &Scored, stride: u32) -> Option<PackedVoxels> {
    let after = &scored.replay.volume;
    let with_filling = start_with_filling(scored);
    let before = with_filling.as_ref().unwrap_or(&scored.replay.workpiece.volume);
    let matter_box = StridedBox::of(before, stride)?;
    let changed_box = matter_box.bounds_where(|v| before.densities()[v] != after.densities()[v]);
    let step = |volume: &Volume, voxel: usize| volume.densities()[voxel].bits() >> DENSITY_STEP_BITS;
    let removals: Vec<_> =
        changed_box.voxels().filter_map(|v| scored.removals.get(v).filter(|_| is_removed(scored, v))).collect();
    let mut moments: Vec<(u64, f32, u8)> = removals.iter().map(|f| (f.at.0, f.force, f.instrument)).collect();
    moments.sort_by_key(|m| m.0);
    moments.dedup_by_key(|m| m.0);
    let ticks = removals.iter().map(|f| f.at.0 as u32);
    let forces = moments.iter().map(|m| (m.1 / FORCE_STEP).round().clamp(0.0, 65535.0) as u32);
    let parts: [(&str, Vec<u8>); 6] = [
        ("start", matter_box.voxels().map(|v| step(before, v)).collect()),
        ("label", matter_box.voxels().map(|v| before.labels()[v].0).collect()),
        ("verdict", matter_box.voxels().map(|v| scored.verdicts[v] as u8).collect()),
        ("end", changed_box.voxels().map(|v| step(after, v)).collect()),
        ("fell", byte_planes(ticks, 4)),
        ("pressed", byte_planes(forces, 2)),
    ];
    let mut held: Vec<(u64, u8)> = moments.iter().map(|m| (m.0, m.2)).collect();
    held.dedup_by_key(|h| h.1);
    let StridedBox { first, dims, .. } = matter_box;
    let header = VoxelHeader {
        dims,
        spacing_mm: (matter_box.grid.spacing * stride as f32).to_array(),
        origin_mm: matter_box.grid.centre(first).to_array(),
        is_mirrored: scored.replay.workpiece.distal().y < 0.0,
        jaw: scored.replay.workpiece.arch_jaw().map(ArchJaw::from),
        first,
        stride,
        changed_low: std::array::from_fn(|a| (changed_box.first[a] - first[a]) / stride),
        changed_dims: changed_box.dims,
        parts: parts.iter().map(|(name, bytes)| (*name, bytes.len())).collect(),
        held,
    };
    Some(PackedVoxels { header, packed: compress(parts.iter().map(|(_, bytes)| bytes.as_slice())) })
}

/// Initial volume of a page about a filling, with the finished filling already in it: a page can only show the removal
/// of matter.
fn start_with_filling(scored: &Scored) -> Option<Volume> {
    scored.restoration.as_ref()?;
    let (before, after) = (&scored.replay.workpiece.volume, &scored.replay.volume);
    let mut begun = Volume::clone(before);
    for voxel in (0..after.grid().len()).filter(|&v| after.densities()[v] > before.densities()[v]) {
        begun.set(voxel, after.voxel(voxel));
    }
    Some(begun)
}

fn is_removed(scored: &Scored, voxel: usize) -> bool {
    let solid = |volume: &Volume| volume.densities()[voxel].is_solid();
    solid(&scored.replay.workpiece.volume) && !solid(&scored.replay.volume)
}

/// Numbers as bytes: all lowest ones first, then the next, which packs far better than number by number.
fn byte_planes(numbers: impl Iterator<Item = u32> + Clone, bytes: u32) -> Vec<u8> {
    (0..bytes).flat_map(|b| numbers.clone().map(move |n| (n >> (8 * b)) as u8)).collect()
}

/// Parts joined, compressed (zlib, RFC 1950), in base64.
pub(super) fn compress<'a>(parts: impl Iterator<Item = &'a [u8]>) -> String {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    for part in parts {
        encoder.write_all(part).expect("memory takes every byte");
    }
    let bytes = encoder.finish().expect("memory takes every byte");
    base64::engine::general_purpose::STANDARD.encode(bytes)
}

/// Voxels of a box in a grid, taken at a constant stride along each axis.
#[derive(Clone, Copy)]
struct StridedBox {
    grid: Grid,
    first: [u32; 3],
    stride: u32,
    dims: [u32; 3],
}

impl StridedBox {
    /// All matter of a volume with some air around; `None` of an empty one.
    fn of(volume: &Volume, stride: u32) -> Option<StridedBox> {
        let whole = *volume.grid();
        let CellBox { low: first, high: last } = volume.bounding_box()?.grown_within(&whole, AIR_MARGIN * stride);
        Some(StridedBox {
            grid: whole,
            first,
            stride,
            dims: std::array::from_fn(|a| (last[a] - first[a]) / stride + 1),
        })
    }

    /// Smallest stride with which at most `voxels` voxels are chosen.
    fn stride_within(&self, voxels: usize) -> u32 {
        let chosen = |stride: u32| self.dims.iter().map(|n| n.div_ceil(stride) as usize).product::<usize>();
        (1..).find(|&stride| chosen(stride) <= voxels).unwrap_or(1)
    }

    fn voxels(&self) -> impl Iterator<Item = usize> + use<> {
        let StridedBox { grid: whole, first, stride, dims } = *self;
        let at = move |axis: usize, i: u32| first[axis] + i * stride;
        (0..dims[2]).flat_map(move |z| {
            (0..dims[1]).flat_map(move |y| (0..dims[0]).map(move |x| whole.index([at(0, x), at(1, y), at(2, z)])))
        })
    }

    /// The smallest part with every chosen voxel that is `wanted`; one voxel where none is.
    fn bounds_where(&self, wanted: impl Fn(usize) -> bool) -> StridedBox {
        let (mut low, mut high) = ([u32::MAX; 3], [0; 3]);
        for voxel in self.voxels().filter(|&v| wanted(v)) {
            for (axis, at) in self.grid.cell(voxel).into_iter().enumerate() {
                (low[axis], high[axis]) = (low[axis].min(at), high[axis].max(at));
            }
        }
        if low[0] == u32::MAX {
            return StridedBox { dims: [1; 3], ..*self };
        }
        StridedBox { first: low, dims: std::array::from_fn(|a| (high[a] - low[a]) / self.stride + 1), ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;
    use typodont_core::frame::Vec3;

    #[test]
    fn a_selection_takes_every_so_manieth_voxel_of_its_box() {
        let whole = Grid::centred([9, 8, 7], Vec3::splat(0.1));
        let all = StridedBox { grid: whole, first: [1, 2, 1], stride: 2, dims: [4, 3, 3] };
        let cells: Vec<[u32; 3]> = all.voxels().map(|v| whole.cell(v)).collect();
        assert_eq!((cells.len(), cells[0], cells[1], cells[35]), (36, [1, 2, 1], [3, 2, 1], [7, 6, 5]));
        let part = all.bounds_where(|v| cells[5] == whole.cell(v) || cells[30] == whole.cell(v));
        assert_eq!((part.first, part.dims), ([3, 4, 1], [2, 1, 3]));
        let none = all.bounds_where(|_| false);
        assert_eq!((none.first, none.dims), ([1, 2, 1], [1, 1, 1]));
    }

    #[test]
    fn planes_hold_every_number() {
        let numbers = [0x0102_0304, 0xa0b0_c0d0];
        assert_eq!(byte_planes(numbers.into_iter(), 4), [0x04, 0xd0, 0x03, 0xc0, 0x02, 0xb0, 0x01, 0xa0]);
    }

    #[test]
    fn a_page_carries_when_how_hard_and_with_what_each_voxel_fell() {
        // Aim: whoever unpacks a page finds what the recording says. Method: unpack it by hand, and hold every fallen voxel
        // against the replay.
        let (_, scored) = crate::example();
        let PackedVoxels { header: about, packed } = pack(&scored).unwrap();
        let bytes = base64::engine::general_purpose::STANDARD.decode(packed).unwrap();
        let mut whole = Vec::new();
        flate2::read::ZlibDecoder::new(bytes.as_slice()).read_to_end(&mut whole).unwrap();
        assert_eq!(whole.len(), about.parts.iter().map(|p| p.1).sum::<usize>());
        let part = |wanted: &str| {
            let before: usize = about.parts.iter().take_while(|p| p.0 != wanted).map(|p| p.1).sum();
            let length = about.parts.iter().find(|p| p.0 == wanted).unwrap().1;
            &whole[before..before + length]
        };
        let (fell, pressed) = (part("fell"), part("pressed"));
        let count = fell.len() / 4;
        assert_eq!((about.stride, count), (1, scored.removals.iter().count()));
        let grid = *scored.replay.workpiece.volume.grid();
        let first = std::array::from_fn(|a| about.first[a] + about.changed_low[a]);
        let changed = StridedBox { grid, first, stride: 1, dims: about.changed_dims };
        let fallen: Vec<usize> = changed.voxels().filter(|&v| is_removed(&scored, v)).collect();
        let ticks: Vec<u32> =
            (0..count).map(|i| u32::from_le_bytes([0, 1, 2, 3].map(|p| fell[p * count + i]))).collect();
        let mut moments = ticks.clone();
        moments.sort_unstable();
        moments.dedup();
        for (voxel, tick) in fallen.into_iter().zip(ticks) {
            let fall = scored.removals.get(voxel).unwrap();
            assert_eq!(u64::from(tick), fall.at.0);
            let place = moments.binary_search(&tick).unwrap();
            let force = u16::from_le_bytes([pressed[place], pressed[moments.len() + place]]);
            assert!((f32::from(force) * FORCE_STEP - fall.force).abs() <= 0.5 * FORCE_STEP + 1e-5);
            let held = about.held.iter().rev().find(|h| h.0 <= u64::from(tick)).unwrap();
            assert_eq!(held.1, fall.instrument);
        }
        let labels = part("label");
        let all = StridedBox { grid, first: about.first, stride: 1, dims: about.dims };
        let initial = &scored.replay.workpiece.volume;
        assert!(all.voxels().zip(labels).all(|(v, l)| initial.labels()[v].0 == *l));
        assert!(all.voxels().zip(part("start")).all(|(v, d)| initial.densities()[v].is_solid() == (*d >= 16)));
    }
}
