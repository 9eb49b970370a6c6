//! Spells of contact: the instrument's uninterrupted contact with one tissue.

use std::collections::BTreeMap;
use typodont_core::frame::Vec3;
use typodont_core::tick::Tick;
use typodont_core::volume::Label;

/// Time without contact after which the next contact is a spell of its own, ticks. A rotating bur loses and regains
/// contact many times within a tenth of a second; a hand needs about a quarter of a second to lift and return.
const GAP_TICKS: u64 = 250;

/// Contact with one tissue in one period of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSpell {
    pub tissue: Label,
    /// First and last tick of contact.
    pub span: [Tick; 2],
    /// Number of ticks in contact.
    pub ticks: u64,
    /// Maximum force while this tissue was touched, N.
    pub force: f32,
    /// Tick of the maximum force.
    pub peak: Tick,
    /// Position of the tip at the maximum force, tooth space, mm.
    pub place: Vec3,
}

/// Collects spells of contact, tick by tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactSpells {
    /// The last spell of each tissue.
    open: BTreeMap<u8, ContactSpell>,
    closed: Vec<ContactSpell>,
}

impl ContactSpells {
    /// Adds a tick in which a tissue was touched with a force (N) at a position of the tip (tooth space, mm).
    pub fn add(&mut self, tissue: Label, tick: Tick, force: f32, place: Vec3) {
        let begun = ContactSpell { tissue, span: [tick, tick], ticks: 1, force, peak: tick, place };
        let spell = self.open.entry(tissue.0).or_insert(ContactSpell { ticks: 0, ..begun });
        if tick.0 - spell.span[1].0 > GAP_TICKS {
            self.closed.push(std::mem::replace(spell, begun));
            return;
        }
        spell.span[1] = tick;
        spell.ticks += 1;
        if force > spell.force {
            (spell.force, spell.peak, spell.place) = (force, tick, place);
        }
    }

    /// Returns all spells in the order in which they began.
    pub fn finish(self) -> Vec<ContactSpell> {
        let mut all = self.closed;
        all.extend(self.open.into_values());
        all.sort_by_key(|spell| (spell.span[0], spell.tissue.0));
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spell_has_one_tissue_its_own_force_and_its_own_time() {
        // Aim: the force on caries is not told of the adjacent tooth. Regression: the tissue at the greatest force was
        // named for a period of two seconds, of which it had been touched for a tenth.
        let (caries, neighbour) = (Label(4), Label(7));
        let mut spells = ContactSpells::default();
        for tick in 1000..2000 {
            let (tissue, force) = if (1500..1600).contains(&tick) { (neighbour, 1.0) } else { (caries, 3.0) };
            spells.add(tissue, Tick(tick), force, Vec3::splat(tick as f32));
        }
        spells.add(caries, Tick(2250), 2.0, Vec3::ZERO);
        let found: Vec<_> = spells.finish().iter().map(|s| (s.tissue, s.span, s.ticks, s.force, s.peak)).collect();
        let spell = |tissue, from, to, ticks, force, peak| (tissue, [Tick(from), Tick(to)], ticks, force, Tick(peak));
        assert_eq!(
            found,
            [
                spell(caries, 1000, 1999, 900, 3.0, 1000),
                spell(neighbour, 1500, 1599, 100, 1.0, 1500),
                spell(caries, 2250, 2250, 1, 2.0, 2250),
            ]
        );
    }
}
