//! Colours of the tooth's matter around its surface, smooth where labels change from voxel to voxel.
//!
//! Takes a volume and a palette. Gives a colour and a gloss for each cell of one or a few voxels, between whose centres
//! the renderers interpolate. Decay has a soft border: from sound tissue over a white spot (in enamel) and amber to its own
//! colour. Never looks farther than [`REACH`] cells, so that a cut changes the colours of its own and the next bricks only.

use super::enamel_colours::{EnamelLayers, ON_A_CROWN};
use super::scene::{Appearance, LabelPalette, VolumeInstance};
use super::unworked_tooth::UnworkedTooth;
use typodont_core::frame::{Vec3, smooth_step};
use typodont_core::parallel::par_map;
use typodont_core::volume::{BRICK, Density, Label, Volume};

/// Width of a cell, mm, that is not exceeded by averaging voxels: fine volumes need no colour for every voxel.
const CELL_WIDTH: f32 = 0.12;

/// Distance, cells, up to which decay tints its surroundings: wide enough that no voxel's corner shows in the border, and
/// far less than what an excavator removes with one stroke.
const REACH: usize = 4;

/// Weights of the cells at a distance of 0 to [`REACH`]: a Gaussian of 2.2 cells.
const WIDE: [f32; REACH + 1] = [1.0, 0.902, 0.662, 0.395, 0.192];

/// Weights of a cell and its neighbours: they smooth the stairs of voxels, and leave a single voxel visible.
const NARROW: [f32; 2] = [0.5, 0.25];

/// Weight of the decay at a place itself beside that around it: above 0, so that a last voxel of decay is seen, and below 1,
/// so that the border is soft.
const OWN_WEIGHT: f32 = 0.6;

/// Cells along the edge of the surroundings of a brick's cells.
const WINDOW: usize = BRICK as usize + 2 * REACH;

/// Colours of decay's border: the white spot of demineralised enamel, which scatters more than sound enamel and is that share nearer
/// to white, and the amber of firm, discoloured tissue. Chosen by eye on the fixed scenes; no published source.
const WHITE_SPOT: f32 = 0.385;
const AMBER: Vec3 = Vec3::new(0.80, 0.60, 0.33);

/// Depths under the tooth's own surface, mm, between which a surface is taken for cut.
const CUT_DEPTHS: [f32; 2] = [0.15, 0.4];

/// Tint of enamel deep in a fissure, where it stains with time, as on the neighbours' crowns.
const FISSURE: [f32; 3] = [0.93, 0.885, 0.81];

/// Tint of enamel at the tip of a cusp or at an edge, which light leaves at the sides: as on the cusps of neighbours. Chosen by eye.
const CLEAR: [f32; 3] = [0.88, 0.915, 0.95];

/// Gloss that the moistest decay has more than the rest of it: less than sound tissue.
const MOIST: f32 = 0.08;

/// Distance between the values of the noise that mottles decay, mm.
const MOTTLE: [f32; 2] = [0.55, 0.21];

/// Colours and gloss of the cells near the surface; those of other cells are not defined.
#[derive(Clone, Debug)]
pub struct SurfaceColours {
    palette: LabelPalette,
    mixer: Mixer,
    /// Voxels along a cell's edge: 1, 2, 4 or 8.
    cell_voxels: u32,
    dims: [u32; 3],
    /// Red, green, blue and gloss, x fastest.
    texels: Vec<[u8; 4]>,
}

/// Matter of a cell, or a weighted sum over cells.
#[derive(Clone, Copy, Debug, Default)]
struct Matter {
    /// Colour and gloss of sound matter, and its amount.
    sound: [f32; 4],
    sound_amount: f32,
    /// Amount of enamel in it.
    enamel: f32,
    /// Gloss that it loses where it is cut.
    dulling: f32,
    /// Colour and gloss of decayed matter, and its amount.
    decay: [f32; 4],
    decay_amount: f32,
}

impl Matter {
    fn add(&mut self, other: &Matter, weight: f32) {
        for c in 0..4 {
            self.sound[c] += other.sound[c] * weight;
            self.decay[c] += other.decay[c] * weight;
        }
        self.sound_amount += other.sound_amount * weight;
        self.enamel += other.enamel * weight;
        self.dulling += other.dulling * weight;
        self.decay_amount += other.decay_amount * weight;
    }

    fn amount(&self) -> f32 {
        self.sound_amount + self.decay_amount
    }

    /// Share of decayed matter, 0 to 1.
    fn decayed_share(&self) -> f32 {
        self.decay_amount / self.amount().max(1e-6)
    }
}

impl SurfaceColours {
    pub fn new(tooth: &VolumeInstance) -> SurfaceColours {
        let VolumeInstance { volume, palette, .. } = *tooth;
        let grid = volume.grid();
        let voxels = CELL_WIDTH / grid.spacing.min_element();
        let cell_voxels = [1, 2, 4, BRICK].into_iter().rfind(|&edge| edge as f32 <= voxels).unwrap_or(1);
        let dims = grid.dims.map(|n| n.div_ceil(cell_voxels));
        let texels = vec![[0; 4]; dims.iter().map(|&n| n as usize).product()];
        let mixer = Mixer::new(palette);
        let mut colours = SurfaceColours { palette: palette.clone(), mixer, cell_voxels, dims, texels };
        let bricks: Vec<usize> = (0..volume.bricks().len()).collect();
        colours.compute(tooth, &bricks);
        colours
    }

