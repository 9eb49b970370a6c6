//! Transfer functions: colour and opacity by density, for pictures of a volume's inside.

use super::scene::{LabelPalette, Rgb};
use std::collections::BTreeMap;
use typodont_core::volume::Label;

/// Colour and opacity for each of 256 densities: red, green, blue, alpha.
pub type TransferTable = [[u8; 4]; 256];

/// Tables by label. A label without one of its own uses the first.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferFunction {
    tables: Vec<TransferTable>,
    /// Index of the table that each label uses.
    table_of_label: [u8; 256],
    /// Path length through matter after which a table's opacity is reached, mm, 0.05 to 1.
    pub opacity_unit: f32,
    /// Share of the colour that lamps shade, 0 to 1: 0 for an X-ray.
    pub shading: f32,
    /// True for a radiograph: the tables hold attenuation instead of colours, in red and green, and rays add it up.
    pub(super) is_radiograph: bool,
}

/// Attenuation of the highest value of a radiograph's table, per mm, in 65535 parts: more than that of amalgam.
pub(super) const MOST_ATTENUATION: f32 = 20.0;

/// The way after which the presets' opacities hold, mm: about a voxel of a usual tooth.
const DEFAULT_OPACITY_UNIT: f32 = 0.15;

impl TransferFunction {
    /// One table for all labels.
    pub fn single_table(table: TransferTable, opacity_unit: f32, shading: f32) -> TransferFunction {
        TransferFunction { tables: vec![table], table_of_label: [0; 256], opacity_unit, shading, is_radiograph: false }
    }

    /// Gives labels a table of their own.
    ///
    /// # Panics
    ///
    /// If more than 255 tables are added: there are no more labels.
    pub fn with_table(mut self, labels: impl IntoIterator<Item = Label>, table: TransferTable) -> TransferFunction {
        let own = u8::try_from(self.tables.len()).expect("fewer tables than labels");
        self.tables.push(table);
        labels.into_iter().for_each(|label| self.table_of_label[usize::from(label.0)] = own);
        self
    }

    /// The same with the tables of some labels changed; tables that labels share are changed once and stay shared.
    pub fn with_changed_tables(
        &self,
        labels: impl IntoIterator<Item = Label>,
        change: impl Fn(&TransferTable) -> TransferTable,
    ) -> TransferFunction {
        let mut changed = TransferFunction { tables: Vec::new(), table_of_label: [0; 256], ..*self };
        let mut is_changed = [false; 256];
        labels.into_iter().for_each(|label| is_changed[usize::from(label.0)] = true);
        // Index of the new table for each old one, unchanged and changed.
        let mut known: BTreeMap<(u8, bool), u8> = BTreeMap::new();
        for ((own, &old), is_changed) in changed.table_of_label.iter_mut().zip(&self.table_of_label).zip(is_changed) {
            *own = *known.entry((old, is_changed)).or_insert_with(|| {
                let table = &self.tables[usize::from(old)];
                changed.tables.push(if is_changed { change(table) } else { *table });
                (changed.tables.len() - 1) as u8
            });
        }
        changed
    }

    /// The same, but one label has what it had at full density from this density on, and the rest in proportion.
    pub fn with_full_at(&self, label: Label, full: u8) -> TransferFunction {
        let source = |density: usize| (density * 255 / usize::from(full.max(1))).min(255);
        self.with_changed_tables([label], |table| std::array::from_fn(|density| table[source(density)]))
    }

    pub fn table(&self, label: Label) -> &TransferTable {
        &self.tables[usize::from(self.table_of_label[usize::from(label.0)])]
    }

    /// The tables with each opacity as it is after one step of a length, one row per label.
    ///
    /// Behind a length d of matter that lets a share T per unit u through, T^(d/u) is left (Beer's law), so a step's opacity
    /// is 1 - (1 - alpha)^(step/unit); see e.g. Engel et al., *Real-Time Volume Graphics* (2006), chapter 1.
    pub(super) fn per_step(&self, step: f32) -> Vec<TransferTable> {
        let power = step / self.opacity_unit;
        let alpha = |a: u8| 1.0 - libm::powf(1.0 - f32::from(a) / 255.0, power);
        let entry = |[r, g, b, a]: [u8; 4]| [r, g, b, (alpha(a) * 255.0 + 0.5) as u8];
        let tables: Vec<TransferTable> = self.tables.iter().map(|table| table.map(entry)).collect();
        self.table_of_label.iter().map(|&t| tables[usize::from(t)]).collect()
    }

    /// Returns, for each label, the first label that has the same table: where a tissue is to look like another, samples of
    /// both must not differ in the last bit either.
    pub(super) fn alike_labels(&self) -> [Label; 256] {
        let first = |label: u8| (0..=label).map(Label).find(|&other| self.table(other) == self.table(Label(label)));
        std::array::from_fn(|label| first(label as u8).unwrap_or(Label(label as u8)))
    }

