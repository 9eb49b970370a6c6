//! Sounds of a lesson: the drill under its present load, and the cry of a patient in pain.

use std::f32::consts::PI;
use typodont_audio::{DrillLoad, SoundSender, Tool};
use typodont_core::frame::Vec3;
use typodont_core::sim::Step;
use typodont_core::tick::{TICK_S, Tick};
use typodont_core::touch::CuttingLaw;
use typodont_exercise::catalog::{TissueRole, ToolKind};
use typodont_exercise::scenario::{Scenario, anatomy_tissues};
use typodont_exercise::score::LimitMonitor;

/// Speed of a bur for which the scenario gives none, 1/min: an air turbine under light load, and a contra-angle with
/// round steel burs. Handpieces of ISO 14457.
const TURBINE_RPM: f32 = 300_000.0;
const LOW_SPEED_RPM: f32 = 20_000.0;

/// Speeds from which the sound is that of an electric contra-angle, and that of a turbine, 1/min.
const ELECTRIC_FROM_RPM: f32 = 40_000.0;
const TURBINE_FROM_RPM: f32 = 220_000.0;

/// Excess over a limit at which a cry reaches its full loudness, as a share of the limit: 4.5 N for the limit of an
/// exercise that has none of its own.
const PAINFUL_SPAN: f32 = 0.8;

/// Time without pain after which the next pain causes a new cry, s.
const RELIEF: f32 = 0.6;

/// Time constant with which the working end's speed is smoothed, s.
const SPEED_TIME: f32 = 0.02;

/// Derives sound commands from the ticks of a lesson.
pub struct LessonSound {
    sender: SoundSender,
    tools: Vec<ToolSound>,
    /// Hardness by label, HV.
    hardness: [f32; 256],
    is_soft: [bool; 256],
    last: Option<(u64, Vec3)>,
    /// Smoothed speed of the working end, mm/s.
    speed: f32,
    /// Time since the patient was last in pain, s.
    time_since_pain: f32,
    /// Tick up to which excesses over limits have been answered; a pause does not bring earlier ones back.
    pain_noted: Tick,
}

/// Sound properties of an instrument.
#[derive(Clone, Copy)]
struct ToolSound {
    tool: Tool,
    /// Speed of rotation, 1/min; 0 for an instrument that does not rotate.
    rpm: f32,
    /// Speed at the circumference, mm/s.
    surface_speed: f32,
}

impl LessonSound {
    pub fn new(scenario: &Scenario, sender: SoundSender) -> LessonSound {
        let rpm = match scenario.carving.law {
            CuttingLaw::Rate(rate) => Some(rate.rpm),
            CuttingLaw::Threshold => None,
        };
        let voice = |entry: &typodont_exercise::catalog::InstrumentEntry| {
            if !entry.is_bur() {
                return ToolSound { tool: Tool::Hand, rpm: 0.0, surface_speed: 0.0 };
            }
            let usual = if entry.kind == Some(ToolKind::SteelBur) { LOW_SPEED_RPM } else { TURBINE_RPM };
            let rpm = rpm.unwrap_or(usual);
            let tool = match rpm {
                rpm if rpm >= TURBINE_FROM_RPM => Tool::AirTurbine,
                rpm if rpm >= ELECTRIC_FROM_RPM => Tool::Electric,
                _ => Tool::LowSpeed,
            };
            ToolSound { tool, rpm, surface_speed: 2.0 * PI * entry.to_instrument().radius() * rpm / 60.0 }
        };
        let mut sound = LessonSound {
            sender,
            tools: scenario.instruments.iter().map(voice).collect(),
            hardness: [0.0; 256],
            is_soft: [false; 256],
            last: None,
            speed: 0.0,
            time_since_pain: RELIEF,
            pain_noted: Tick::ZERO,
        };
        let enamel = scenario.tissues.by_label(anatomy_tissues(&scenario.tissues).enamel);
        for entry in scenario.tissues.entries() {
            let place = usize::from(entry.id);
            // All possible sites of a draw sound alike, drawn or not: they are to be found by touch.
            let heard = enamel.filter(|_| entry.site_of.is_some()).unwrap_or(entry);
            sound.hardness[place] = heard.hardness_hv.unwrap_or(0.0);
            sound.is_soft[place] = entry.role == TissueRole::Soft;
        }
        sound
    }

