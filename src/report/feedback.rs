//! Feedback in sentences: the causes of lost points and advice for the next attempt.
//!
//! Takes the result of a session, as in `session.json`, and rules that a school may edit. Gives for each rubric item
//! that lost points the events with their place, time and force, the most costly item first. Every sentence refers to
//! the measure that it explains, and takes tissue, wall, place, depth, force and time from one error episode ("lapse")
//! or from the evidence of that measure, never from two of them.

use super::display_format;
use super::language::{Message, MessageArgs, Texts, placeholders};
use super::{EpisodeFile, EvidenceFile, SessionFile};
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeSet;
use typodont_exercise::catalog::TissueRole;
use typodont_exercise::scenario::Scenario;
use typodont_exercise::score::EpisodeKind;
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
    /// Sentence for each of the worst such mistakes: {depth} {volume} {tissue} {sound_tissue} {where} {when} {at}
    /// {force} {force_at} {seconds} {zone} {value} {goal} {title}.
    #[serde(default)]
    say: Option<Texts>,
    /// Sentence used instead if the measure has the evidence that the sentence states: {tissue} {sound_tissue} {where}
    /// {depth} {volume} {when} {force} {value} {goal} {title}.
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
    Zone,
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
            MistakeName::Zone => EpisodeKind::Zone,
            MistakeName::Left => EpisodeKind::Left,
            MistakeName::Force => EpisodeKind::Force,
            MistakeName::Neighbour => EpisodeKind::Neighbour,
            MistakeName::Soft => EpisodeKind::Soft,
        }
    }
}

const SAY_PLACEHOLDERS: [&str; 14] = [
    "depth",
    "volume",
    "tissue",
    "sound_tissue",
    "where",
    "when",
    "at",
    "force",
    "force_at",
    "seconds",
    "zone",
    "value",
    "goal",
    "title",
];
const SEEN_PLACEHOLDERS: [&str; 10] =
    ["tissue", "sound_tissue", "where", "depth", "volume", "when", "force", "value", "goal", "title"];
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

    /// Rule for a measure. A rule about protected tissue is skipped where a higher value is better: such a zone was to
    /// be removed.
    fn rule_for(&self, metric: &str, is_lower_better: bool) -> Option<&FeedbackRule> {
        let name = metric.split('(').next().unwrap_or(metric);
        let is_applicable = |rule: &FeedbackRule| {
            is_lower_better || !matches!(rule.lapse, Some(MistakeName::Vulnerable | MistakeName::Zone))
        };
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
    pub title: Message,
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
    pub full_marks: Vec<Message>,
}

/// Feedback on a graded session; empty for a session without a grade. `scenario` gives the titles of tissues and zones.
pub fn build(session: &SessionFile, scenario: &Scenario, rules: &FeedbackRules) -> Feedback {
    let mut feedback = Feedback::default();
    let Some(grade) = &session.grade else { return feedback };
    let mut builder = SentenceBuilder { session, scenario, rules, numbered_lapses: Vec::new(), moments: Vec::new() };
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
    feedback.full_marks =
        grade.items.iter().filter(has_full_marks).map(|i| Message::authored(&scenario.texts, &i.title)).collect();
    feedback.moments = builder.moments;
    feedback
}

