//! `typodont preview`: what the trainee will see.

use super::Failure;
use crate::content;
use crate::lesson;
use crate::render::{Changes, Image, Lamp, Lights, Painter, Scene, Shown, Tooth};
use crate::report::{SEEN, preview_png};
use crate::scenario::{self, Forms, Layout, Scenario, Workpiece};
use crate::scene::{self, Mouth};
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
pub struct Arguments {
    /// The exercise
    scenario: PathBuf,
    /// The picture
    #[arg(short, long, value_name = "FILE.png")]
    output: PathBuf,
    /// Decides what the exercise leaves to chance
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Draw the mouth around the tooth, also where the exercise has none
    #[arg(long, conflicts_with = "no_jaw")]
    jaw: bool,
    /// Draw only what can be touched
    #[arg(long)]
    no_jaw: bool,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.output.extension().is_none_or(|e| !e.eq_ignore_ascii_case("png")) {
        return Err(Failure::misuse(format!("{}: the picture is a .png file", arguments.output.display())));
    }
    let source = content::read_text(&arguments.scenario)?;
    let scenario = scenario::resolve(source, &lesson::library_for(&arguments.scenario), Forms::Made)?;
    let workpiece = Workpiece::make(&scenario, arguments.seed).map_err(Failure::wrong)?;
    let is_in_mouth = arguments.jaw || (!arguments.no_jaw && scenario.scene.layout == Layout::Jaw);
    let seen = seen(&scenario, &workpiece, is_in_mouth)?;
    super::write(&arguments.output, preview_png(&scenario, &workpiece, &seen))
}

/// What the trainee sees at the start, on an adapter or else by the processor.
fn seen(scenario: &Scenario, workpiece: &Workpiece, is_in_mouth: bool) -> Result<Image, Failure> {
    let palette = scene::palette(&scenario.tissues, true);
    let mouth = Mouth::around(workpiece, &scenario.tissues).filter(|_| is_in_mouth);
    let around = || scene::around(workpiece, &scenario.tissues);
    let viewpoint = scene::work_view(workpiece).viewpoint();
    let picture = Scene {
        tooth: Some(Tooth {
            volume: &workpiece.volume,
            changes: Changes::Anew,
            world_from_tooth: workpiece.world_from_tooth,
            palette: &palette,
            shown: Shown::Iso,
        }),
        solids: mouth.map_or_else(around, |mouth| mouth.solids(scene::OPEN)),
        lights: Lights { head: Lamp::head(viewpoint.position), ..Lights::default() },
        ..Scene::empty()
    };
    let (mut painter, _) = Painter::best();
    // An adapter that fails costs time, not the picture.
    let drawn = painter.draw(&picture, &viewpoint, None, SEEN);
    let drawn = drawn.or_else(|_| Painter::cpu().draw(&picture, &viewpoint, None, SEEN));
    drawn.map_err(|e| Failure::wrong(e.to_string()))
}
