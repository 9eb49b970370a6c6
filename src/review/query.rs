//! What of the list is to be seen, and in which order.

use super::exchange::value;

/// Letters of a search, an exercise's id, a folder: longer than any that is read.
const SEARCH_MAX: usize = 200;

/// Lines of a page that may be chosen; the first is taken unless told otherwise.
pub const LENGTHS: [usize; 3] = [50, 200, 2000];

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Query {
    pub exercise: String,
    /// The folder in which a bundle lies: a class, a year.
    pub folder: Option<String>,
    /// Must stand in title, participant or id.
    pub text: String,
    pub result: Option<Outcome>,
    pub overridden: Option<bool>,
    pub sort: Sort,
    pub down: bool,
    /// From 1.
    pub page: usize,
    pub length: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    Passed,
    Failed,
    Ungraded,
}

impl Outcome {
    pub const ALL: [Outcome; 3] = [Outcome::Passed, Outcome::Failed, Outcome::Ungraded];

    pub fn name(self) -> &'static str {
        match self {
            Outcome::Passed => "passed",
            Outcome::Failed => "failed",
            Outcome::Ungraded => "ungraded",
        }
    }
}

/// A column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sort {
    Exercise,
    Participant,
    Began,
    Machine,
    MachineResult,
    Examiner,
    Result,
    Overrides,
}

impl Sort {
    pub const ALL: [Sort; 8] = [
        Sort::Exercise,
        Sort::Participant,
        Sort::Began,
        Sort::Machine,
        Sort::MachineResult,
        Sort::Examiner,
        Sort::Result,
        Sort::Overrides,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Sort::Exercise => "exercise",
            Sort::Participant => "participant",
            Sort::Began => "began",
            Sort::Machine => "machine",
            Sort::MachineResult => "machine_result",
            Sort::Examiner => "examiner",
            Sort::Result => "result",
            Sort::Overrides => "overrides",
        }
    }

    pub fn is_number(self) -> bool {
        matches!(self, Sort::Machine | Sort::Examiner | Sort::Overrides)
    }
}

impl Query {
    /// What nobody knows is passed over: an address that was shortened still leads to a list.
    pub fn of(asked: &[(String, String)]) -> Query {
        let text = |name: &str| value(asked, name).chars().take(SEARCH_MAX).collect::<String>();
        let length = value(asked, "length").parse().ok().filter(|l| LENGTHS.contains(l)).unwrap_or(LENGTHS[0]);
        let folder = asked.iter().any(|(name, value)| name == "folder" && value != "*").then(|| text("folder"));
        Query {
            exercise: text("exercise"),
            folder,
            text: text("text").trim().to_string(),
            result: Outcome::ALL.into_iter().find(|o| o.name() == value(asked, "result")),
            overridden: match value(asked, "overridden") {
                "yes" => Some(true),
                "no" => Some(false),
                _ => None,
            },
            sort: Sort::ALL.into_iter().find(|s| s.name() == value(asked, "sort")).unwrap_or(Sort::Exercise),
            down: value(asked, "down") == "yes",
            page: value(asked, "page").parse().unwrap_or(1).clamp(1, 1_000_000),
            length,
        }
    }

    /// The address's query that asks for it.
    pub fn written(&self) -> String {
        let mut out = url::form_urlencoded::Serializer::new(String::new());
        let mut say = |name: &str, value: &str, usual: &str| {
            if value != usual {
                out.append_pair(name, value);
            }
        };
        say("text", &self.text, "");
        say("exercise", &self.exercise, "");
        say("folder", self.folder.as_deref().unwrap_or("*"), "*");
        say("result", self.result.map_or("", Outcome::name), "");
        say("overridden", self.overridden.map_or("", |yes| if yes { "yes" } else { "no" }), "");
        say("sort", self.sort.name(), Sort::Exercise.name());
        say("down", if self.down { "yes" } else { "" }, "");
        say("length", &self.length.to_string(), &LENGTHS[0].to_string());
        say("page", &self.page.to_string(), "1");
        out.finish()
    }

    /// The first page of the same, in the order of a column: the other way around where it is ordered so already.
    pub fn by(&self, sort: Sort) -> Query {
        let down = if self.sort == sort { !self.down } else { sort.is_number() };
        Query { sort, down, page: 1, ..self.clone() }
    }
}

/// A text as it is searched for: without regard to case, and to the dots on which Turkish and English disagree.
pub fn folded(text: &str) -> String {
    let lower = text.chars().flat_map(char::to_lowercase);
    lower.filter(|c| *c != '\u{307}').map(|c| if c == 'ı' { 'i' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_query_is_what_its_address_says() {
        let asked =
            |text: &str| Query::of(&url::form_urlencoded::parse(text.as_bytes()).into_owned().collect::<Vec<_>>());
        let usual = asked("");
        assert_eq!(usual.written(), "");
        let full = asked(
            "text=%27%3B+DROP+TABLE&exercise=5&folder=&result=failed&overridden=yes&sort=machine&down=yes&length=200&page=3",
        );
        assert_eq!((full.text.as_str(), full.folder.as_deref(), full.page), ("'; DROP TABLE", Some(""), 3));
        assert_eq!(asked(&full.written()), full);
        assert_eq!(asked("sort=id;--&page=-1&length=7&result=x"), usual);
        assert!(full.by(Sort::Machine).page == 1 && !full.by(Sort::Machine).down);
    }

    #[test]
    fn letters_are_found_whatever_their_case() {
        assert_eq!(folded("ISPARTA İzmir ığdır"), "isparta izmir iğdir");
    }
}