    /// True if these are the colours of this palette.
    pub fn has_palette(&self, palette: &LabelPalette) -> bool {
        self.palette == *palette
    }

    #[cfg(feature = "gpu")]
    pub fn cell_voxels(&self) -> u32 {
        self.cell_voxels
    }

    #[cfg(feature = "gpu")]
    pub fn dims(&self) -> [u32; 3] {
        self.dims
    }

    #[cfg(feature = "gpu")]
    pub fn texels(&self) -> &[[u8; 4]] {
        &self.texels
    }

    /// Computes the colours again that changed bricks can affect. Returns the bricks that were computed.
    pub fn update(&mut self, tooth: &VolumeInstance, changed: &[usize]) -> Vec<usize> {
        let bricks = tooth.volume.bricks();
        let last = bricks.dims().map(|n| n - 1);
        let mut affected: Vec<usize> = Vec::new();
        for &brick in changed {
            let at = bricks.corner(brick).map(|c| c / BRICK);
            // Cells of more than 2 voxels reach beyond the neighbouring brick.
            let reach = (REACH as u32 * self.cell_voxels).div_ceil(BRICK);
            let range = |a: usize| at[a].saturating_sub(reach)..=(at[a] + reach).min(last[a]);
            for z in range(2) {
                for y in range(1) {
                    affected.extend(range(0).map(|x| bricks.index([x, y, z])));
                }
            }
        }
        affected.sort_unstable();
        affected.dedup();
        self.compute(tooth, &affected)
    }

    /// Cells of a brick: the first, and the number along each axis.
    pub fn block(&self, volume: &Volume, brick: usize) -> ([u32; 3], [u32; 3]) {
        let first = volume.bricks().corner(brick).map(|c| c / self.cell_voxels);
        let edge = BRICK / self.cell_voxels;
        (first, std::array::from_fn(|a| edge.min(self.dims[a] - first[a])))
    }

    /// Texels of a block of cells, x fastest.
    #[cfg(feature = "gpu")]
    pub fn texels_of(&self, (first, size): ([u32; 3], [u32; 3])) -> Vec<u8> {
        let rows = (0..size[2]).flat_map(|z| (0..size[1]).map(move |y| [first[0], first[1] + y, first[2] + z]));
        rows.flat_map(|cell| {
            let start = self.index(cell);
            self.texels[start..start + size[0] as usize].iter().flatten().copied()
        })
        .collect()
    }

    /// Colour and gloss at a point near the surface, in voxel coordinates.
    pub fn at(&self, at: Vec3) -> Appearance {
        let last = Vec3::from(self.dims.map(|n| n as f32 - 1.0));
        let place = ((at + 0.5) / self.cell_voxels as f32 - 0.5).clamp(Vec3::ZERO, last);
        let base = place.floor();
        let part = place - base;
        let start = self.index([base.x as u32, base.y as u32, base.z as u32]);
        // The last cell of an axis is its own neighbour.
        let steps = [1, self.dims[0] as usize, self.dims[0] as usize * self.dims[1] as usize];
        let [dx, dy, dz] = [0, 1, 2].map(|a| if base[a] < last[a] { steps[a] } else { 0 });
        let texel = |place: usize| self.texels[place].map(f32::from);
        let mix = |a: [f32; 4], b: [f32; 4], share: f32| std::array::from_fn(|c| a[c] + (b[c] - a[c]) * share);
        let row = |place: usize| mix(texel(place), texel(place + dx), part.x);
        let slice = |place: usize| mix(row(place), row(place + dy), part.y);
        let [r, g, b, gloss] = mix(slice(start), slice(start + dz), part.z).map(|v: f32| v * (1.0 / 255.0));
        Appearance { colour: [r, g, b], gloss }
    }

    fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        (z as usize * self.dims[1] as usize + y as usize) * self.dims[0] as usize + x as usize
    }

    /// Computes the cells of those bricks that are near the surface, and returns these bricks.
    fn compute(&mut self, tooth: &VolumeInstance, bricks: &[usize]) -> Vec<usize> {
        /// Number of bricks from which threads are started: a cut changes fewer, in every picture.
        const MANY: usize = 64;
        if bricks.is_empty() {
            return Vec::new();
        }
        let volume = tooth.volume;
        let make = |i: usize| {
            let block = self.block(volume, bricks[i]);
            self.is_near_surface(volume, block).then(|| self.colours_of(tooth, block))
        };
        let made =
            if bricks.len() < MANY { (0..bricks.len()).map(make).collect() } else { par_map(bricks.len(), make) };
        let mut computed = Vec::new();
        for (&brick, texels) in bricks.iter().zip(made) {
            let Some(texels) = texels else { continue };
            let (first, size) = self.block(volume, brick);
            for (row, texels) in texels.chunks_exact(size[0] as usize).enumerate() {
                let [y, z] = [row as u32 % size[1], row as u32 / size[1]];
                let start = self.index([first[0], first[1] + y, first[2] + z]);
                self.texels[start..start + texels.len()].copy_from_slice(texels);
            }
            computed.push(brick);
        }
        computed
    }

    /// True if the surface may be so near to a block of cells that its colours are interpolated there.
    fn is_near_surface(&self, volume: &Volume, (first, size): ([u32; 3], [u32; 3])) -> bool {
        let grid = volume.grid();
        let [xs, ys, zs] = [0, 1, 2].map(|a| {
            let low = first[a].saturating_sub(1) * self.cell_voxels;
            low..((first[a] + size[a] + 1) * self.cell_voxels).min(grid.dims[a])
        });
        // Matter at the end of the grid has its surface there.
        let is_at_end = (0..3).any(|a| first[a] == 0 || first[a] + size[a] == self.dims[a]);
        let (mut has_matter, mut has_air) = (false, is_at_end);
        for [y, z] in zs.flat_map(|z| ys.clone().map(move |y| [y, z])) {
            let row = grid.index([xs.start, y, z]);
            for density in &volume.densities()[row..row + xs.len()] {
                has_matter |= density.bits() > 0;
                has_air |= density.bits() < u8::MAX;
            }
            if has_matter && has_air {
                return true;
            }
        }
        false
    }

    /// Colours of a block of cells, x fastest.
    fn colours_of(&self, tooth: &VolumeInstance, (first, size): ([u32; 3], [u32; 3])) -> Vec<[u8; 4]> {
        let (volume, mixer) = (tooth.volume, &self.mixer);
        let window = self.window(volume, first);
        let size = size.map(|n| n as usize);
        let count: usize = size.iter().product();
        let cell_at = |i: usize| -> Vec3 {
            let cell = [i % size[0], i / size[0] % size[1], i / (size[0] * size[1])];
            Vec3::from(std::array::from_fn(|a| (first[a] as usize + cell[a]) as f32))
        };
        let grid = volume.grid();
        let edge = self.cell_voxels as f32;
        let step = edge * grid.spacing.max_element();
        let in_tooth = |cell: Vec3| grid.origin + (cell * edge + 0.5 * (edge - 1.0)) * grid.spacing;
        if let Some(Label(sole)) = window.sole_label.filter(|_| !window.has_decay) {
            let matter = &mixer.matter[usize::from(sole)];
            return match tooth.unworked_tooth.filter(|_| mixer.depends_on_place(matter)) {
                None => vec![texel(matter.sound, 1.0); count],
                Some(unworked) => {
                    let place =
                        |i: usize| mixer.place_at(volume, unworked, in_tooth(cell_at(i)), step, matter.enamel > 0.0);
                    let seen = |i: usize| mixer.seen_at(matter, &place(i));
                    (0..count).map(|i| texel(seen(i).sound, 1.0)).collect()
                }
            };
        }
        let mut narrow = blurred(&window.cells, size, &NARROW);
        let mut wide = window.has_decay.then(|| blurred(&window.cells, size, &WIDE));
        if let Some(unworked) = tooth.unworked_tooth {
            let mut sums: Vec<&mut Vec<Matter>> = std::iter::once(&mut narrow).chain(wide.as_mut()).collect();
            for i in 0..count {
                if !sums.iter().any(|sum| mixer.depends_on_place(&sum[i])) {
                    continue;
                }
                let has_enamel = sums.iter().any(|sum| sum[i].enamel > 0.0);
                let place = mixer.place_at(volume, unworked, in_tooth(cell_at(i)), step, has_enamel);
                for sum in &mut sums {
                    sum[i] = mixer.seen_at(&sum[i], &place);
                }
            }
        }
        let mut texels = Vec::with_capacity(count);
        for (i, near) in narrow.iter().enumerate() {
            let Some(wide) = wide.as_ref().map(|wide| &wide[i]).filter(|wide| wide.decay_amount > 0.0) else {
                texels.push(texel(near.sound, near.sound_amount));
                continue;
            };
            let place = cell_at(i) * (grid.spacing * edge);
            texels.push(decayed_texel(near, wide, mottle(place)));
        }
        texels
    }

    /// Matter of a block of cells and of its surroundings.
    fn window(&self, volume: &Volume, first: [u32; 3]) -> Window {
        let mixer = &self.mixer;
        let mut cells = vec![Matter::default(); WINDOW * WINDOW * WINDOW];
        let (mut has_decay, mut first_label, mut is_sole) = (false, Label::AIR, true);
        let grid = volume.grid();
        let edge = self.cell_voxels as usize;
        let start = first.map(|c| c as i64 - REACH as i64);
        let span = |a: usize, n: usize| {
            let low = (start[a] + n as i64) * edge as i64;
            low.clamp(0, i64::from(grid.dims[a])) as u32..(low + edge as i64).clamp(0, i64::from(grid.dims[a])) as u32
        };
        let share = 1.0 / (edge * edge * edge) as f32;
        for (i, cell) in cells.iter_mut().enumerate() {
            let [x, y, z] = [i % WINDOW, i / WINDOW % WINDOW, i / (WINDOW * WINDOW)];
            for z in span(2, z) {
                for y in span(1, y) {
                    for x in span(0, x) {
                        let voxel = volume.voxel(grid.index([x, y, z]));
                        if voxel.label != Label::AIR {
                            let label = mixer.alike[usize::from(voxel.label.0)];
                            first_label = if first_label == Label::AIR { label } else { first_label };
                            is_sole &= label == first_label;
                            cell.add(&mixer.matter[usize::from(label.0)], seen_amount(voxel.density) * share);
                        }
                    }
                }
            }
            has_decay |= cell.decay_amount > 0.0;
        }
        let sole_label = (is_sole && first_label != Label::AIR).then_some(first_label);
        Window { cells, has_decay, sole_label }
    }
}

