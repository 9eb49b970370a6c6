//! Colour and opacity by density: what turns a volume into a picture of its inside.

use super::scene::{Palette, Rgb};
use crate::volume::Label;
use std::collections::BTreeMap;

/// Colour and opacity for each of 256 densities: red, green, blue, alpha.
pub type Table = [[u8; 4]; 256];

/// Tables by label. A label without one of its own uses the first.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferFunction {
    tables: Vec<Table>,
    /// Which table a label uses.
    of_label: [u8; 256],
    /// The way through matter after which a table's opacity is reached, mm. 0.05 to 1.
    pub unit: f32,
    /// Share of the colour that lamps shade, 0 to 1: an X-ray has none.
    pub light: f32,
}

/// The way after which the presets' opacities hold, mm: about a voxel of a usual tooth.
const UNIT: f32 = 0.15;

impl TransferFunction {
    /// One table for all labels.
    pub fn plain(table: Table, unit: f32, light: f32) -> TransferFunction {
        TransferFunction { tables: vec![table], of_label: [0; 256], unit, light }
    }

    /// Gives labels a table of their own.
    ///
    /// # Panics
    /// Beyond 255 tables of their own: there are no more labels.
    pub fn with(mut self, labels: impl IntoIterator<Item = Label>, table: Table) -> TransferFunction {
        let own = u8::try_from(self.tables.len()).expect("fewer tables than labels");
        self.tables.push(table);
        labels.into_iter().for_each(|label| self.of_label[usize::from(label.0)] = own);
        self
    }

    /// The same with the tables of some labels changed; tables that labels share are changed once and stay shared.
    pub fn changed(
        &self,
        labels: impl IntoIterator<Item = Label>,
        change: impl Fn(&Table) -> Table,
    ) -> TransferFunction {
        let mut changed = TransferFunction { tables: Vec::new(), of_label: [0; 256], ..*self };
        let mut is_changed = [false; 256];
        labels.into_iter().for_each(|label| is_changed[usize::from(label.0)] = true);
        // Which new table stands for an old one, as it was and as it is changed.
        let mut known: BTreeMap<(u8, bool), u8> = BTreeMap::new();
        for ((own, &old), is_changed) in changed.of_label.iter_mut().zip(&self.of_label).zip(is_changed) {
            *own = *known.entry((old, is_changed)).or_insert_with(|| {
                let table = &self.tables[usize::from(old)];
                changed.tables.push(if is_changed { change(table) } else { *table });
                (changed.tables.len() - 1) as u8
            });
        }
        changed
    }

    pub fn table(&self, label: Label) -> &Table {
        &self.tables[usize::from(self.of_label[usize::from(label.0)])]
    }

    /// The tables with each opacity as it is after one step of a length, one row per label.
    ///
    /// Behind a length d of matter that lets a share T per unit u through, T^(d/u) is left (Beer's law), so a step's opacity
    /// is 1 - (1 - alpha)^(step/unit); see e.g. Engel et al., *Real-Time Volume Graphics* (2006), chapter 1.
    pub(super) fn stepped(&self, step: f32) -> Vec<Table> {
        let power = step / self.unit;
        let alpha = |a: u8| 1.0 - libm::powf(1.0 - f32::from(a) / 255.0, power);
        let entry = |[r, g, b, a]: [u8; 4]| [r, g, b, (alpha(a) * 255.0 + 0.5) as u8];
        let tables: Vec<Table> = self.tables.iter().map(|table| table.map(entry)).collect();
        self.of_label.iter().map(|&t| tables[usize::from(t)]).collect()
    }

    /// Half-clear tissue in its own colours: the pulp is seen through dentine and enamel.
    pub fn tissue(palette: &Palette) -> TransferFunction {
        let faint = table([0.8, 0.8, 0.8], |d| 0.10 * ramp(d, 0.35, 0.9));
        let tissue = |label: Label| {
            let colour = palette.finish(label).colour;
            // What is redder or darker than enamel is the more opaque: pulp and decay show through it.
            let depth = (1.0 - colour[2]).clamp(0.0, 1.0);
            table(colour, |d| (0.04 + 0.5 * depth * depth) * ramp(d, 0.35, 0.8))
        };
        let all = (1..=255).map(Label).filter(|l| palette.finish(*l).colour != palette.finish(Label::AIR).colour);
        all.fold(TransferFunction::plain(faint, UNIT, 0.45), |made, label| made.with([label], tissue(label)))
    }

    /// As on a film: what is denser is whiter, nothing is lit.
    pub fn x_ray() -> TransferFunction {
        TransferFunction::plain(table([0.92, 0.96, 1.0], |d| 0.035 * d * d), UNIT, 0.0)
    }

    /// The labels of decay in their colour, all else like glass.
    pub fn only(labels: &[Label], palette: &Palette) -> TransferFunction {
        let glass = table([0.75, 0.82, 0.88], |d| 0.006 * ramp(d, 0.4, 0.9));
        let own = |made: TransferFunction, &label: &Label| {
            made.with([label], table(palette.finish(label).colour, |d| 0.8 * ramp(d, 0.3, 0.7)))
        };
        labels.iter().fold(TransferFunction::plain(glass, UNIT, 0.6), own)
    }
}

/// A table of one colour with an opacity (0–1) by density (0–1).
pub fn table(colour: Rgb, opacity: impl Fn(f32) -> f32) -> Table {
    let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let [r, g, b] = colour.map(byte);
    std::array::from_fn(|d| [r, g, b, byte(opacity(d as f32 / 255.0))])
}

/// Rises from 0 to 1 between two densities.
fn ramp(density: f32, from: f32, to: f32) -> f32 {
    ((density - from) / (to - from)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_half_steps_are_as_opaque_as_a_whole_one() {
        // Aim: finer steps do not make matter denser. Method: compose two half steps, for every opacity.
        let made = TransferFunction::plain(std::array::from_fn(|d| [255, 255, 255, d as u8]), 0.2, 0.0);
        let (whole, half) = (made.stepped(0.2), made.stepped(0.1));
        for d in 0..256 {
            let clear = 1.0 - f32::from(half[0][d][3]) / 255.0;
            let both = 1.0 - clear * clear;
            assert!((both - f32::from(whole[0][d][3]) / 255.0).abs() < 1.5 / 255.0, "{d}: {both}");
        }
    }

    #[test]
    fn labels_of_their_own_differ_and_others_share_the_first() {
        let palette = Palette::of(|label| [f32::from(label.0) / 255.0; 3], 0.1);
        let made = TransferFunction::only(&[Label(4)], &palette);
        assert!(made.table(Label(4))[255][3] > 20 * made.table(Label(1))[255][3]);
        assert_eq!(made.table(Label(1)), made.table(Label(200)));
    }
}