    /// Translucent tissue in its own colours: the pulp is seen through dentine and enamel.
    pub fn tissue(palette: &LabelPalette) -> TransferFunction {
        let faint = table([0.8, 0.8, 0.8], |d| 0.10 * linear_ramp(d, 0.35, 0.9));
        let tissue = |label: Label| {
            let colour = palette.appearance(label).colour;
            // Tissue that is redder or darker than enamel is more opaque: pulp and decay show through enamel.
            let depth = (1.0 - colour[2]).clamp(0.0, 1.0);
            table(colour, |d| (0.04 + 0.5 * depth * depth) * linear_ramp(d, 0.35, 0.8))
        };
        let all =
            (1..=255).map(Label).filter(|l| palette.appearance(*l).colour != palette.appearance(Label::AIR).colour);
        all.fold(TransferFunction::single_table(faint, DEFAULT_OPACITY_UNIT, 0.45), |made, label| {
            made.with_table([label], tissue(label))
        })
    }

    /// A radiograph: the film is as bright as the line integral of the attenuation, per mm, of each label (Beer's law), in
    /// proportion to the density where a voxel is partly filled.
    pub fn radiograph(attenuation_per_mm: impl Fn(Label) -> f32) -> TransferFunction {
        let film = |label: Label| -> TransferTable {
            let full = (attenuation_per_mm(label) / MOST_ATTENUATION).clamp(0.0, 1.0) * 65535.0;
            std::array::from_fn(|density| {
                let value = (full * density as f32 / 255.0 + 0.5) as u16;
                let [high, low] = value.to_be_bytes();
                // What attenuates is not empty.
                [high, low, 0, if value > 0 { u8::MAX } else { 0 }]
            })
        };
        let mut made = TransferFunction::single_table(film(Label(0)), DEFAULT_OPACITY_UNIT, 0.0);
        made.is_radiograph = true;
        // Labels that attenuate alike share a table: there are fewer tables than labels.
        for label in (1..=255).map(Label) {
            let table = film(label);
            match made.tables.iter().position(|known| *known == table) {
                Some(known) => made.table_of_label[usize::from(label.0)] = known as u8,
                None => made = made.with_table([label], table),
            }
        }
        made
    }

    /// Denser tissue is whiter, without shading: a beginning for functions that are drawn by hand.
    pub fn x_ray() -> TransferFunction {
        TransferFunction::single_table(table([0.92, 0.96, 1.0], |d| 0.035 * d * d), DEFAULT_OPACITY_UNIT, 0.0)
    }

    /// The given labels in their colours, all others like glass.
    pub fn highlighting(labels: &[Label], palette: &LabelPalette) -> TransferFunction {
        let glass = table([0.75, 0.82, 0.88], |d| 0.006 * linear_ramp(d, 0.4, 0.9));
        let own = |made: TransferFunction, &label: &Label| {
            made.with_table([label], table(palette.appearance(label).colour, |d| 0.8 * linear_ramp(d, 0.3, 0.7)))
        };
        labels.iter().fold(TransferFunction::single_table(glass, DEFAULT_OPACITY_UNIT, 0.6), own)
    }
}

/// A table of one colour with an opacity (0–1) by density (0–1).
pub fn table(colour: Rgb, opacity: impl Fn(f32) -> f32) -> TransferTable {
    let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let [r, g, b] = colour.map(byte);
    std::array::from_fn(|d| [r, g, b, byte(opacity(d as f32 / 255.0))])
}

/// Rises from 0 to 1 between two densities.
fn linear_ramp(density: f32, from: f32, to: f32) -> f32 {
    ((density - from) / (to - from)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_half_steps_are_as_opaque_as_a_whole_one() {
        // Aim: finer steps do not make matter denser. Method: compose two half steps, for every opacity.
        let made = TransferFunction::single_table(std::array::from_fn(|d| [255, 255, 255, d as u8]), 0.2, 0.0);
        let (whole, half) = (made.per_step(0.2), made.per_step(0.1));
        for d in 0..256 {
            let clear = 1.0 - f32::from(half[0][d][3]) / 255.0;
            let both = 1.0 - clear * clear;
            assert!((both - f32::from(whole[0][d][3]) / 255.0).abs() < 1.5 / 255.0, "{d}: {both}");
        }
    }

    #[test]
    fn labels_of_their_own_differ_and_others_share_the_first() {
        let palette = LabelPalette::from_colours(|label| [f32::from(label.0) / 255.0; 3], 0.1);
        let made = TransferFunction::highlighting(&[Label(4)], &palette);
        assert!(made.table(Label(4))[255][3] > 20 * made.table(Label(1))[255][3]);
        assert_eq!(made.table(Label(1)), made.table(Label(200)));
    }
}
