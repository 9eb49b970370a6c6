//! Names and texts without the differences that people do not mean.

use std::collections::BTreeMap;

/// Folds a text for searching: lower case, without distinguishing the dotted and dotless i of Turkish.
pub fn fold_case(text: &str) -> String {
    let lower = text.chars().flat_map(char::to_lowercase);
    lower.filter(|c| *c != '\u{307}').map(|c| if c == 'ı' { 'i' } else { c }).collect()
}

/// Identity of an examiner: the name without regard to case and repeated spaces.
pub fn examiner_key(name: &str) -> String {
    fold_case(&name.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// The spelling in which each examiner's name was met first, so that one examiner is one rater.
#[derive(Debug, Default)]
pub struct ExaminerNames(BTreeMap<String, String>);

impl ExaminerNames {
    /// The first spelling of a name.
    pub fn first_spelling(&mut self, name: &str) -> String {
        self.0.entry(examiner_key(name)).or_insert_with(|| name.to_string()).clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spellings_of_a_name_are_one() {
        assert_eq!(fold_case("ISPARTA İzmir ığdır"), "isparta izmir iğdir");
        assert_eq!(examiner_key(" Dr.  Öz "), examiner_key("dr. öz"));
    }
}
