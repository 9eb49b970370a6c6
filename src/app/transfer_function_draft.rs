//! The transfer function that the user draws, and the histogram it is drawn over.

use std::ops::RangeInclusive;
use std::sync::Arc;
use typodont_core::volume::{Density, Label, Volume};
use typodont_render::{LabelPalette, TransferFunction, TransferTable};

/// A transfer function drawn by the user, starting from a preset.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferFunctionDraft {
    pub function: Arc<TransferFunction>,
    /// Tissue to which the curve applies; air stands for all tissues.
    pub tissue: Label,
    /// The channels that are drawn together: red, green, blue and opacity.
    pub channels: [bool; 4],
    /// Density at which the keys draw.
    pub cursor: u8,
}

impl TransferFunctionDraft {
    pub fn new(function: TransferFunction) -> TransferFunctionDraft {
        let channels = [false, false, false, true];
        TransferFunctionDraft { function: Arc::new(function), tissue: Label::AIR, channels, cursor: 128 }
    }

    /// The draft with which the study's editor begins: y = x in all channels of all tissues, which shows a colourless tooth
    /// by its density. All channels are drawn together.
    pub fn straight_line(palette: &LabelPalette) -> TransferFunctionDraft {
        let preset = TransferFunctionDraft::new(TransferFunction::tissue(palette));
        let drawn = TransferFunctionDraft { channels: [true; 4], ..preset }.with_line([0, 0], [255, 255]);
        TransferFunctionDraft { cursor: 128, ..drawn }
    }

    /// The table that is drawn.
    pub fn table(&self) -> &TransferTable {
        self.function.table(self.tissue)
    }

    /// The same with a line drawn from one density and share to another, in all drawn channels.
    pub fn with_line(&self, from: [u8; 2], to: [u8; 2]) -> TransferFunctionDraft {
        let [low, high] = if from[0] <= to[0] { [from, to] } else { [to, from] };
        let span = f32::from(high[0] - low[0]).max(1.0);
        let value = |density: u8| {
            let share = f32::from(density - low[0]) / span;
            let rise = f32::from(high[1]) - f32::from(low[1]);
            (f32::from(low[1]) + share * rise).round() as u8
        };
        TransferFunctionDraft { cursor: to[0], ..self.with_values(low[0]..=high[0], |density, _| value(density)) }
    }

    /// The same with new values of all drawn channels at some densities; `value` is given the density and the channel.
    pub fn with_values(&self, densities: RangeInclusive<u8>, value: impl Fn(u8, usize) -> u8) -> TransferFunctionDraft {
        let draw = |table: &TransferTable| {
            let mut table = *table;
            for density in densities.clone() {
                let entry = &mut table[usize::from(density)];
                for (channel, own) in entry.iter_mut().enumerate().filter(|(channel, _)| self.channels[*channel]) {
                    *own = value(density, channel);
                }
            }
            table
        };
        let labels = if self.tissue == Label::AIR { 0..=255 } else { self.tissue.0..=self.tissue.0 };
        let function = self.function.with_changed_tables(labels.map(Label), draw);
        TransferFunctionDraft { function: Arc::new(function), ..self.clone() }
    }
}

/// Number of voxels of each density or grey value, by label.
pub struct DensityHistogram {
    counts: Vec<[u32; 256]>,
    /// The same for voxels that are full of matter.
    full: Vec<[u32; 256]>,
}

impl DensityHistogram {
    /// Counts everything but air. `matter`: the densities, where `volume` holds grey values.
    pub fn new(volume: &Volume, matter: &Volume) -> DensityHistogram {
        let [mut counts, mut full] = [vec![[0; 256]; 256], vec![[0; 256]; 256]];
        for ((density, label), filled) in volume.densities().iter().zip(volume.labels()).zip(matter.densities()) {
            let (row, column) = (usize::from(label.0), usize::from(density.bits()));
            counts[row][column] += u32::from(density.bits() > 0);
            full[row][column] += u32::from(*filled == Density::FULL);
        }
        DensityHistogram { counts, full }
    }

    /// Heights from 0 to 1 of a tissue, or of all for air. Logarithms: borders are few beside what they enclose.
    pub fn heights(&self, tissue: Label) -> [f32; 256] {
        let count = |density: usize| match tissue {
            Label::AIR => self.counts.iter().map(|counts| counts[density]).sum(),
            tissue => self.counts[usize::from(tissue.0)][density],
        };
        let logs: [f32; 256] = std::array::from_fn(|d| libm::log1pf(count(d) as f32));
        let most = logs.iter().fold(1.0, |most: f32, &log| most.max(log));
        logs.map(|log| log / most)
    }

    /// The value that most full voxels of each tissue have, smoothed over neighbouring values, in the order of the labels; tissues
    /// without full voxels have none.
    pub fn peaks(&self) -> Vec<TissuePeak> {
        /// Values on either side that are added up: the noise of a scan spreads a tissue over tens of values.
        const REACH: usize = 4;
        let peak = |(label, counts): (usize, &[u32; 256])| {
            let around = |value: usize| -> u32 {
                counts[value.saturating_sub(REACH)..(value + REACH + 1).min(256)].iter().sum()
            };
            let most = (0..256).map(around).max().filter(|most| *most > 0)?;
            // The middle of the values that are equally frequent.
            let best: Vec<usize> = (0..256).filter(|&value| around(value) == most).collect();
            let value = best[best.len() / 2];
            let value = if counts[255] == most { 255 } else { value };
            Some(TissuePeak { tissue: Label(label as u8), density: value as u8 })
        };
        self.full.iter().enumerate().filter_map(peak).collect()
    }
}

/// Peak of a tissue in the histogram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TissuePeak {
    pub tissue: Label,
    pub density: u8,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_drawn_into_all_channels_that_are_switched_on() {
        // Aim: several channels are drawn by one stroke, and those switched off stay. Method: from y = x, red and green off.
        let palette = LabelPalette::from_colours(|_| [0.5; 3], 0.1);
        let first = TransferFunctionDraft::straight_line(&palette);
        for label in [0, 1, 255] {
            let table = first.function.table(Label(label));
            assert!((0..256).all(|density| table[density] == [density as u8; 4]), "label {label}");
        }
        let blue_and_opacity = TransferFunctionDraft { channels: [false, false, true, true], ..first.clone() };
        let drawn = blue_and_opacity.with_line([100, 20], [200, 20]);
        assert_eq!([99, 150, 201].map(|density| drawn.table()[density]), [[99; 4], [150, 150, 20, 20], [201; 4]]);
        let none = TransferFunctionDraft { channels: [false; 4], ..first.clone() };
        assert_eq!(none.with_line([0, 9], [255, 9]).function.table(Label(1)), first.function.table(Label(1)));
    }
}