    /// Updates the sound from the newest tick. `is_running`: the foot pedal is pressed; `limits`: the limits of the
    /// exercise as of that tick.
    pub fn update(&mut self, step: &Step, is_running: bool, limits: &LimitMonitor) {
        let Some(&voice) = self.tools.get(step.instrument) else { return };
        let excess = limits.painful_excess(self.pain_noted);
        self.pain_noted = step.tick;
        let seconds = self.update_speed(step);
        let load = self.load(step, voice, is_running);
        self.sender.set_load(&load);
        let is_soft = step.touch.is_some_and(|touch| self.is_soft[usize::from(touch.label.0)]);
        if let Some(strength) = self.pain_strength(is_soft && load.is_running, excess, seconds) {
            // If the queue is full, this cry is dropped; the lesson does not depend on it.
            self.sender.cry(strength);
        }
    }

    fn load(&self, step: &Step, voice: ToolSound, is_running: bool) -> DrillLoad {
        let ToolSound { tool, rpm, surface_speed } = voice;
        let label = step.touch.map(|touch| usize::from(touch.label.0));
        let force = step.touch.map_or(0.0, |touch| touch.spring);
        let is_running = is_running && rpm > 0.0;
        DrillLoad {
            tool,
            is_running,
            speed: rpm,
            is_touching: label.is_some(),
            is_cutting: step.cutting,
            force,
            surface_speed: if is_running { surface_speed } else { self.speed },
            hardness: label.map_or(0.0, |label| self.hardness[label]),
            is_suction_on: is_running,
            is_spray_on: is_running,
        }
    }

    /// Silences the drill: no instrument runs and no tissue is touched.
    pub fn silence(&mut self) {
        self.sender.set_load(&DrillLoad { tool: Tool::Hand, ..DrillLoad::default() });
        self.last = None;
    }

    /// Updates the working end's speed. Returns the time since the last tick processed here, s.
    fn update_speed(&mut self, step: &Step) -> f32 {
        let now = step.tick.0;
        let seconds = match self.last {
            Some((before, tip)) if now > before => {
                let seconds = (now - before) as f32 * TICK_S as f32;
                let share = 1.0 - libm::expf(-seconds / SPEED_TIME);
                self.speed += share * (step.tip.distance(tip) / seconds - self.speed);
                seconds
            }
            Some(_) => return 0.0,
            None => 0.0,
        };
        self.last = Some((now, step.tip));
        seconds
    }