/// Amount of a voxel's matter that counts for colours: hardly any where the voxel's centre is clearly outside the surface. The
/// rest that a bur leaves there of a voxel of decay would tint the sound tissue beneath.
fn seen_amount(density: Density) -> f32 {
    /// Density from which matter counts: somewhat less than that of the surface, so that decay that is scored is seen.
    const FROM: f32 = 0.35;
    /// Share that counts of a voxel outside: where there is no other matter, it has its own colour.
    const OUTSIDE: f32 = 0.02;
    let density = density.unit();
    ((density - FROM) / (1.0 - FROM)).max(OUTSIDE * density)
}

/// Matter around the cells of a brick, [`WINDOW`] cells wide, x fastest.
struct Window {
    cells: Vec<Matter>,
    has_decay: bool,
    /// The only label in the window, if there is one.
    sole_label: Option<Label>,
}

/// Matter of one full voxel of each label.
#[derive(Clone, Debug)]
struct Mixer {
    matter: Vec<Matter>,
    /// `None` if nothing shines through enamel.
    enamel: Option<TranslucentEnamel>,
    /// The first label that looks like each label: where decay is hidden, sums must not differ in the last bit either.
    alike: Vec<Label>,
}

/// Properties of a place of the tooth on which the look of its matter depends.
#[derive(Clone, Copy, Debug, Default)]
struct Place {
    /// 0 on the tooth's own surface, 1 where it is cut.
    cut: f32,
    /// Thickness of the enamel that is looked through, mm, and the surface's form: 1 in a fissure, −1 on a cusp; both for enamel only.
    thickness: f32,
    hollow: f32,
}

/// Enamel through which dentine shines.
#[derive(Clone, Debug)]
struct TranslucentEnamel {
    /// Its colour in the palette.
    own: [f32; 3],
    layers: EnamelLayers,
}

impl TranslucentEnamel {
    /// The same matter, with the colour that its enamel has at a thickness, mm.
    fn seen_through(&self, matter: &Matter, thickness: f32) -> Matter {
        let seen = self.layers.at(thickness);
        let mut matter = *matter;
        for ((sum, seen), own) in matter.sound.iter_mut().zip(seen).zip(self.own) {
            *sum += matter.enamel * (seen - own);
        }
        matter
    }
}

impl Mixer {
    /// True if matter looks different where enamel is thin or in a fissure, or where it is cut.
    fn depends_on_place(&self, matter: &Matter) -> bool {
        matter.dulling > 0.0 || matter.enamel > 0.0
    }

    /// Properties of a place in tooth space. `step`: a cell's width, mm; `has_enamel`: false where no enamel is near.
    fn place_at(&self, volume: &Volume, unworked: &UnworkedTooth, place: Vec3, step: f32, has_enamel: bool) -> Place {
        let cut = rise(CUT_DEPTHS[0], CUT_DEPTHS[1], unworked.depth_of(place));
        if !has_enamel {
            return Place { cut, ..Place::default() };
        }
        let thickness = || {
            let across = unworked.enamel_under(place);
            let inward = if cut > 0.0 { thickness_inward(volume, unworked, place, across, step) } else { across };
            across + (inward - across) * cut
        };
        Place {
            cut,
            thickness: if self.enamel.is_some() { thickness() } else { 0.0 },
            hollow: if cut < 1.0 { unworked.hollowness_at(place) } else { 0.0 },
        }
    }

    /// Matter as it looks at a place: its enamel as thick as it is there, and dull where it is cut.
    fn seen_at(&self, matter: &Matter, place: &Place) -> Matter {
        let mut seen = match &self.enamel {
            Some(enamel) if matter.enamel > 0.0 => enamel.seen_through(matter, place.thickness),
            _ => *matter,
        };
        seen.sound[3] -= matter.dulling * place.cut;
        if matter.enamel > 0.0 && place.cut < 1.0 {
            let tint = if place.hollow > 0.0 { FISSURE } else { CLEAR };
            let share = matter.enamel / matter.sound_amount.max(1e-6) * (1.0 - place.cut) * place.hollow.abs();
            for (sum, tint) in seen.sound.iter_mut().zip(tint) {
                *sum *= 1.0 + (tint - 1.0) * share;
            }
        }
        seen
    }

