//! What to do better next time, in sentences.
//!
//! Takes a session's grade, its measures and its lapses, and rules that a school may edit. Gives for each line that cost
//! points what happened, where, when and under which force; the most costly first. Every sentence names its measure.

use super::SessionFile;
use super::language::{Said, Texts, With, names_in};
use super::words;
use crate::content::{TissueTable, json};
use crate::diagnostic::{Diagnostic, Source, headlines};
use crate::score::{Lapse, Mistake, Way};
use crate::tick::Tick;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeSet;

/// Lapses told for one line of a rubric: more are not kept in mind.
const LAPSES_TOLD: usize = 2;

/// Points below which nothing was lost.
const POINTS_LEAST: f64 = 0.05;

/// A lapse shorter than this happened at one moment, s.
const MOMENT_S: f64 = 1.0;

/// The name under which a rule speaks of every measure that has none of its own.
const ANY: &str = "*";

/// `feedback.json` as written.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RulesFile {
    /// The first rule of a measure holds.
    #[schemars(length(min = 1, max = 200))]
    rules: Vec<Rule>,
}

/// What to say of one measure. Texts are given by language ("en" is a must) and may hold names in braces.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Rule {
    /// The measure whose value this explains, without brackets; "*" for all that have no rule.
    metric: String,
    /// The kind of mistake that is told with its place and time.
    #[serde(default)]
    lapse: Option<MistakeName>,
    /// What makes one mistake worse than another; how much tissue suffered unless told otherwise.
    #[serde(default)]
    worst_by: Option<Severity>,
    /// Said of each of the worst such mistakes: {depth} {volume} {tissue} {where} {when} {force} {seconds} {value} {goal}.
    #[serde(default)]
    say: Option<Texts>,
    /// Said instead where the measure itself knows its moment: {when} {value} {goal} {title}.
    #[serde(default)]
    seen: Option<Texts>,
    /// Said where neither is known: {value} {goal} {title}.
    otherwise: Texts,
    /// What to do about it.
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

impl From<MistakeName> for Mistake {
    fn from(name: MistakeName) -> Mistake {
        match name {
            MistakeName::Overcut => Mistake::Overcut,
            MistakeName::Vulnerable => Mistake::Vulnerable,
            MistakeName::Left => Mistake::Left,
            MistakeName::Force => Mistake::Force,
            MistakeName::Neighbour => Mistake::Neighbour,
            MistakeName::Soft => Mistake::Soft,
        }
    }
}

const IN_SAY: [&str; 9] = ["depth", "volume", "tissue", "where", "when", "force", "seconds", "value", "goal"];
const IN_SEEN: [&str; 4] = ["when", "value", "goal", "title"];
const IN_OTHERWISE: [&str; 3] = ["value", "goal", "title"];

/// The rules by which sentences are made.
#[derive(Clone, Debug)]
pub struct Rules(Vec<Rule>);

impl Rules {
    /// Reads `feedback.json`; `name` is used in complaints. `Err` with all that is wrong with it.
    pub fn read(name: &str, text: &str) -> Result<Rules, String> {
        let read = json::read::<RulesFile>(Source::new(name, text)).map_err(|found| headlines(&found))?;
        let mut found = Vec::new();
        for (index, rule) in read.value.rules.iter().enumerate() {
            found.extend(complaints(rule, &read.places, &format!("/rules/{index}")));
        }
        if !read.value.rules.iter().any(|r| r.metric == ANY) {
            let help = "add {\"metric\": \"*\", \"otherwise\": {…}}".to_string();
            found.push(read.places.complain("/rules", "missing-rule", "no rule for \"*\"".into(), Some(help)));
        }
        if found.is_empty() { Ok(Rules(read.value.rules)) } else { Err(headlines(&found)) }
    }

    /// Of a zone that was to be removed nobody says that it must not be touched.
    fn of(&self, metric: &str, is_less_wanted: bool) -> Option<&Rule> {
        let name = metric.split('(').next().unwrap_or(metric);
        let fits = |rule: &Rule| is_less_wanted || rule.lapse.map(Mistake::from) != Some(Mistake::Vulnerable);
        self.0.iter().find(|r| r.metric == name && fits(r)).or_else(|| self.0.iter().find(|r| r.metric == ANY))
    }
}

