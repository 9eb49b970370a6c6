//! Feedback in sentences: the causes of lost points and advice for the next attempt.
//!
//! Takes a session's grade, its measures, its error episodes ("lapses") and rules that a school may edit. Gives for
//! each rubric item that lost points the events with their place, time and force, the most costly item first. Every
//! sentence refers to the measure that it explains.

use super::SessionFile;
use super::display_format;
use super::language::{Message, MessageArgs, Texts, placeholders};
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeSet;
use typodont_core::tick::Tick;
use typodont_exercise::catalog::TissueTable;
use typodont_exercise::score::{AnatomicalDirection, EpisodeKind, ErrorEpisode};
use typodont_formats::diagnostic::{Diagnostic, SourceText, headlines};
use typodont_formats::json;

/// Most lapses described for one item of a rubric: a trainee does not remember more.
const LAPSES_PER_ITEM_MAX: usize = 2;

/// Smallest loss that is reported, points.
const LOST_POINTS_MIN: f64 = 0.05;

/// A lapse shorter than this is reported with one time instead of a span, s.
const SINGLE_MOMENT_S: f64 = 1.0;

/// Measure name of the rule that applies to every measure without a rule of its own.
const ANY_METRIC: &str = "*";

/// `feedback.json` as written.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct FeedbackRulesFile {
    /// Rules, in order. The first rule that names a measure applies to it.
    #[schemars(length(min = 1, max = 200))]
    rules: Vec<FeedbackRule>,
}

/// Feedback on one measure. Texts are given by language ("en" is required) and may contain names in braces.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct FeedbackRule {
    /// Measure that the rule explains, without its argument in brackets; "*" for all measures without a rule.
    metric: String,
    /// Kind of mistake that is described with its place and time.
    #[serde(default)]
    lapse: Option<MistakeName>,
    /// Order of severity among the mistakes: by the volume of tissue concerned (the default) or by depth.
    #[serde(default)]
    worst_by: Option<Severity>,
    /// Sentence for each of the worst such mistakes: {depth} {volume} {tissue} {where} {when} {force} {seconds} {value}
    /// {goal}.
    #[serde(default)]
    say: Option<Texts>,
    /// Sentence used instead if the measure itself has a time: {when} {value} {goal} {title}.
    #[serde(default)]
    seen: Option<Texts>,
    /// Sentence used if neither is known: {value} {goal} {title}.
    otherwise: Texts,
    /// Advice for the next attempt.
    #[serde(default)]
    advice: Option<Texts>,
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum MistakeName {
    Overcut,
    Vulnerable,
    Left,
    Force,
    Neighbour,
    Soft,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Severity {
    Volume,
    Depth,
}

impl From<MistakeName> for EpisodeKind {
    fn from(name: MistakeName) -> EpisodeKind {
        match name {
            MistakeName::Overcut => EpisodeKind::Overcut,
            MistakeName::Vulnerable => EpisodeKind::Vulnerable,
            MistakeName::Left => EpisodeKind::Left,
            MistakeName::Force => EpisodeKind::Force,
            MistakeName::Neighbour => EpisodeKind::Neighbour,
            MistakeName::Soft => EpisodeKind::Soft,
        }
    }
}

const SAY_PLACEHOLDERS: [&str; 9] = ["depth", "volume", "tissue", "where", "when", "force", "seconds", "value", "goal"];
const SEEN_PLACEHOLDERS: [&str; 4] = ["when", "value", "goal", "title"];
const OTHERWISE_PLACEHOLDERS: [&str; 3] = ["value", "goal", "title"];

/// Rules by which the sentences are made; always with a rule for measures that no other rule names.
#[derive(Clone, Debug)]
pub struct FeedbackRules(Vec<FeedbackRule>);

impl FeedbackRules {
    /// Reads `feedback.json`; `name` is used in complaints.
    ///
    /// # Errors
    ///
    /// Every fault of the text, a line each.
    pub fn read(name: &str, text: &str) -> Result<FeedbackRules, String> {
        let read = json::read::<FeedbackRulesFile>(SourceText::new(name, text)).map_err(|found| headlines(&found))?;
        let mut found = Vec::new();
        for (index, rule) in read.value.rules.iter().enumerate() {
            found.extend(validate_rule(rule, &read.source_map, &format!("/rules/{index}")));
        }
        if !read.value.rules.iter().any(|r| r.metric == ANY_METRIC) {
            let help = "add {\"metric\": \"*\", \"otherwise\": {…}}".to_string();
            found.push(read.source_map.complain(
                "/rules",
                "missing-rule",
                "there is no rule for \"*\"".into(),
                Some(help),
            ));
        }
        if found.is_empty() { Ok(FeedbackRules(read.value.rules)) } else { Err(headlines(&found)) }
    }

    /// Rule for a measure. A rule about touched vulnerable tissue is skipped where a higher value is better: such a
    /// zone was to be removed.
    fn rule_for(&self, metric: &str, is_lower_better: bool) -> Option<&FeedbackRule> {
        let name = metric.split('(').next().unwrap_or(metric);
        let is_applicable =
            |rule: &FeedbackRule| is_lower_better || rule.lapse.map(EpisodeKind::from) != Some(EpisodeKind::Vulnerable);
        self.0
            .iter()
            .find(|r| r.metric == name && is_applicable(r))
            .or_else(|| self.0.iter().find(|r| r.metric == ANY_METRIC))
    }
}

fn validate_rule(rule: &FeedbackRule, places: &json::SourceMap, path: &str) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    let mut complain = |key: &str, code, message: String, help: String| {
        found.push(places.complain(&format!("{path}/{key}"), code, message, Some(help)));
    };
    if rule.metric != ANY_METRIC && !typodont_exercise::scenario::metric::names().any(|n| n == rule.metric) {
        let message = format!("there is no measure \"{}\"", rule.metric);
        complain("metric", "unknown-metric", message, "every report lists the measures under \"All measures\"".into());
    }
    if rule.lapse.is_some() != rule.say.is_some() {
        let help = "give both \"lapse\" and \"say\", or neither".to_string();
        complain("metric", "half-rule", "\"lapse\" and \"say\" require each other".into(), help);
    }
    let texts = [
        ("say", rule.say.as_ref(), &SAY_PLACEHOLDERS[..]),
        ("seen", rule.seen.as_ref(), &SEEN_PLACEHOLDERS),
        ("otherwise", Some(&rule.otherwise), &OTHERWISE_PLACEHOLDERS),
        ("advice", rule.advice.as_ref(), &[]),
    ];
    for (key, texts, known) in texts.into_iter().filter_map(|(key, texts, known)| Some((key, texts?, known))) {
        if !texts.contains_key("en") {
            complain(
                key,
                "missing-text",
                "the English text is missing".into(),
                "add \"en\", which is used where another language is missing".into(),
            );
        }
        let names: BTreeSet<&str> =
            texts.values().flat_map(|t| placeholders(t)).filter(|n| !known.contains(n)).collect();
        for name in names {
            let known = known.iter().map(|n| format!("{{{n}}}")).collect::<Vec<_>>().join(" ");
            let help =
                if known.is_empty() { "this text takes no placeholders".into() } else { format!("known: {known}") };
            complain(key, "unknown-name", format!("there is no placeholder {{{name}}}"), help);
        }
    }
    found
}

