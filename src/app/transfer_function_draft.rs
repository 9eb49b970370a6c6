//! The transfer function that the user draws, and the histogram it is drawn over.

use std::sync::Arc;
use typodont_core::volume::{Label, Volume};
use typodont_render::{TransferFunction, TransferTable};

/// A transfer function drawn by the user, starting from a preset.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferFunctionDraft {
    pub function: Arc<TransferFunction>,
    /// Tissue to which the curve applies; air stands for all tissues.
    pub tissue: Label,
    /// The channels that are drawn, by their place in a table's entries: red, green, blue, alpha.
    pub channels: [bool; 4],
    /// Density at which the keys draw.
    pub cursor: u8,
}

impl TransferFunctionDraft {
    pub fn new(function: TransferFunction) -> TransferFunctionDraft {
        TransferFunctionDraft {
            function: Arc::new(function),
            tissue: Label::AIR,
            channels: [false, false, false, true],
            cursor: 128,
        }
    }

    /// The first of the channels that are drawn; `None` if all are switched off.
    pub fn first_channel(&self) -> Option<usize> {
        self.channels.iter().position(|is_drawn| *is_drawn)
    }

    /// The table that is drawn.
    pub fn table(&self) -> &TransferTable {
        self.function.table(self.tissue)
    }

    /// The same with a line drawn from one density and share to another, in every channel that is switched on.
    pub fn with_line(&self, from: [u8; 2], to: [u8; 2]) -> TransferFunctionDraft {
        let [low, high] = if from[0] <= to[0] { [from, to] } else { [to, from] };
        let span = f32::from(high[0] - low[0]).max(1.0);
        let value = |density: u8| {
            let share = f32::from(density - low[0]) / span;
            let rise = f32::from(high[1]) - f32::from(low[1]);
            (f32::from(low[1]) + share * rise).round() as u8
        };
        let draw = |table: &TransferTable| {
            let mut table = *table;
            for density in low[0]..=high[0] {
                let drawn = table[usize::from(density)].iter_mut().zip(self.channels).filter(|(_, is_drawn)| *is_drawn);
                drawn.for_each(|(entry, _)| *entry = value(density));
            }
            table
        };
        let labels = if self.tissue == Label::AIR { 0..=255 } else { self.tissue.0..=self.tissue.0 };
        let function = self.function.with_changed_tables(labels.map(Label), draw);
        TransferFunctionDraft { function: Arc::new(function), cursor: to[0], ..self.clone() }
    }
}

/// Number of voxels of each density, by label.
pub struct DensityHistogram(Vec<[u32; 256]>);

impl DensityHistogram {
    /// Counts everything but air.
    pub fn new(volume: &Volume) -> DensityHistogram {
        let mut counts = vec![[0; 256]; 256];
        for (density, label) in volume.densities().iter().zip(volume.labels()) {
            counts[usize::from(label.0)][usize::from(density.bits())] += u32::from(density.bits() > 0);
        }
        DensityHistogram(counts)
    }

    /// Heights from 0 to 1 of a tissue, or of all for air. Logarithms: borders are few beside what they enclose.
    pub fn heights(&self, tissue: Label) -> [f32; 256] {
        let count = |density: usize| match tissue {
            Label::AIR => self.0.iter().map(|counts| counts[density]).sum(),
            tissue => self.0[usize::from(tissue.0)][density],
        };
        let logs: [f32; 256] = std::array::from_fn(|d| libm::log1pf(count(d) as f32));
        let most = logs.iter().fold(1.0, |most: f32, &log| most.max(log));
        logs.map(|log| log / most)
    }
}