fn complaints(rule: &Rule, places: &json::Places, path: &str) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    let mut complain = |key: &str, code, message: String, help: String| {
        found.push(places.complain(&format!("{path}/{key}"), code, message, Some(help)));
    };
    if rule.metric != ANY && !crate::scenario::metric::names().any(|n| n == rule.metric) {
        let message = format!("no measure named \"{}\"", rule.metric);
        complain("metric", "unknown-metric", message, "a report lists them under \"All measures\"".into());
    }
    if rule.lapse.is_some() != rule.say.is_some() {
        let help = "give both \"lapse\" and \"say\", or neither".to_string();
        complain("metric", "half-rule", "a mistake and what is said of it belong together".into(), help);
    }
    let texts = [
        ("say", rule.say.as_ref(), &IN_SAY[..]),
        ("seen", rule.seen.as_ref(), &IN_SEEN),
        ("otherwise", Some(&rule.otherwise), &IN_OTHERWISE),
        ("advice", rule.advice.as_ref(), &[]),
    ];
    for (key, texts, known) in texts.into_iter().filter_map(|(key, texts, known)| Some((key, texts?, known))) {
        if !texts.contains_key("en") {
            complain(
                key,
                "missing-text",
                "no English text".into(),
                "add \"en\": it stands in for other languages".into(),
            );
        }
        let names: BTreeSet<&str> = texts.values().flat_map(|t| names_in(t)).filter(|n| !known.contains(n)).collect();
        for name in names {
            let known = known.iter().map(|n| format!("{{{n}}}")).collect::<Vec<_>>().join(" ");
            let help =
                if known.is_empty() { "nothing can be filled in here".into() } else { format!("known: {known}") };
            complain(key, "unknown-name", format!("nothing is known as {{{name}}}"), help);
        }
    }
    found
}

/// A moment that cost points, numbered as the page marks it.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    pub number: usize,
    /// Where it is marked, s; `None` for what was never done.
    pub at: Option<f64>,
    /// First and last second.
    pub span: Option<[f64; 2]>,
    /// Tooth space, mm.
    pub place: [f64; 3],
}

/// One sentence, with the moment it speaks of.
#[derive(Clone, Debug, PartialEq)]
pub struct Sentence {
    pub said: Said,
    pub moment: Option<usize>,
}

/// One line that cost points, in words.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    pub metric: String,
    pub title: String,
    /// Points lost; `None` for what fails outright.
    pub lost: Option<f64>,
    pub sentences: Vec<Sentence>,
    pub advice: Option<Said>,
}

/// What a session's feedback consists of.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Feedback {
    /// What fails outright first, then what cost most.
    pub findings: Vec<Finding>,
    /// In the order in which sentences mention them; numbered from 1.
    pub moments: Vec<Moment>,
    /// Titles of what earned all its points.
    pub kept: Vec<String>,
}

/// What is to be said of a graded session; nothing of one without a grade.
pub fn of(session: &SessionFile, lapses: &[Lapse], rules: &Rules, tissues: &TissueTable) -> Feedback {
    let mut feedback = Feedback::default();
    let Some(grade) = &session.grade else { return feedback };
    let mut teller = Teller { session, lapses, rules, tissues, mentioned: Vec::new(), moments: Vec::new() };
    let mut told: BTreeSet<&str> = BTreeSet::new();
    for fail in grade.hard_fail_checks.iter().filter(|f| f.failed) {
        if told.insert(&fail.metric) {
            let goal = fail.above.or(fail.below);
            feedback.findings.push(teller.tell(&fail.metric, &fail.title, fail.value, goal, None, true));
        }
    }
    let mut items: Vec<_> = grade.items.iter().filter(|i| i.max_points - i.points >= POINTS_LEAST).collect();
    items.sort_by(|a, b| (b.max_points - b.points).total_cmp(&(a.max_points - a.points)));
    for item in items {
        if told.insert(&item.metric) {
            let lost = item.max_points - item.points;
            let (goal, is_less_wanted) = (Some(item.full_at), item.full_at < item.zero_at);
            let found = teller.tell(&item.metric, &item.title, item.value, goal, Some(lost), is_less_wanted);
            feedback.findings.push(found);
        }
    }
    let is_kept = |i: &&super::ItemFile| i.max_points - i.points < POINTS_LEAST;
    feedback.kept = grade.items.iter().filter(is_kept).map(|i| i.title.clone()).collect();
    feedback.moments = teller.moments;
    feedback
}

/// Makes sentences and numbers what they mention.
struct Teller<'a> {
    session: &'a SessionFile,
    lapses: &'a [Lapse],
    rules: &'a Rules,
    tissues: &'a TissueTable,
    /// Lapses that have a moment, by index, with its number.
    mentioned: Vec<(usize, usize)>,
    moments: Vec<Moment>,
}