/// An event that cost points, with the number that marks it on the page.
#[derive(Clone, Debug, PartialEq)]
pub struct FeedbackMoment {
    pub number: usize,
    /// Time of the mark, s; `None` for work that was never done.
    pub at: Option<f64>,
    /// Begin and end, s.
    pub span: Option<[f64; 2]>,
    /// Place in tooth space, mm.
    pub place: [f64; 3],
}

/// One sentence, with the number of the moment to which it refers.
#[derive(Clone, Debug, PartialEq)]
pub struct FeedbackSentence {
    pub message: Message,
    pub moment: Option<usize>,
}

/// One item of the rubric that lost points, or one critical error, in words.
#[derive(Clone, Debug, PartialEq)]
pub struct FeedbackFinding {
    pub metric: String,
    pub title: String,
    /// Points lost; `None` for a critical error.
    pub lost: Option<f64>,
    pub sentences: Vec<FeedbackSentence>,
    pub advice: Option<Message>,
}

/// Feedback on one session.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Feedback {
    /// Critical errors first, then items by points lost, most first.
    pub findings: Vec<FeedbackFinding>,
    /// Moments in the order in which sentences mention them, numbered from 1.
    pub moments: Vec<FeedbackMoment>,
    /// Titles of the items with full marks.
    pub full_marks: Vec<String>,
}