    fn new(palette: &LabelPalette) -> Mixer {
        let look = |label: u8| {
            let index = usize::from(label);
            (palette.appearances[index], palette.is_decay[index], palette.cut_gloss[index])
        };
        let all = || 1..=u8::MAX;
        let alike = all().map(|label| Label(all().find(|&other| look(other) == look(label)).unwrap_or(label)));
        let translucent = palette.translucent.map(|Label(label)| look(label));
        let matter = |label: u8| {
            let (Appearance { colour: [r, g, b], gloss }, is_decay, cut_gloss) = look(label);
            let own = [r, g, b, gloss];
            match is_decay {
                true => Matter { decay: own, decay_amount: 1.0, ..Matter::default() },
                false => Matter {
                    sound: own,
                    sound_amount: 1.0,
                    enamel: if translucent == Some(look(label)) { 1.0 } else { 0.0 },
                    dulling: cut_gloss.map_or(0.0, |cut| (gloss - cut).max(0.0)),
                    ..Matter::default()
                },
            }
        };
        let enamel = palette.translucent.zip(palette.under_translucent).map(|(label, under)| {
            let own = palette.appearance(label).colour;
            TranslucentEnamel { own, layers: EnamelLayers::new(own, under) }
        });
        Mixer {
            matter: (0..=u8::MAX).map(matter).collect(),
            enamel,
            alike: std::iter::once(Label::AIR).chain(alike).collect(),
        }
    }
}

/// Thickness of the enamel behind a cut surface, mm, from the place inward: over a floor the distance to dentine (`across`), at a wall,
/// which is seen along the layer, up to the thickness on most of a crown. `step`: distance at which the surface's slope is
/// measured, mm.
fn thickness_inward(volume: &Volume, unworked: &UnworkedTooth, place: Vec3, across: f32, step: f32) -> f32 {
    if across <= 0.0 || across >= ON_A_CROWN {
        return across;
    }
    let inward = slope(place, step, |p| volume.density_at(p));
    if inward == Vec3::ZERO {
        return across;
    }
    let toward_dentine = -slope(place, unworked.spacing(), |p| unworked.enamel_under(p));
    let lengths = inward.length() * toward_dentine.length();
    if lengths < 1e-6 {
        return across;
    }
    // Dentine lies across / cosine away, and where the cut leads away from it, none.
    let cosine = inward.dot(toward_dentine) / lengths;
    across / cosine.max(across / ON_A_CROWN)
}

/// Direction in which a value rises, from four places around one: the gradient times four times the step.
fn slope(place: Vec3, step: f32, value: impl Fn(Vec3) -> f32) -> Vec3 {
    const WAYS: [Vec3; 4] =
        [Vec3::new(1.0, -1.0, -1.0), Vec3::new(-1.0, 1.0, -1.0), Vec3::new(-1.0, -1.0, 1.0), Vec3::new(1.0, 1.0, 1.0)];
    WAYS.into_iter().map(|way| way * value(place + way * step)).sum()
}

/// Weighted sums over the surroundings of the cells in the middle of a window, one axis after the other.
fn blurred(window: &[Matter], size: [usize; 3], weights: &[f32]) -> Vec<Matter> {
    let reach = weights.len() - 1;
    let mut dims = [WINDOW; 3];
    let mut from = window.to_vec();
    for axis in 0..3 {
        let mut to_dims = dims;
        to_dims[axis] = size[axis];
        let stride = [1, dims[0], dims[0] * dims[1]][axis];
        let mut to = Vec::with_capacity(to_dims.iter().product());
        for z in 0..to_dims[2] {
            for y in 0..to_dims[1] {
                for x in 0..to_dims[0] {
                    let mut at = [x, y, z];
                    at[axis] += REACH;
                    let middle = (at[2] * dims[1] + at[1]) * dims[0] + at[0];
                    let mut sum = Matter::default();
                    sum.add(&from[middle], weights[0]);
                    for step in 1..=reach {
                        sum.add(&from[middle - step * stride], weights[step]);
                        sum.add(&from[middle + step * stride], weights[step]);
                    }
                    to.push(sum);
                }
            }
        }
        (from, dims) = (to, to_dims);
    }
    from
}

fn texel(sum: [f32; 4], amount: f32) -> [u8; 4] {
    sum.map(|v| (v / amount.max(1e-6) * 255.0 + 0.5) as u8)
}

