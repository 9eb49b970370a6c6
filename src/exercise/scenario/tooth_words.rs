//! The English words for a tooth, and their replacement in an exercise's texts when another tooth takes its place.

use typodont_anatomy::teeth;

/// Names of the teeth of a quadrant from the midline outward, for lower and upper teeth alike.
const NAMES: [&str; 8] = [
    "central incisor",
    "lateral incisor",
    "canine",
    "first premolar",
    "second premolar",
    "first molar",
    "second molar",
    "third molar",
];

/// Replacement of the words for one tooth by those for another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Replacement {
    /// Former and new words, the longest first.
    pairs: Vec<[String; 2]>,
}

impl Replacement {
    /// Returns the replacement of the tooth `former` by the tooth `new` (FDI numbers); `None` if there is no such
    /// tooth.
    pub fn of(former: u8, new: u8) -> Option<Replacement> {
        let words = [ToothWords::of(former)?, ToothWords::of(new)?];
        let pair = |phrase: fn(&ToothWords) -> String| words.each_ref().map(phrase);
        let phrases: [fn(&ToothWords) -> String; 4] = [
            |w| format!("{} {} {}", w.jaw, w.side, w.name),
            |w| format!("{} {}", w.jaw, w.name),
            |w| format!("{} {}", w.jaw, w.class()),
            |w| w.name.to_string(),
        ];
        let mut pairs = Vec::new();
        for [from, to] in phrases.map(pair) {
            // With the indefinite article first: "a lower molar" becomes "an upper molar".
            pairs.push([from.as_str(), to.as_str()].map(|words| format!("{} {words}", article(words))));
            pairs.push([from, to]);
        }
        Some(Replacement { pairs })
    }

    /// Returns a text with the words replaced, capitalised where they were.
    pub fn apply(&self, text: &str) -> String {
        let mut changed = String::with_capacity(text.len());
        let mut rest = text;
        while let Some(first) = rest.chars().next() {
            let is_word_start = changed.chars().next_back().is_none_or(|c| !c.is_alphanumeric());
            let found = self.pairs.iter().filter(|_| is_word_start).find(|[from, _]| begins_with(rest, from));
            let length = match found {
                Some([from, to]) => {
                    let is_capital = first.is_uppercase();
                    let mut letters = to.chars();
                    let initial = letters.next().filter(|_| is_capital).map(|c| c.to_ascii_uppercase());
                    changed.push_str(&initial.map_or(to.clone(), |c| format!("{c}{}", letters.as_str())));
                    from.len()
                }
                None => {
                    changed.push(first);
                    first.len_utf8()
                }
            };
            rest = &rest[length..];
        }
        changed
    }
}

/// Returns true if a text begins with these words (ASCII), whatever their capitals, at a word's end.
fn begins_with(text: &str, words: &str) -> bool {
    let is_same = text.get(..words.len()).is_some_and(|start| start.eq_ignore_ascii_case(words));
    // A plural "s" may follow: "two lower molars".
    is_same && text[words.len()..].chars().next().is_none_or(|c| c == 's' || !c.is_alphanumeric())
}

fn article(words: &str) -> &'static str {
    if words.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" }
}

struct ToothWords {
    jaw: &'static str,
    side: &'static str,
    name: &'static str,
}

impl ToothWords {
    fn of(fdi: u8) -> Option<ToothWords> {
        teeth::tooth(fdi)?;
        let (jaw, side) = match fdi / 10 {
            1 => ("upper", "right"),
            2 => ("upper", "left"),
            3 => ("lower", "left"),
            _ => ("lower", "right"),
        };
        Some(ToothWords { jaw, side, name: NAMES.get(usize::from(fdi % 10).checked_sub(1)?)? })
    }

    /// Returns the kind of the tooth: incisor, canine, premolar or molar.
    fn class(&self) -> &'static str {
        self.name.rsplit(' ').next().unwrap_or(self.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_follow_the_tooth() {
        let canine = Replacement::of(36, 13).unwrap();
        let check = |text: &str, expected: &str| assert_eq!(canine.apply(text), expected);
        check("The lower left first molar has caries.", "The upper right canine has caries.");
        check("Lower left first molar: A lower molar has pockets.", "Upper right canine: An upper canine has pockets.");
        check("The first molar and two lower molars", "The canine and two upper canines");
        check("The lower left second molar, premolars, Kürette", "The lower left second molar, premolars, Kürette");
        let same = Replacement::of(36, 46).unwrap();
        assert_eq!(same.apply("a sound lower left first molar"), "a sound lower right first molar");
        assert_eq!(Replacement::of(36, 19), None);
    }
}