/// Feedback on a graded session; empty for a session without a grade.
pub fn build(session: &SessionFile, lapses: &[ErrorEpisode], rules: &FeedbackRules, tissues: &TissueTable) -> Feedback {
    let mut feedback = Feedback::default();
    let Some(grade) = &session.grade else { return feedback };
    let mut builder =
        SentenceBuilder { session, lapses, rules, tissues, numbered_lapses: Vec::new(), moments: Vec::new() };
    let mut explained_metrics: BTreeSet<&str> = BTreeSet::new();
    for fail in grade.hard_fail_checks.iter().filter(|f| f.failed) {
        if explained_metrics.insert(&fail.metric) {
            let goal = fail.above.or(fail.below);
            feedback.findings.push(builder.finding(&fail.metric, &fail.title, fail.value, goal, None, true));
        }
    }
    // Points lost because of another item are explained by that item.
    let has_lost = |i: &&super::ItemResultFile| i.max_points - i.own_points() >= LOST_POINTS_MIN;
    let mut items: Vec<_> = grade.items.iter().filter(has_lost).collect();
    items.sort_by(|a, b| (b.max_points - b.points).total_cmp(&(a.max_points - a.points)));
    for item in items {
        if explained_metrics.insert(&item.metric) {
            let lost = item.max_points - item.points;
            let (goal, is_lower_better) = (Some(item.full_at), item.full_at < item.zero_at);
            let finding = builder.finding(&item.metric, &item.title, item.value, goal, Some(lost), is_lower_better);
            feedback.findings.push(finding);
        }
    }
    let has_full_marks = |i: &&super::ItemResultFile| i.max_points - i.points < LOST_POINTS_MIN;
    feedback.full_marks = grade.items.iter().filter(has_full_marks).map(|i| i.title.clone()).collect();
    feedback.moments = builder.moments;
    feedback
}

/// Makes sentences and numbers the moments that they mention.
struct SentenceBuilder<'a> {
    session: &'a SessionFile,
    lapses: &'a [ErrorEpisode],
    rules: &'a FeedbackRules,
    tissues: &'a TissueTable,
    /// Lapses that have a moment, by index, with its number.
    numbered_lapses: Vec<(usize, usize)>,
    moments: Vec<FeedbackMoment>,
}

impl SentenceBuilder<'_> {
    /// Finding for one measure. `is_lower_better`: a higher value costs points.
    fn finding(
        &mut self,
        metric: &str,
        title: &str,
        value: Option<f64>,
        goal: Option<f64>,
        lost: Option<f64>,
        is_lower_better: bool,
    ) -> FeedbackFinding {
        let rules = self.rules;
        let mut finding =
            FeedbackFinding { metric: metric.into(), title: title.into(), lost, sentences: Vec::new(), advice: None };
        let Some(rule) = rules.rule_for(metric, is_lower_better) else { return finding };
        let formatted = |value: Option<f64>| {
            let text = display_format::measure(metric, value);
            Message::text_or(format!("value.{text}"), non_breaking(text))
        };
        let args: MessageArgs =
            [("value", formatted(value)), ("goal", formatted(goal)), ("title", Message::plain(title))]
                .map(|(name, said)| (name.to_string(), said))
                .into();
        if let (Some(mistake), Some(texts)) = (rule.lapse.map(EpisodeKind::from), &rule.say) {
            for index in self.worst_lapses(mistake, rule.worst_by) {
                finding.sentences.extend(self.sentence(index, texts, &args));
            }
        }
        if finding.sentences.is_empty() {
            finding.sentences.push(self.sentence_without_lapse(metric, rule, args));
        }
        finding.advice = rule.advice.clone().map(|texts| Message::PerLanguage { texts, args: Vec::new() });
        finding
    }

    /// Indices of the lapses of a kind that are described: the worst first, at most [`LAPSES_PER_ITEM_MAX`].
    fn worst_lapses(&self, mistake: EpisodeKind, by: Option<Severity>) -> Vec<usize> {
        let meant = self.lapses.iter().enumerate().filter(|(_, l)| l.kind == mistake);
        let mut meant: Vec<usize> = meant.map(|(index, _)| index).collect();
        if by == Some(Severity::Depth) {
            let depth = |index: &usize| self.lapses[*index].depth.unwrap_or(0.0);
            meant.sort_by(|a, b| depth(b).total_cmp(&depth(a)));
        }
        meant.truncate(LAPSES_PER_ITEM_MAX);
        meant
    }

    /// A sentence about a lapse; `None` if the text has a placeholder for which this lapse has no value.
    fn sentence(&mut self, index: usize, texts: &Texts, args: &MessageArgs) -> Option<FeedbackSentence> {
        let lapse = &self.lapses[index];
        let mut all_args = args.clone();
        all_args.extend(lapse_args(lapse, self.tissues));
        let names: BTreeSet<&str> = texts.values().flat_map(|t| placeholders(t)).collect();
        if names.iter().any(|name| !all_args.iter().any(|(n, _)| n == name)) {
            return None;
        }
        let moment = self.moment_of_lapse(index);
        Some(FeedbackSentence {
            message: Message::PerLanguage { texts: texts.clone(), args: all_args },
            moment: Some(moment),
        })
    }

    fn moment_of_lapse(&mut self, index: usize) -> usize {
        if let Some((_, number)) = self.numbered_lapses.iter().find(|(i, _)| *i == index) {
            return *number;
        }
        let lapse = &self.lapses[index];
        let span = lapse.span.map(|span| span.map(Tick::seconds));
        let number = self.add_moment(lapse.worst.map(Tick::seconds), span, lapse.place.to_array().map(f64::from));
        self.numbered_lapses.push((index, number));
        number
    }

    fn add_moment(&mut self, at: Option<f64>, span: Option<[f64; 2]>, place: [f64; 3]) -> usize {
        let number = self.moments.len() + 1;
        self.moments.push(FeedbackMoment { number, at, span, place });
        number
    }

    fn sentence_without_lapse(&mut self, metric: &str, rule: &FeedbackRule, args: MessageArgs) -> FeedbackSentence {
        let evidence = self.session.evidence.get(metric);
        if let (Some(texts), Some(evidence)) = (&rule.seen, evidence)
            && let Some(at) = evidence.at_s
        {
            let number = self.add_moment(Some(at), None, evidence.place_mm);
            let args_with_time = [args, vec![("when".to_string(), at_time(at))]].concat();
            return FeedbackSentence {
                message: Message::PerLanguage { texts: texts.clone(), args: args_with_time },
                moment: Some(number),
            };
        }
        FeedbackSentence { message: Message::PerLanguage { texts: rule.otherwise.clone(), args }, moment: None }
    }
}