/// Colour and gloss where decay is near. The closer decay is, and the more of it there is at the place itself, the farther
/// along the way from sound tissue to its own colour; noise makes the way uneven.
fn decayed_texel(near: &Matter, wide: &Matter, mottle: f32) -> [u8; 4] {
    // Both shares are one half at the border of decay. The first makes it soft; the second still shows a single voxel.
    let [far, own] = [wide.decayed_share(), near.decayed_share()];
    let share = far + OWN_WEIGHT * own * (1.0 - far);
    // Within these bounds, more decay never looks like less, and a little of it is seen everywhere.
    let unevenness = (2.2 * mottle).clamp(-0.6, 0.9);
    let uneven = share + unevenness * share * (1.0 - share);
    let mean = |sum: [f32; 4], amount: f32| (Vec3::new(sum[0], sum[1], sum[2]) / amount, sum[3] / amount);
    let (decay, decay_gloss) = mean(wide.decay, wide.decay_amount);
    // Leathery: dark and dull here, paler and moist there.
    let decay = if mottle < 0.0 { decay * (1.0 + 0.55 * mottle) } else { decay.lerp(AMBER, 0.7 * mottle) };
    let decay_gloss = decay_gloss + MOIST * mottle.max(0.0);
    let (sound, sound_gloss) = match [near, wide].into_iter().find(|matter| matter.sound_amount > 1e-4) {
        Some(matter) => mean(matter.sound, matter.sound_amount),
        None => (decay, decay_gloss),
    };
    let enamel = wide.enamel / wide.sound_amount.max(1e-6);
    let spot = sound.lerp(Vec3::ONE, WHITE_SPOT * enamel.min(1.0));
    let amber = decay.lerp(AMBER, 0.6);
    let colour = sound
        .lerp(spot, rise(0.0, 0.16, uneven))
        .lerp(amber, rise(0.14, 0.95, uneven))
        .lerp(decay, rise(0.6, 1.2, uneven));
    let gloss = sound_gloss + (decay_gloss - sound_gloss) * rise(0.03, 0.6, uneven);
    texel([colour.x, colour.y, colour.z, gloss].map(|v| v.clamp(0.0, 1.0)), 1.0)
}

/// Rises from 0 to 1 between two values, without a kink.
fn rise(from: f32, to: f32, value: f32) -> f32 {
    smooth_step((value - from) / (to - from))
}

/// Noise at a place, mm: −1 to 1, the same at the same place of every volume.
fn mottle(place: Vec3) -> f32 {
    0.65 * value_noise(place / MOTTLE[0]) + 0.35 * value_noise(place / MOTTLE[1])
}

/// Random values on a lattice of whole numbers, −1 to 1, interpolated between them.
fn value_noise(at: Vec3) -> f32 {
    let base = at.floor();
    let part = at - base;
    let part = part * part * (3.0 - 2.0 * part);
    let mut sum = 0.0;
    for n in 0..8u32 {
        let is_next = [0, 1, 2].map(|a| n >> a & 1 == 1);
        let weight: f32 = (0..3).map(|a| if is_next[a] { part[a] } else { 1.0 - part[a] }).product();
        let corner = [0, 1, 2].map(|a| base[a] as i32 as u32 + u32::from(is_next[a]));
        sum += weight * (lattice_value(corner) * 2.0 - 1.0);
    }
    sum
}