impl Teller<'_> {
    /// `is_less_wanted`: points are lost by more of what is measured.
    fn tell(
        &mut self,
        metric: &str,
        title: &str,
        value: Option<f64>,
        goal: Option<f64>,
        lost: Option<f64>,
        is_less_wanted: bool,
    ) -> Finding {
        let rules = self.rules;
        let mut finding =
            Finding { metric: metric.into(), title: title.into(), lost, sentences: Vec::new(), advice: None };
        let Some(rule) = rules.of(metric, is_less_wanted) else { return finding };
        let measured = |value: Option<f64>| {
            let text = words::measure(metric, value);
            Said::word(format!("value.{text}"), together(text))
        };
        let known: With = [("value", measured(value)), ("goal", measured(goal)), ("title", Said::plain(title))]
            .map(|(name, said)| (name.to_string(), said))
            .into();
        if let (Some(mistake), Some(texts)) = (rule.lapse.map(Mistake::from), &rule.say) {
            for index in self.worst(mistake, rule.worst_by) {
                finding.sentences.extend(self.sentence(index, texts, &known));
            }
        }
        if finding.sentences.is_empty() {
            finding.sentences.push(self.without_lapse(metric, rule, known));
        }
        finding.advice = rule.advice.clone().map(|texts| Said::Each { texts, with: Vec::new() });
        finding
    }

    /// Which lapses of a kind are told, by index.
    fn worst(&self, mistake: Mistake, by: Option<Severity>) -> Vec<usize> {
        let meant = self.lapses.iter().enumerate().filter(|(_, l)| l.mistake == mistake);
        let mut meant: Vec<usize> = meant.map(|(index, _)| index).collect();
        if by == Some(Severity::Depth) {
            let depth = |index: &usize| self.lapses[*index].depth.unwrap_or(0.0);
            meant.sort_by(|a, b| depth(b).total_cmp(&depth(a)));
        }
        meant.truncate(LAPSES_TOLD);
        meant
    }

    /// A sentence about a lapse; `None` where it asks for what this lapse does not have.
    fn sentence(&mut self, index: usize, texts: &Texts, known: &With) -> Option<Sentence> {
        let lapse = &self.lapses[index];
        let mut with = known.clone();
        with.extend(words_of(lapse, self.tissues));
        let names: BTreeSet<&str> = texts.values().flat_map(|t| names_in(t)).collect();
        if names.iter().any(|name| !with.iter().any(|(n, _)| n == name)) {
            return None;
        }
        let moment = self.moment_of(index);
        Some(Sentence { said: Said::Each { texts: texts.clone(), with }, moment: Some(moment) })
    }

    fn moment_of(&mut self, index: usize) -> usize {
        if let Some((_, number)) = self.mentioned.iter().find(|(i, _)| *i == index) {
            return *number;
        }
        let lapse = &self.lapses[index];
        let span = lapse.span.map(|span| span.map(Tick::seconds));
        let number = self.mark(lapse.worst.map(Tick::seconds), span, lapse.place.to_array().map(f64::from));
        self.mentioned.push((index, number));
        number
    }

    fn mark(&mut self, at: Option<f64>, span: Option<[f64; 2]>, place: [f64; 3]) -> usize {
        let number = self.moments.len() + 1;
        self.moments.push(Moment { number, at, span, place });
        number
    }

    fn without_lapse(&mut self, metric: &str, rule: &Rule, known: With) -> Sentence {
        let evidence = self.session.evidence.get(metric);
        if let (Some(texts), Some(evidence)) = (&rule.seen, evidence)
            && let Some(at) = evidence.at_s
        {
            let number = self.mark(Some(at), None, evidence.place_mm);
            let with = [known, vec![("when".to_string(), at_moment(at))]].concat();
            return Sentence { said: Said::Each { texts: texts.clone(), with }, moment: Some(number) };
        }
        Sentence { said: Said::Each { texts: rule.otherwise.clone(), with: known }, moment: None }
    }
}

/// A number and its unit, which stay on one line.
fn together(text: String) -> String {
    text.replace(' ', "\u{a0}")
}

fn at_moment(seconds: f64) -> Said {
    Said::text("when.at", &[("at", Said::plain(together(words::duration(seconds))))])
}

/// What can be said of a lapse; a name is missing where it has none.
fn words_of(lapse: &Lapse, tissues: &TissueTable) -> With {
    let mut known = vec![
        ("volume", Said::plain(together(format!("{} mm³", words::number(lapse.volume))))),
        ("force", Said::plain(together(format!("{:.1} N", lapse.force)))),
        ("seconds", Said::plain(together(words::duration(lapse.seconds)))),
    ];
    known.extend(lapse.depth.map(|mm| ("depth", Said::plain(together(format!("{mm:.1} mm"))))));
    known.extend(lapse.way.map(|way| ("where", Said::text(format!("where.{}", way_name(way)), &[]))));
    known.extend(
        tissues
            .by_label(lapse.tissue)
            .map(|t| ("tissue", Said::word(format!("tissue.{}", t.name), t.title.to_lowercase()))),
    );
    known.extend(lapse.span.map(|[from, to]| {
        let [from, to] = [from, to].map(Tick::seconds);
        let when = match lapse.worst {
            Some(worst) if to - from < MOMENT_S => at_moment(worst.seconds()),
            _ => {
                let [from, to] = [from, to].map(|s| Said::plain(together(words::duration(s))));
                Said::text("when.between", &[("from", from), ("to", to)])
            }
        };
        ("when", when)
    }));
    known.into_iter().map(|(name, said)| (name.to_string(), said)).collect()
}

