//! `typodont preview`: renders the trainee's first view, once or whenever the exercise is changed.

use super::CliError;
use clap::Args;
use std::path::{Path, PathBuf};
use std::time::Duration;
use typodont_author as author;
use typodont_exercise::scenario::{ResolveMode, Scenario, Workpiece};
use typodont_lesson as lesson;
use typodont_render::{Changes, Lights, OffscreenRenderer, RenderMode, RenderScene, RgbaImage, VolumeInstance};
use typodont_report::{PREVIEW_SIZE, preview_png};
use typodont_scene as scene;

/// Poll interval of a watched file.
const POLL_INTERVAL: Duration = Duration::from_secs(1);

#[derive(Args)]
pub struct Arguments {
    /// Scenario file of the exercise
    scenario: PathBuf,
    /// Image to write
    #[arg(short, long, value_name = "FILE.png", required_unless_present = "watch")]
    output: Option<PathBuf>,
    /// Update the preview whenever the file changes: in a window, or with -o in the image
    #[arg(long)]
    watch: bool,
    /// Seed of the random choices of the exercise
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Render the mouth around the tooth even if the exercise has none
    #[arg(long, conflicts_with = "no_jaw")]
    jaw: bool,
    /// Render only what can be touched
    #[arg(long)]
    no_jaw: bool,
}

pub fn run(arguments: &Arguments) -> Result<(), CliError> {
    let Some(output) = &arguments.output else { return open_editor(&arguments.scenario) };
    if output.extension().is_none_or(|e| !e.eq_ignore_ascii_case("png")) {
        return Err(CliError::misuse(format!("{}: the name of the image must end in .png", output.display())));
    }
    if !arguments.watch {
        return draw_preview(arguments, output);
    }
    // The loop runs until the program is stopped: errors are printed, and the file is checked again.
    let (_, mut file_stamp) = author::read(&arguments.scenario)?;
    loop {
        match draw_preview(arguments, output) {
            Ok(()) => super::print_line(output.display())?,
            Err(failure) => failure.report(),
        }
        while file_stamp.poll_change(&arguments.scenario).is_none_or(|now| now.is_err()) {
            std::thread::sleep(POLL_INTERVAL);
        }
    }
}

/// Opens the author's screen, which shows the file while another program edits it.
#[cfg(feature = "desktop")]
fn open_editor(scenario: &Path) -> Result<(), CliError> {
    use super::{default_output_folder, load_templates, open_window};
    use typodont_app as app;
    // An unreadable file is reported here, on the command line on which it was named.
    author::read(scenario)?;
    let options = app::AppOptions {
        exercise: Some(scenario.to_path_buf()),
        editor_mode: Some(app::OpenMode::ReadOnly),
        ..app::AppOptions::at_exercise_list(default_output_folder(), load_templates()?)
    };
    open_window(options)
}

#[cfg(not(feature = "desktop"))]
fn open_editor(_: &Path) -> Result<(), CliError> {
    Err(super::missing_part::error("the window; without it, give -o FILE.png", "desktop"))
}

fn draw_preview(arguments: &Arguments, output: &Path) -> Result<(), CliError> {
    let scenario = lesson::read_scenario(&arguments.scenario, ResolveMode::MakeWorkpiece)?;
    let workpiece = Workpiece::make(&scenario, arguments.seed).map_err(CliError::wrong)?;
    let is_in_mouth = arguments.jaw || (!arguments.no_jaw && scenario.scene.is_in_mouth());
    let first_view = render_first_view(&scenario, &workpiece, is_in_mouth)?;
    super::write_file(output, preview_png(&scenario, &workpiece, &first_view))
}

/// Renders the trainee's first view, on a graphics adapter or else in software.
fn render_first_view(scenario: &Scenario, workpiece: &Workpiece, is_in_mouth: bool) -> Result<RgbaImage, CliError> {
    let palette = scene::tissue_palette(&scenario.tissues, true);
    let unworked_tooth = scene::unworked_tooth(workpiece, &scenario.tissues);
    let (mouth, around) = scene::mouth_and_solids(workpiece, &scenario.tissues, is_in_mouth);
    let orbit = scene::work_view(workpiece);
    let viewpoint = orbit.viewpoint();
    let picture = RenderScene {
        tooth: Some(VolumeInstance {
            volume: &workpiece.volume,
            changes: Changes::All,
            world_from_tooth: workpiece.world_from_tooth,
            palette: &palette,
            unworked_tooth: Some(&unworked_tooth),
            mode: RenderMode::Iso,
        }),
        solids: match mouth {
            Some(mouth) => mouth.seen_from(&around, &viewpoint, scene::WORKING_OPENING_DEG, None),
            None => around,
        },
        lights: Lights::along(&viewpoint),
        shadows: Some(scene::shadow_region(workpiece, &orbit)),
        relief_seed: Some(scene::relief_seed(scenario)),
        ..RenderScene::empty()
    };
    let (mut painter, _) = OffscreenRenderer::gpu_or_cpu();
    // If the adapter fails, the image is rendered in software, which only takes longer.
    let drawn = painter.draw(&picture, &viewpoint, None, PREVIEW_SIZE);
    let drawn = drawn.or_else(|_| OffscreenRenderer::cpu().draw(&picture, &viewpoint, None, PREVIEW_SIZE));
    drawn.map_err(|e| CliError::wrong(e.to_string()))
}