/// Random value of a lattice point, 0 to 1 (the finalizer of MurmurHash3).
fn lattice_value([x, y, z]: [u32; 3]) -> f32 {
    let mut hash =
        x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77).rotate_left(11) ^ z.wrapping_mul(0xC2B2_AE3D);
    hash = (hash ^ hash >> 16).wrapping_mul(0x85EB_CA6B);
    hash = (hash ^ hash >> 13).wrapping_mul(0xC2B2_AE35);
    (hash >> 8) as f32 / (1u32 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relief::GROUND_GLOSS;
    use crate::scene::{Changes, RenderMode};
    use typodont_core::frame::{Pose, Vec3};
    use typodont_core::volume::{Grid, Voxel};

    const DECAY: Label = Label(2);
    const DENTINE: Label = Label(3);

    fn palette() -> LabelPalette {
        let mut palette =
            LabelPalette::from_colours(|label| [[0.9, 0.9, 0.8], [0.4, 0.2, 0.1]][usize::from(label == DECAY)], 0.2);
        palette.is_decay[usize::from(DECAY.0)] = true;
        palette.translucent = Some(Label(1));
        palette.under_translucent = Some([0.8, 0.7, 0.5]);
        palette.cut_gloss = std::array::from_fn(|label| (Label(label as u8) != DECAY).then_some(GROUND_GLOSS));
        palette
    }

    fn tooth<'a>(volume: &'a Volume, palette: &'a LabelPalette, unworked: &'a UnworkedTooth) -> VolumeInstance<'a> {
        VolumeInstance {
            volume,
            changes: Changes::All,
            world_from_tooth: Pose::IDENTITY,
            palette,
            unworked_tooth: Some(unworked),
            mode: RenderMode::Surface,
        }
    }

    /// A ball of enamel over dentine, whose upper part is decayed.
    fn ball(spacing: f32) -> Volume {
        let grid = Grid::centred([52, 47, 44], Vec3::splat(spacing));
        let label = |p: Vec3| match p.length() / spacing {
            _ if p.z > 9.0 * spacing => DECAY,
            steps if steps > 12.0 => Label(1),
            _ => DENTINE,
        };
        Volume::from_distance(grid, 1.5 * spacing, |p| (p.length() - 18.0 * spacing, label(p)))
    }

    #[test]
    fn after_a_cut_the_colours_near_the_surface_are_those_computed_anew() {
        // Aim: what is seen depends on what is there, not on how it came about. Method: cells of one voxel and of several; a
        // cut through the decay and one at the border of the grid.
        for spacing in [0.2, 0.06, 0.03] {
            let mut volume = ball(spacing);
            let palette = palette();
            let depth = UnworkedTooth::of(&volume, &[DENTINE]);
            let mut colours = SurfaceColours::new(&tooth(&volume, &palette, &depth));
            for cell in [[26, 23, 40], [26, 24, 39], [27, 24, 38], [26, 23, 31], [8, 23, 22]] {
                volume.set_cell(cell, Voxel::AIR);
            }
            let changed = volume.take_dirty();
            let computed = colours.update(&tooth(&volume, &palette, &depth), &changed);
            let anew = SurfaceColours::new(&tooth(&volume, &palette, &depth));
            assert!(!computed.is_empty());
            for brick in 0..volume.bricks().len() {
                let (first, size) = anew.block(&volume, brick);
                if anew.is_near_surface(&volume, (first, size)) {
                    let cells = |all: &SurfaceColours| -> Vec<[u8; 4]> {
                        let grid = Grid { dims: size, spacing: Vec3::ONE, origin: Vec3::ZERO };
                        grid.cells().map(|c| all.texels[all.index([0, 1, 2].map(|a| first[a] + c[a]))]).collect()
                    };
                    assert!(cells(&colours) == cells(&anew), "{spacing} mm, brick {brick}");
                }
            }
        }
    }

    #[test]
    fn dentine_shines_through_thin_enamel() {
        // Aim: enamel over dentine is yellower the thinner it is, and the border between both has no edge. Method: a wedge of
        // enamel over dentine, seen from above.
        let spacing = 0.1;
        let grid = Grid::centred([60, 20, 40], Vec3::splat(spacing));
        let thickness = |x: f32| 0.4 * (x + 2.0);
        let label = |p: Vec3| if p.z < 1.0 - thickness(p.x) { DENTINE } else { Label(1) };
        let volume = Volume::from_distance(grid, 1.5 * spacing, |p| (p.z - 1.0, label(p)));
        let mut palette =
            LabelPalette::from_colours(|l| if l == DENTINE { [0.8, 0.7, 0.5] } else { [0.95, 0.94, 0.9] }, 0.2);
        palette.translucent = Some(Label(1));
        palette.under_translucent = Some([0.8, 0.7, 0.5]);
        let depth = UnworkedTooth::of(&volume, &[DENTINE]);
        let colours = SurfaceColours::new(&tooth(&volume, &palette, &depth));
        let blue: Vec<f32> = (0..50)
            .map(|i| colours.at(grid.from_tooth(Vec3::new(-2.5 + 0.1 * i as f32, 0.0, 1.0))).colour[2])
            .collect();
        assert!(blue.windows(2).all(|pair| pair[1] > pair[0] - 0.005 && pair[1] < pair[0] + 0.05), "{blue:?}");
        assert!(blue[0] < 0.51 && blue[49] > 0.82, "{blue:?}");
        // Without the depth, or where the palette hides what is under enamel, all enamel has one colour.
        let without_depth =
            SurfaceColours::new(&VolumeInstance { unworked_tooth: None, ..tooth(&volume, &palette, &depth) });
        palette.under_translucent = None;
        let hidden = SurfaceColours::new(&tooth(&volume, &palette, &depth));
        assert!(colours.has_palette(&palette) != hidden.has_palette(&palette));
        for plain in [without_depth, hidden] {
            assert!((plain.at(grid.from_tooth(Vec3::new(1.5, 0.0, 1.0))).colour[2] - 0.9).abs() < 0.005);
        }
    }

    #[test]
    fn what_is_left_of_decay_outside_the_surface_is_not_seen() {
        // Aim: a floor from which all decay was cut looks sound. Method: dentine up to a plane; the voxels above it hold the
        // little matter that lies there, of decay or of dentine.
        let spacing = 0.1;
        let grid = Grid::centred([30, 30, 30], Vec3::splat(spacing));
        let palette = palette();
        let colour = |above: Label| {
            let label = |p: Vec3| if p.z > 0.0 { above } else { DENTINE };
            let volume = Volume::from_distance(grid, 1.5 * spacing, |p| (p.z - 0.02, label(p)));
            let depth = UnworkedTooth::of(&volume, &[DENTINE]);
            SurfaceColours::new(&tooth(&volume, &palette, &depth)).at(grid.from_tooth(Vec3::new(0.0, 0.0, 0.02)))
        };
        let (cut, sound) = (Vec3::from(colour(DECAY).colour), Vec3::from(colour(DENTINE).colour));
        assert!(cut.distance(sound) < 0.03, "{cut} beside {sound}");
    }

    #[test]
    fn noise_is_even_and_continuous() {
        // Aim: mottles lighten as much as they darken and have no edges. Method: its mean and its largest step.
        let places = (0..20_000).map(|i| Vec3::new(0.013 * i as f32, 0.4, -7.0));
        let values: Vec<f32> = places.map(mottle).collect();
        assert!((values.iter().sum::<f32>() / values.len() as f32).abs() < 0.05);
        assert!(values.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.12));
        assert!(values.iter().any(|v| *v > 0.4) && values.iter().any(|v| *v < -0.4));
    }

    #[test]
    fn a_little_decay_is_seen_wherever_it_is_and_more_of_it_no_less() {
        // Aim: what is scored can be seen, whatever the noise is there. Method: clumps of three and of five cells at many places.
        let palette = palette();
        let grid = Grid::centred([40; 3], Vec3::splat(0.1));
        let seen = |corner: u32, size: u32| {
            let mut volume = Volume::from_distance(grid, 0.2, |p| (p.z - 1.0, DENTINE));
            let top = grid.from_tooth(Vec3::Z * 0.95).z as u32;
            for cell in (Grid { dims: [size; 3], ..grid }).cells() {
                let cell = [corner + cell[0], corner + cell[1], top - cell[2]];
                let voxel = volume.voxel(grid.index(cell));
                volume.set_cell(cell, Voxel { label: DECAY, ..voxel });
            }
            let unworked = UnworkedTooth::of(&volume, &[]);
            let middle = corner as f32 + 0.5 * (size as f32 - 1.0);
            let place = Vec3::new(middle, middle, grid.from_tooth(Vec3::Z).z);
            let colours = SurfaceColours::new(&tooth(&volume, &palette, &unworked));
            Vec3::from(colours.at(place).colour).distance(Vec3::from(palette.appearance(DENTINE).colour))
        };
        let all: Vec<[f32; 2]> = (5..30).map(|corner| [3, 5].map(|size| seen(corner, size))).collect();
        for [few, many] in &all {
            assert!(*few > 0.15 && *many > *few, "{all:?}");
        }
    }

    #[test]
    fn enamel_at_a_wall_is_whiter_near_dentine_than_as_thin_a_layer() {
        // Aim: the border between enamel and dentine is seen in a cavity. Method: the same wall through both, once cut into a
        // larger block, once as the block's own side: 0.4 mm from dentine blue, which dentine lacks, differs. Fine voxels share a
        // cell.
        for spacing in [0.1, 0.05, 0.03] {
            let grid = Grid::centred([(4.4 / spacing) as u32; 3], Vec3::splat(spacing));
            let block = |p: Vec3| (p.abs() - 2.0).max_element();
            let label = |p: Vec3| if p.z > 0.0 { Label(1) } else { DENTINE };
            let whole = Volume::from_distance(grid, 1.5 * spacing, |p| (block(p), label(p)));
            let cut = Volume::from_distance(grid, 1.5 * spacing, |p| (block(p).max(p.x), label(p)));
            let mut palette = palette();
            palette.appearances[usize::from(DENTINE.0)].colour = [0.8, 0.7, 0.5];
            let wall = |unworked: &UnworkedTooth, height: f32| {
                let colours = SurfaceColours::new(&tooth(&cut, &palette, unworked));
                colours.at(grid.from_tooth(Vec3::new(0.0, 0.0, height))).colour[2]
            };
            let [through_layer, along_wall] =
                [&cut, &whole].map(|first| wall(&UnworkedTooth::of(first, &[DENTINE]), 0.4));
            assert!(along_wall > through_layer + 0.01, "{spacing}: {along_wall} and {through_layer}");
            let [own, deep] = [&cut, &whole].map(|first| wall(&UnworkedTooth::of(first, &[DENTINE]), -0.4));
            assert!((own - deep).abs() < 0.005, "{spacing}, dentine: {own} and {deep}");
            // Over a floor, enamel is as thick as it is.
            let floor = Volume::from_distance(grid, 1.5 * spacing, |p| (block(p).max(p.z - 0.4), label(p)));
            let [thin_layer, cut_down] = [&floor, &whole].map(|first| {
                let unworked = UnworkedTooth::of(first, &[DENTINE]);
                let colours = SurfaceColours::new(&tooth(&floor, &palette, &unworked));
                colours.at(grid.from_tooth(Vec3::new(0.5, 0.5, 0.4))).colour[2]
            });
            assert!((thin_layer - cut_down).abs() < 0.01, "{spacing}, over a floor: {thin_layer} and {cut_down}");
        }
    }

    #[test]
    fn cut_tissue_is_dull_and_the_tooth_s_own_surface_is_not() {
        // Aim: gloss tells a cut from what nobody touched. Method: a block of enamel of 4 mm with a pit of 1.5 mm in its top.
        let grid = Grid::centred([60, 60, 60], Vec3::splat(0.1));
        let block = |p: Vec3| (p.abs() - 2.0).max_element();
        let whole = Volume::from_distance(grid, 0.2, |p| (block(p), Label(1)));
        let pit = |p: Vec3| 1.5 - p.distance(Vec3::Z * 2.0);
        let cut = Volume::from_distance(grid, 0.2, |p| (block(p).max(pit(p)), Label(1)));
        let unworked = UnworkedTooth::of(&whole, &[DENTINE]);
        let palette = palette();
        let colours = SurfaceColours::new(&tooth(&cut, &palette, &unworked));
        let gloss = |p: Vec3| colours.at(grid.from_tooth(p)).gloss;
        assert!((gloss(Vec3::new(0.0, 0.0, 0.5)) - GROUND_GLOSS).abs() < 0.005, "{}", gloss(Vec3::new(0.0, 0.0, 0.5)));
        for own in [Vec3::new(1.9, 0.0, 2.0), Vec3::new(2.0, 0.3, -0.4), Vec3::new(-0.2, 2.0, 0.5)] {
            assert!((gloss(own) - 0.2).abs() < 0.01, "{own}: {}", gloss(own));
        }
    }
}