/// A number and its unit with non-breaking spaces, so that they stay on one line.
fn non_breaking(text: String) -> String {
    text.replace(' ', "\u{a0}")
}

fn at_time(seconds: f64) -> Message {
    Message::text("when.at", &[("at", Message::plain(non_breaking(display_format::duration(seconds))))])
}

/// Values of the placeholders for a lapse; a name without a value is left out.
fn lapse_args(lapse: &ErrorEpisode, tissues: &TissueTable) -> MessageArgs {
    let mut known = vec![
        ("volume", Message::plain(non_breaking(format!("{} mm³", display_format::number(lapse.volume))))),
        ("force", Message::plain(non_breaking(format!("{:.1} N", lapse.force)))),
        ("seconds", Message::plain(non_breaking(display_format::duration(lapse.seconds)))),
    ];
    known.extend(lapse.depth.map(|mm| ("depth", Message::plain(non_breaking(format!("{mm:.1} mm"))))));
    known.extend(lapse.direction.map(|way| ("where", Message::text(format!("where.{}", direction_key(way)), &[]))));
    known.extend(
        tissues
            .by_label(lapse.tissue)
            .map(|t| ("tissue", Message::text_or(format!("tissue.{}", t.name), t.title.to_lowercase()))),
    );
    known.extend(lapse.span.map(|[from, to]| {
        let [from, to] = [from, to].map(Tick::seconds);
        let when = match lapse.worst {
            Some(worst) if to - from < SINGLE_MOMENT_S => at_time(worst.seconds()),
            _ => {
                let [from, to] = [from, to].map(|s| Message::plain(non_breaking(display_format::duration(s))));
                Message::text("when.between", &[("from", from), ("to", to)])
            }
        };
        ("when", when)
    }));
    known.into_iter().map(|(name, said)| (name.to_string(), said)).collect()
}

/// Last part of the language key of a direction (`where.…`).
fn direction_key(direction: AnatomicalDirection) -> &'static str {
    match direction {
        AnatomicalDirection::Buccal => "buccal",
        AnatomicalDirection::Lingual => "lingual",
        AnatomicalDirection::Mesial => "mesial",
        AnatomicalDirection::Distal => "distal",
        AnatomicalDirection::Occlusal => "occlusal",
        AnatomicalDirection::Apical => "apical",
    }
}

