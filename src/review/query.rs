//! Filter, sort order and page of the session list, as query parameters.

use super::http::first_value;

/// Maximum length of a search text, exercise id or folder, characters. Longer text is truncated.
const SEARCH_MAX: usize = 200;

/// Selectable page lengths; the first is the default.
pub const PAGE_LENGTHS: [usize; 3] = [50, 200, 2000];

/// Query of the session list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Query {
    /// Exercise id; empty for all.
    pub exercise: String,
    /// Folder that contains the bundle, such as a class or year; `None` for all.
    pub folder: Option<String>,
    /// Text that title, id, code or participant must contain.
    pub text: String,
    pub result: Option<ResultFilter>,
    /// Restricts the list to sessions with or without overrides.
    pub overridden: Option<bool>,
    /// Relation of the result to its recording.
    pub verification: Option<VerificationFilter>,
    pub sort: SortColumn,
    pub is_descending: bool,
    /// Page number, from 1.
    pub page: usize,
    pub length: usize,
}

/// Effective result to which the list is restricted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResultFilter {
    Passed,
    Failed,
    Ungraded,
}

impl ResultFilter {
    pub const ALL: [ResultFilter; 3] = [ResultFilter::Passed, ResultFilter::Failed, ResultFilter::Ungraded];

    pub fn name(self) -> &'static str {
        match self {
            ResultFilter::Passed => "passed",
            ResultFilter::Failed => "failed",
            ResultFilter::Ungraded => "ungraded",
        }
    }
}

/// Relation of the result to its recording to which the list is restricted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VerificationFilter {
    Verified,
    /// The recording is still to be replayed.
    Pending,
    Unverified,
    Differs,
}

impl VerificationFilter {
    pub const ALL: [VerificationFilter; 4] = [
        VerificationFilter::Verified,
        VerificationFilter::Pending,
        VerificationFilter::Unverified,
        VerificationFilter::Differs,
    ];

    pub fn name(self) -> &'static str {
        match self {
            VerificationFilter::Verified => "verified",
            VerificationFilter::Pending => "pending",
            VerificationFilter::Unverified => "unverified",
            VerificationFilter::Differs => "differs",
        }
    }
}

/// Column by which the list is sorted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SortColumn {
    Exercise,
    Participant,
    Began,
    Machine,
    MachineResult,
    Examiner,
    Result,
    Overrides,
}

impl SortColumn {
    pub const ALL: [SortColumn; 8] = [
        SortColumn::Exercise,
        SortColumn::Participant,
        SortColumn::Began,
        SortColumn::Machine,
        SortColumn::MachineResult,
        SortColumn::Examiner,
        SortColumn::Result,
        SortColumn::Overrides,
    ];

    pub fn name(self) -> &'static str {
        match self {
            SortColumn::Exercise => "exercise",
            SortColumn::Participant => "participant",
            SortColumn::Began => "began",
            SortColumn::Machine => "machine",
            SortColumn::MachineResult => "machine_result",
            SortColumn::Examiner => "examiner",
            SortColumn::Result => "result",
            SortColumn::Overrides => "overrides",
        }
    }

    /// Returns true if the column shows marks or judgements.
    pub fn shows_marks(self) -> bool {
        !matches!(self, SortColumn::Exercise | SortColumn::Participant | SortColumn::Began)
    }

    pub fn is_number(self) -> bool {
        matches!(self, SortColumn::Machine | SortColumn::Examiner | SortColumn::Overrides)
    }
}

impl Query {
    /// Parses query parameters. Unknown and invalid ones are replaced by their defaults, so an incomplete address
    /// still shows a list.
    pub fn parse(pairs: &[(String, String)]) -> Query {
        let text = |name: &str| first_value(pairs, name).chars().take(SEARCH_MAX).collect::<String>();
        let length =
            first_value(pairs, "length").parse().ok().filter(|l| PAGE_LENGTHS.contains(l)).unwrap_or(PAGE_LENGTHS[0]);
        let folder = pairs.iter().any(|(name, value)| name == "folder" && value != "*").then(|| text("folder"));
        Query {
            exercise: text("exercise"),
            folder,
            text: text("text").trim().to_string(),
            result: ResultFilter::ALL.into_iter().find(|o| o.name() == first_value(pairs, "result")),
            overridden: match first_value(pairs, "overridden") {
                "yes" => Some(true),
                "no" => Some(false),
                _ => None,
            },
            verification: VerificationFilter::ALL
                .into_iter()
                .find(|status| status.name() == first_value(pairs, "verification")),
            sort: SortColumn::ALL
                .into_iter()
                .find(|s| s.name() == first_value(pairs, "sort"))
                .unwrap_or(SortColumn::Exercise),
            is_descending: first_value(pairs, "down") == "yes",
            page: first_value(pairs, "page").parse().unwrap_or(1).clamp(1, 1_000_000),
            length,
        }
    }

    /// Returns the query without conditions on marks and without an order by them.
    pub fn without_marks(self) -> Query {
        let sort = if self.sort.shows_marks() { SortColumn::Exercise } else { self.sort };
        Query { result: None, overridden: None, sort, ..self }
    }

    /// Formats the query string of an address, without parameters that have their default value.
    pub fn to_query_string(&self) -> String {
        let mut out = url::form_urlencoded::Serializer::new(String::new());
        let mut append_unless_default = |name: &str, value: &str, usual: &str| {
            if value != usual {
                out.append_pair(name, value);
            }
        };
        append_unless_default("text", &self.text, "");
        append_unless_default("exercise", &self.exercise, "");
        append_unless_default("folder", self.folder.as_deref().unwrap_or("*"), "*");
        append_unless_default("result", self.result.map_or("", ResultFilter::name), "");
        append_unless_default("overridden", self.overridden.map_or("", |yes| if yes { "yes" } else { "no" }), "");
        append_unless_default("verification", self.verification.map_or("", VerificationFilter::name), "");
        append_unless_default("sort", self.sort.name(), SortColumn::Exercise.name());
        append_unless_default("down", if self.is_descending { "yes" } else { "" }, "");
        append_unless_default("length", &self.length.to_string(), &PAGE_LENGTHS[0].to_string());
        append_unless_default("page", &self.page.to_string(), "1");
        out.finish()
    }

    /// Returns the query for the first page sorted by a column, in reverse order if the list is already sorted by it.
    pub fn sorted_by(&self, sort: SortColumn) -> Query {
        let down = if self.sort == sort { !self.is_descending } else { sort.is_number() };
        Query { sort, is_descending: down, page: 1, ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_query_survives_a_round_trip_through_its_address() {
        let parse =
            |text: &str| Query::parse(&url::form_urlencoded::parse(text.as_bytes()).into_owned().collect::<Vec<_>>());
        let default = parse("");
        assert_eq!(default.to_query_string(), "");
        let full = parse(
            "text=%27%3B+DROP+TABLE&exercise=5&folder=&result=failed&overridden=yes&verification=differs&sort=machine&down=yes&length=200&page=3",
        );
        assert_eq!((full.text.as_str(), full.folder.as_deref(), full.page), ("'; DROP TABLE", Some(""), 3));
        assert_eq!(parse(&full.to_query_string()), full);
        assert_eq!(parse("sort=id;--&page=-1&length=7&result=x"), default);
        assert!(full.sorted_by(SortColumn::Machine).page == 1 && !full.sorted_by(SortColumn::Machine).is_descending);
    }
}