    /// Loudness of the patient's cry, 0 to 1, if this is a new pain.
    ///
    /// `excess`: excess over a limit that causes cries, as a share of it.
    fn pain_strength(&mut self, is_drilled: bool, excess: Option<f32>, seconds: f32) -> Option<f32> {
        self.time_since_pain += seconds;
        if !is_drilled && excess.is_none() {
            return None;
        }
        let is_new = self.time_since_pain >= RELIEF;
        self.time_since_pain = 0.0;
        let by_excess = 0.4 + 0.6 * (excess.unwrap_or(0.0) / PAINFUL_SPAN).clamp(0.0, 1.0);
        is_new.then_some(if is_drilled { 1.0 } else { by_excess })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_audio::sound_channel;
    use typodont_core::sim::Touch;
    use typodont_core::tick::Tick;
    use typodont_core::volume::Label;
    use typodont_exercise::scenario;
    use typodont_exercise::scenario::ResolveMode;
    use typodont_formats::Library;
    use typodont_formats::diagnostic::SourceText;

    /// The treatment of the grinding exercise, and what is touched in it.
    fn grinding() -> (LessonSound, Scenario) {
        let text = include_str!("../../scenarios/5-grinding.json");
        let scenario =
            scenario::resolve(SourceText::new("5-grinding", text), &Library::shipped(), ResolveMode::MakeWorkpiece)
                .unwrap();
        (LessonSound::new(&scenario, sound_channel().0), scenario)
    }

    fn step(instrument: usize, touched: Option<(Label, f32)>) -> Step {
        Step {
            tick: Tick(0),
            force: Vec3::ZERO,
            torque: Vec3::ZERO,
            hand: Vec3::ZERO,
            tip: Vec3::ZERO,
            handle: typodont_core::device::UPRIGHT,
            world_from_device: typodont_core::frame::Quat::IDENTITY,
            is_hand_free: false,
            is_hand_blocked: false,
            touch: touched.map(|(label, spring)| Touch { label, spring, normal: Vec3::Y }),
            cutting: touched.is_some(),
            removed: 0,
            coupling_force: Vec3::ZERO,
            guidance: Vec3::ZERO,
            instrument,
        }
    }

    #[test]
    fn a_bur_is_heard_by_its_tissue_and_an_explorer_does_not_turn() {
        // Aim: the load says what is in the hand and under it. Method: the shipped tables; a bur of 1.4 mm at 300 000 rpm has
        // 22 m/s at its circumference.
        let (treatment, scenario) = grinding();
        let enamel = scenario.tissues.by_name("enamel").unwrap();
        let [bur, explorer] = [0, 2];
        assert!(scenario.instruments[bur].cuts && !scenario.instruments[explorer].cuts);
        let load = treatment.load(&step(bur, Some((enamel.label(), 1.2))), treatment.tools[bur], true);
        assert!(load.is_running && load.is_touching && load.is_cutting && load.force == 1.2);
        assert_eq!(Some(load.hardness), enamel.hardness_hv);
        assert!((load.surface_speed - 21_991.0).abs() < 10.0, "{}", load.surface_speed);
        let free = treatment.load(&step(bur, None), treatment.tools[bur], true);
        assert!(free.is_running && !free.is_touching && free.hardness == 0.0);
        let probing = treatment.load(&step(explorer, Some((enamel.label(), 0.5))), treatment.tools[explorer], true);
        assert!(probing.tool == Tool::Hand && !probing.is_running && probing.is_touching);
        let resting = treatment.load(&step(bur, None), treatment.tools[bur], false);
        assert!(!resting.is_running && !resting.is_suction_on);
    }

    #[test]
    fn a_pause_brings_no_earlier_pain_back() {
        // Aim: who goes on after a pause without pressing hears no cry. Method: a press above the limit, a pause, and a light
        // touch a second later; a cry would begin the time since the last pain again.
        let (mut treatment, scenario) = grinding();
        let mut limits = LimitMonitor::new(&scenario, &scenario::Workpiece::make(&scenario, 1).unwrap());
        let enamel = scenario.tissues.by_name("enamel").unwrap().label();
        let mut touch = |treatment: &mut LessonSound, tick: u64, force: f32| {
            let step = Step { tick: Tick(tick), force: Vec3::Y * force, ..step(2, Some((enamel, force))) };
            limits.observe(&step);
            treatment.update(&step, false, &limits);
        };
        touch(&mut treatment, 100, 4.0);
        assert_eq!(treatment.time_since_pain, 0.0, "a cry");
        treatment.silence();
        for tick in [1100, 2100] {
            touch(&mut treatment, tick, 0.5);
        }
        assert!(treatment.time_since_pain > 0.9, "{}", treatment.time_since_pain);
    }

    #[test]
    fn each_pain_is_one_cry() {
        // Aim: a patient cries when hurt, louder when hurt more, and not at every tick of one pain.
        let (mut treatment, _) = grinding();
        assert_eq!(treatment.pain_strength(false, None, 0.004), None, "light force");
        let light = treatment.pain_strength(false, Some(0.2), 0.004).unwrap();
        assert_eq!(treatment.pain_strength(false, Some(0.2), 0.004), None, "the same pain");
        assert_eq!(treatment.pain_strength(false, None, RELIEF), None);
        let hard = treatment.pain_strength(false, Some(0.8), 0.004).unwrap();
        assert!(light < hard && hard <= 1.0, "{light} {hard}");
        assert_eq!(treatment.pain_strength(false, None, RELIEF), None);
        assert_eq!(treatment.pain_strength(true, None, 0.004), Some(1.0), "drilled gum");
    }
}