#[cfg(test)]
mod tests {
    use super::super::templates::Templates;
    use super::*;
    use typodont_exercise::score;

    #[test]
    fn the_most_costly_line_is_told_first_and_every_sentence_has_its_measure() {
        let (recording, scored) = crate::example();
        let session = SessionFile::of(&recording, &scored);
        let lapses = score::error_episodes(&recording, &scored);
        let templates = Templates::shipped();
        let feedback = build(&session, &lapses, templates.rules(), &recording.scenario.tissues);
        let lost: Vec<f64> = feedback.findings.iter().filter_map(|f| f.lost).collect();
        assert!(lost.len() >= 3 && lost.is_sorted_by(|a, b| a >= b), "{lost:?}");
        for finding in &feedback.findings {
            assert!(session.metrics.contains_key(&finding.metric), "{}", finding.metric);
            assert!(!finding.sentences.is_empty(), "{}", finding.metric);
            for sentence in &finding.sentences {
                for (code, text) in templates.languages().in_each_language(&sentence.message) {
                    assert!(!text.contains(['{', '}']), "{code}: {text}");
                }
            }
        }
        let numbers: Vec<usize> = feedback.moments.iter().map(|m| m.number).collect();
        assert_eq!(numbers, (1..=numbers.len()).collect::<Vec<_>>());
        let deepest = feedback.findings.iter().find(|f| f.metric == "overcut_depth_max_mm").unwrap();
        let english =
            templates.languages().in_each_language(&deepest.sentences[0].message)["en"].replace('\u{a0}', " ");
        let depth =
            lapses.iter().filter(|l| l.kind == EpisodeKind::Overcut).filter_map(|l| l.depth).fold(0.0, f32::max);
        assert!(english.contains(&format!(", {depth:.1} mm deep (")) && english.ends_with(" N)."), "{english}");
    }

    #[test]
    fn a_lapse_lies_where_its_mistake_was_made() {
        // Aim: no sentence sends a trainee to the wrong place. Method: the verdict at each lapse's place, and its time.
        let (recording, scored) = crate::example();
        let grid = scored.replay.workpiece.volume.grid();
        let lapses = score::error_episodes(&recording, &scored);
        let of = |mistake: EpisodeKind| lapses.iter().filter(move |l| l.kind == mistake);
        assert!(
            of(EpisodeKind::Overcut).count() > 0
                && of(EpisodeKind::Left).count() > 0
                && of(EpisodeKind::Force).count() > 0
        );
        let verdict = |l: &ErrorEpisode| scored.verdicts[grid.index(grid.nearest(l.place).unwrap())];
        for lapse in of(EpisodeKind::Overcut) {
            assert_eq!(verdict(lapse), score::Verdict::Overcut);
            let fall = scored.removals.at(grid.index(grid.nearest(lapse.place).unwrap()));
            let [from, to] = lapse.span.unwrap();
            assert!(fall == lapse.worst && fall.is_some_and(|t| from <= t && t <= to));
        }
        let count = scored.verdicts.iter().filter(|v| **v == score::Verdict::Overcut).count();
        let told: f64 = of(EpisodeKind::Overcut).map(|l| l.volume).sum();
        assert!(told <= count as f64 * grid.voxel_mm3() + 1e-6);
        assert!(of(EpisodeKind::Left).all(|l| verdict(l) == score::Verdict::Left && l.span.is_none()));
        let highest = of(EpisodeKind::Force).map(|l| l.force).fold(0.0, f32::max);
        assert_eq!(Some(highest), scored.measures.value("force_max_n").map(|v| v as f32));
    }

    #[test]
    fn a_schools_rules_are_held_against_what_can_be_said() {
        let check = |text: &str, expected: &[&str]| {
            let error = FeedbackRules::read("feedback.json", text).map(drop).unwrap_err();
            assert!(expected.iter().all(|e| error.contains(e)), "{error}");
        };
        check(
            r#"{"rules": [{"metric": "dise", "otherwise": {"tr": "{deph}"}}]}"#,
            &[
                "unknown-metric",
                "there is no measure \"dise\"",
                "missing-text",
                "unknown-name",
                "{deph}",
                "missing-rule",
            ],
        );
        check(r#"{"rules": [{"metric": "*", "say": {"en": "x"}, "otherwise": {"en": "x"}}]}"#, &["half-rule"]);
        check(r#"{"rules": [{"metric": "*"}]}"#, &["feedback.json:1:", "otherwise"]);
    }
}