/// Makes sentences and numbers the moments that they mention.
struct SentenceBuilder<'a> {
    session: &'a SessionFile,
    scenario: &'a Scenario,
    rules: &'a FeedbackRules,
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
        let title = Message::authored(&self.scenario.texts, title);
        let (metric_name, sentences) = (metric.into(), Vec::new());
        let mut finding = FeedbackFinding { metric: metric_name, title: title.clone(), lost, sentences, advice: None };
        let Some(rule) = rules.rule_for(metric, is_lower_better) else { return finding };
        let formatted = |value: Option<f64>| {
            let text = display_format::measure(metric, value);
            Message::text_or(format!("value.{text}"), non_breaking(text))
        };
        let args: MessageArgs = [("value", formatted(value)), ("goal", formatted(goal)), ("title", title)]
            .map(|(name, said)| (name.to_string(), said))
            .into();
        if let (Some(mistake), Some(texts)) = (rule.lapse.map(EpisodeKind::from), &rule.say) {
            for index in self.worst_lapses(mistake, metric, goal, rule.worst_by) {
                finding.sentences.extend(self.sentence(index, texts, &args));
            }
        }
        if finding.sentences.is_empty() {
            finding.sentences.push(self.sentence_without_lapse(metric, value, rule, args));
        }
        finding.advice = rule.advice.clone().map(|texts| Message::PerLanguage { texts, args: Vec::new() });
        finding
    }

    /// Indices of the lapses of a kind that are described: the worst first, at most [`LAPSES_PER_ITEM_MAX`]. Of zones,
    /// only those in the measure's zone; of forces, only those above `goal`.
    fn worst_lapses(&self, mistake: EpisodeKind, metric: &str, goal: Option<f64>, by: Option<Severity>) -> Vec<usize> {
        let zone = metric.split_once('(').map(|(_, zone)| zone.trim_end_matches(')'));
        let is_meant = |lapse: &EpisodeFile| match mistake {
            EpisodeKind::Zone => lapse.zone.as_deref() == zone,
            EpisodeKind::Force => goal.is_none_or(|goal| lapse.force_n.is_some_and(|force| force > goal)),
            _ => true,
        };
        let lapses = &self.session.episodes;
        let meant = lapses.iter().enumerate().filter(|(_, l)| l.kind == mistake.id() && is_meant(l));
        let mut meant: Vec<usize> = meant.map(|(index, _)| index).collect();
        if by == Some(Severity::Depth) {
            let depth = |index: &usize| lapses[*index].depth_mm.unwrap_or(0.0);
            meant.sort_by(|a, b| depth(b).total_cmp(&depth(a)));
        }
        meant.truncate(LAPSES_PER_ITEM_MAX);
        meant
    }

    /// A sentence about a lapse; `None` if the text has a placeholder for which this lapse has no value.
    fn sentence(&mut self, index: usize, texts: &Texts, args: &MessageArgs) -> Option<FeedbackSentence> {
        let mut all_args = args.clone();
        all_args.extend(lapse_args(&self.session.episodes[index], self.scenario));
        if !is_complete(texts, &all_args) {
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
        let EpisodeFile { at_s, from_s, to_s, place_mm, .. } = self.session.episodes[index];
        let number = self.add_moment(at_s, from_s.zip(to_s).map(|(from, to)| [from, to]), place_mm);
        self.numbered_lapses.push((index, number));
        number
    }

    fn add_moment(&mut self, at: Option<f64>, span: Option<[f64; 2]>, place: [f64; 3]) -> usize {
        let number = self.moments.len() + 1;
        self.moments.push(FeedbackMoment { number, at, span, place });
        number
    }

    fn sentence_without_lapse(
        &mut self,
        metric: &str,
        value: Option<f64>,
        rule: &FeedbackRule,
        args: MessageArgs,
    ) -> FeedbackSentence {
        if let (Some(texts), Some(evidence)) = (&rule.seen, self.session.evidence.get(metric)) {
            let all_args = [args.clone(), evidence_args(evidence, self.scenario)].concat();
            if is_complete(texts, &all_args) {
                let number = self.add_moment(evidence.at_s, None, evidence.place_mm);
                let message = Message::PerLanguage { texts: texts.clone(), args: all_args };
                return FeedbackSentence { message, moment: Some(number) };
            }
        }
        let states_value = rule.otherwise.values().any(|text| placeholders(text).any(|name| name == "value"));
        let message = if value.is_none() && states_value {
            Message::Keyed { key: "feedback.no_value".into(), fallback: String::new(), args }
        } else {
            Message::PerLanguage { texts: rule.otherwise.clone(), args }
        };
        FeedbackSentence { message, moment: None }
    }
}

/// Returns true if every placeholder of a text has a value.
fn is_complete(texts: &Texts, args: &MessageArgs) -> bool {
    texts.values().flat_map(|text| placeholders(text)).all(|name| args.iter().any(|(known, _)| known == name))
}

/// A number and its unit with non-breaking spaces, so that they stay on one line.
fn non_breaking(text: String) -> String {
    text.replace(' ', "\u{a0}")
}

fn at_time(seconds: f64) -> Message {
    Message::text("when.at", &[("at", Message::plain(non_breaking(display_format::duration(seconds))))])
}

/// Values of the placeholders for a lapse; a name without a value is left out.
fn lapse_args(lapse: &EpisodeFile, scenario: &Scenario) -> MessageArgs {
    let zone = lapse.zone.as_ref().and_then(|id| scenario.zones.iter().find(|zone| zone.id == *id));
    let when = lapse.from_s.zip(lapse.to_s).zip(lapse.at_s).map(|((from, to), at)| {
        if to - from < SINGLE_MOMENT_S {
            return at_time(at);
        }
        let [from, to] = [from, to].map(|s| Message::plain(non_breaking(display_format::duration(s))));
        Message::text("when.between", &[("from", from), ("to", to)])
    });
    let known = [
        ("depth", lapse.depth_mm.map(length)),
        ("volume", lapse.volume_mm3.map(volume)),
        ("tissue", tissue(lapse.tissue.as_deref(), scenario)),
        ("sound_tissue", sound_tissue(lapse.tissue.as_deref(), scenario)),
        ("where", lapse.wall.as_deref().map(wall)),
        ("when", when),
        ("at", lapse.at_s.map(at_time)),
        ("force", lapse.force_n.map(force)),
        ("force_at", lapse.force_at_n.map(force)),
        ("seconds", lapse.contact_s.map(|s| Message::plain(non_breaking(display_format::duration(s))))),
        ("zone", zone.map(|zone| Message::authored(&scenario.texts, &zone.title))),
    ];
    with_values(known)
}