/// The last part of the keys of places.
fn way_name(way: Way) -> &'static str {
    match way {
        Way::Buccal => "buccal",
        Way::Lingual => "lingual",
        Way::Mesial => "mesial",
        Way::Distal => "distal",
        Way::Occlusal => "occlusal",
        Way::Apical => "apical",
    }
}

#[cfg(test)]
mod tests {
    use super::super::html::Templates;
    use super::*;
    use crate::score;

    #[test]
    fn the_most_costly_line_is_told_first_and_every_sentence_has_its_measure() {
        let (recording, scored) = crate::report::example();
        let session = SessionFile::of(&recording, &scored);
        let lapses = score::lapses(&recording, &scored);
        let templates = Templates::shipped();
        let feedback = of(&session, &lapses, templates.rules(), &recording.scenario.tissues);
        let lost: Vec<f64> = feedback.findings.iter().filter_map(|f| f.lost).collect();
        assert!(lost.len() >= 3 && lost.is_sorted_by(|a, b| a >= b), "{lost:?}");
        for finding in &feedback.findings {
            assert!(session.metrics.contains_key(&finding.metric), "{}", finding.metric);
            assert!(!finding.sentences.is_empty(), "{}", finding.metric);
            for sentence in &finding.sentences {
                for (code, text) in templates.languages().each(&sentence.said) {
                    assert!(!text.contains(['{', '}']), "{code}: {text}");
                }
            }
        }
        let numbers: Vec<usize> = feedback.moments.iter().map(|m| m.number).collect();
        assert_eq!(numbers, (1..=numbers.len()).collect::<Vec<_>>());
        let deepest = feedback.findings.iter().find(|f| f.metric == "overcut_depth_max_mm").unwrap();
        let english = templates.languages().each(&deepest.sentences[0].said)["en"].replace('\u{a0}', " ");
        let depth = lapses.iter().filter(|l| l.mistake == Mistake::Overcut).filter_map(|l| l.depth).fold(0.0, f32::max);
        assert!(english.starts_with(&format!("{depth:.1} mm of sound ")) && english.ends_with(" N."), "{english}");
    }

    #[test]
    fn a_lapse_lies_where_its_mistake_was_made() {
        // Aim: no sentence sends a trainee to the wrong place. Method: the verdict at each lapse's place, and its time.
        let (recording, scored) = crate::report::example();
        let grid = scored.replay.workpiece.volume.grid();
        let lapses = score::lapses(&recording, &scored);
        let of = |mistake: Mistake| lapses.iter().filter(move |l| l.mistake == mistake);
        assert!(of(Mistake::Overcut).count() > 0 && of(Mistake::Left).count() > 0 && of(Mistake::Force).count() > 0);
        let verdict = |l: &Lapse| scored.verdicts[grid.index(grid.nearest(l.place).unwrap())];
        for lapse in of(Mistake::Overcut) {
            assert_eq!(verdict(lapse), score::Verdict::Overcut);
            let fall = scored.falls.at(grid.index(grid.nearest(lapse.place).unwrap()));
            let [from, to] = lapse.span.unwrap();
            assert!(fall == lapse.worst && fall.is_some_and(|t| from <= t && t <= to));
        }
        let count = scored.verdicts.iter().filter(|v| **v == score::Verdict::Overcut).count();
        let told: f64 = of(Mistake::Overcut).map(|l| l.volume).sum();
        assert!(told <= count as f64 * grid.voxel_mm3() + 1e-6);
        assert!(of(Mistake::Left).all(|l| verdict(l) == score::Verdict::Left && l.span.is_none()));
        let highest = of(Mistake::Force).map(|l| l.force).fold(0.0, f32::max);
        assert_eq!(Some(highest), scored.measures.value("force_max_n").map(|v| v as f32));
    }

    #[test]
    fn a_schools_rules_are_held_against_what_can_be_said() {
        let check = |text: &str, expected: &[&str]| {
            let error = Rules::read("feedback.json", text).map(drop).unwrap_err();
            assert!(expected.iter().all(|e| error.contains(e)), "{error}");
        };
        check(
            r#"{"rules": [{"metric": "dise", "otherwise": {"tr": "{deph}"}}]}"#,
            &["unknown-metric", "no measure named \"dise\"", "missing-text", "unknown-name", "{deph}", "missing-rule"],
        );
        check(r#"{"rules": [{"metric": "*", "say": {"en": "x"}, "otherwise": {"en": "x"}}]}"#, &["half-rule"]);
        check(r#"{"rules": [{"metric": "*"}]}"#, &["feedback.json:1:", "otherwise"]);
    }
}
