//! `typodont preview`: what the trainee will see, once or anew whenever the exercise is changed.

use super::{Failure, at_home, desktop, templates};
use crate::app;
use crate::author;
use crate::lesson;
use crate::render::{Changes, Image, Lamp, Lights, Painter, Scene, Shown, Tooth};
use crate::report::{SEEN, preview_png};
use crate::scenario::{Forms, Layout, Scenario, Workpiece};
use crate::scene::{self, Mouth};
use clap::Args;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How often a watched file is looked at.
const LOOK_EVERY: Duration = Duration::from_secs(1);

#[derive(Args)]
pub struct Arguments {
    /// The exercise
    scenario: PathBuf,
    /// The picture
    #[arg(short, long, value_name = "FILE.png", required_unless_present = "watch")]
    output: Option<PathBuf>,
    /// Show it anew whenever the file is changed: in a window, or with -o as a picture
    #[arg(long)]
    watch: bool,
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
    let Some(output) = &arguments.output else { return window(&arguments.scenario) };
    if output.extension().is_none_or(|e| !e.eq_ignore_ascii_case("png")) {
        return Err(Failure::misuse(format!("{}: the picture is a .png file", output.display())));
    }
    if !arguments.watch {
        return draw(arguments, output);
    }
    // Until somebody stops it: what is wrong meanwhile is said, and looked at again.
    let (_, mut stand) = author::read(&arguments.scenario)?;
    loop {
        match draw(arguments, output) {
            Ok(()) => super::say(output.display())?,
            Err(failure) => failure.tell(),
        }
        while stand.changed(&arguments.scenario).is_none_or(|now| now.is_err()) {
            std::thread::sleep(LOOK_EVERY);
        }
    }
}

/// The author's screen, which shows the file as an editor elsewhere changes it.
fn window(scenario: &Path) -> Result<(), Failure> {
    // A file that cannot be read is said here, where its name was given.
    author::read(scenario)?;
    let options = app::Options {
        exercise: Some(scenario.to_path_buf()),
        author: Some(app::Watch::Only),
        ..app::Options::at_shelf(at_home(), templates()?)
    };
    desktop(options)
}

fn draw(arguments: &Arguments, output: &Path) -> Result<(), Failure> {
    let scenario = lesson::read(&arguments.scenario, Forms::Made)?;
    let workpiece = Workpiece::make(&scenario, arguments.seed).map_err(Failure::wrong)?;
    let is_in_mouth = arguments.jaw || (!arguments.no_jaw && scenario.scene.layout == Layout::Jaw);
    let seen = seen(&scenario, &workpiece, is_in_mouth)?;
    super::write(output, preview_png(&scenario, &workpiece, &seen))
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
