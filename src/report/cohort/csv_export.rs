//! One line per session, one column per measure.

use super::{Cohort, dedup};
use crate::csv;
use typodont_exercise::scenario::metric;

/// Size of a voxel: one number, or three where the sides differ.
fn voxel_text([x, y, z]: [f64; 3]) -> String {
    if x == y && y == z { x.to_string() } else { format!("{x} {y} {z}") }
}

impl Cohort {
    pub fn csv(&self) -> String {
        let metrics = self.metric_names();
        let fixed = ["bundle", "scenario", "participant", "started", "points", "passed", "hard_fails"];
        let distance = self.removals.iter().any(|r| !r.distances.is_empty());
        let mut head: Vec<String> = fixed.into_iter().map(String::from).chain(metrics.iter().cloned()).collect();
        if distance {
            head.extend(["expert_differs_mm3", "expert_dice"].map(String::from));
        }
        head.extend(["verification", "verification_note"].map(String::from));
        head.extend(["tooth_fdi", "voxel_mm", "scorer_version"].map(String::from));
        let mut text = csv::format_row(&head);
        for (index, (path, session)) in self.sessions.iter().enumerate() {
            let grade = session.grade.as_ref();
            let shown = |value: Option<String>| value.unwrap_or_default();
            let mut line = vec![
                path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
                session.scenario.id.clone(),
                session.participant.clone(),
                session.started.clone(),
                shown(grade.map(|g| g.points.to_string())),
                shown(grade.map(|g| g.passed.to_string())),
                shown(grade.map(|g| g.hard_fails.join("; "))),
            ];
            line.extend(metrics.iter().map(|m| shown(session.metric(m).map(|v| v.to_string()))));
            if distance {
                let to_experts = self.distance_to_experts(index);
                line.push(shown(to_experts.map(|d| d.differs_mm3.to_string())));
                line.push(shown(to_experts.map(|d| d.dice.to_string())));
            }
            let status = self.status(path);
            line.extend([status.name().to_string(), status.note()]);
            line.push(shown(session.tooth_fdi.map(|fdi| fdi.to_string())));
            line.push(shown(session.voxel_mm.map(voxel_text)));
            line.push(session.scorer_version.to_string());
            text += &csv::format_row(&line);
        }
        text
    }

    /// Every measure any session has, those of the table first and in its order.
    pub fn metric_names(&self) -> Vec<String> {
        let used = |name: &str| self.sessions.iter().any(|(_, s)| s.metric(name).is_some());
        let mut names: Vec<String> =
            metric::without_argument().map(|a| a.name.to_string()).filter(|n| used(n)).collect();
        let others = dedup(self.sessions.iter().flat_map(|(_, s)| s.metrics.keys().map(String::as_str)));
        let others: Vec<String> =
            others.into_iter().filter(|n| !names.iter().any(|k| k == n) && used(n)).map(String::from).collect();
        names.extend(others);
        names
    }
}