/// Values of the placeholders for the evidence of a measure; a name without a value is left out.
fn evidence_args(evidence: &EvidenceFile, scenario: &Scenario) -> MessageArgs {
    let known = [
        ("depth", evidence.depth_mm.map(length)),
        ("volume", evidence.volume_mm3.map(volume)),
        ("tissue", tissue(evidence.tissue.as_deref(), scenario)),
        ("sound_tissue", sound_tissue(evidence.tissue.as_deref(), scenario)),
        ("where", evidence.wall.as_deref().map(wall)),
        ("when", evidence.at_s.map(at_time)),
        ("force", evidence.force_n.map(force)),
    ];
    with_values(known)
}

fn with_values<const N: usize>(known: [(&str, Option<Message>); N]) -> MessageArgs {
    known.into_iter().filter_map(|(name, said)| Some((name.to_string(), said?))).collect()
}

fn length(mm: f64) -> Message {
    Message::plain(non_breaking(format!("{mm:.1} mm")))
}

fn force(newtons: f64) -> Message {
    Message::plain(non_breaking(format!("{newtons:.1} N")))
}

/// A volume in mm³ with two decimals; a smaller one than a tenth with three.
fn volume(mm3: f64) -> Message {
    let decimals = if mm3 == 0.0 {
        0
    } else if mm3 < 0.1 {
        3
    } else {
        2
    };
    Message::plain(non_breaking(format!("{mm3:.decimals$} mm³")))
}

fn wall(id: &str) -> Message {
    Message::text(format!("where.{id}"), &[])
}

/// Title of a tissue, in lower case within a sentence. `None` for a possible site of a draw, which feels like caries in
/// some trials and like enamel in the others.
fn tissue(name: Option<&str>, scenario: &Scenario) -> Option<Message> {
    let entry = scenario.tissues.by_name(name?).filter(|entry| entry.site_of.is_none())?;
    Some(Message::text_or(format!("tissue.{}", entry.name), entry.title.to_lowercase()))
}

/// Title of a tissue, called sound where it is sound tooth tissue; calculus or an old filling never is.
fn sound_tissue(name: Option<&str>, scenario: &Scenario) -> Option<Message> {
    let title = tissue(name, scenario)?;
    match scenario.tissues.by_name(name?)?.role {
        TissueRole::Sound => Some(Message::text("tissue_is.sound", &[("tissue", title)])),
        _ => Some(title),
    }
}

#[cfg(test)]
mod tests {
    use super::super::templates::Templates;
    use super::*;
    use typodont_exercise::score;
    use typodont_exercise::score::ErrorEpisode;

    #[test]
    fn the_most_costly_line_is_told_first_and_every_sentence_has_its_measure() {
        let (recording, scored) = crate::example();
        let session = SessionFile::of(&recording, &scored);
        let templates = Templates::shipped();
        let feedback = build(&session, &recording.scenario, templates.rules());
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
        let evidence = &session.evidence["overcut_depth_max_mm"];
        let told = [
            display_format::measure("overcut_depth_max_mm", session.metric("overcut_depth_max_mm")),
            format!("sound {}", evidence.tissue.as_ref().unwrap()),
            templates.languages().text_in("en", &wall(evidence.wall.as_ref().unwrap())),
            format!("at {}", display_format::duration(evidence.at_s.unwrap())),
            format!("{:.1} N", evidence.force_n.unwrap()),
        ];
        assert!(told.iter().all(|part| english.contains(part)), "{english}: {told:?}");
        let moment = feedback.moments[deepest.sentences[0].moment.unwrap() - 1].clone();
        assert_eq!((moment.at, moment.place), (evidence.at_s, evidence.place_mm), "one and the same evidence");
    }

    #[test]
    fn a_lapse_lies_where_its_mistake_was_made() {
        // Aim: no sentence sends a trainee to the wrong place. Method: the verdict at each lapse's place, and its time.
        let (recording, scored) = crate::example();
        let grid = scored.replay.workpiece.volume.grid();
        let lapses = score::error_episodes(&recording.scenario, &scored);
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
