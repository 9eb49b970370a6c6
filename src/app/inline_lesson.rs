//! A lesson within the window's frames, for a page in a browser, which has no threads.

use crate::lesson_backend::LessonBackend;
use crate::lesson_run::LessonRun;
use crate::platform::FRAMES_BEFORE_LONG_STEP;

pub struct InlineLesson {
    /// `None` when the lesson is over.
    run: Option<LessonRun>,
    /// Frames since the last step.
    waited: u32,
}

impl InlineLesson {
    pub fn new(run: LessonRun) -> InlineLesson {
        InlineLesson { run: Some(run), waited: 0 }
    }
}

impl LessonBackend for InlineLesson {
    fn advance(&mut self) {
        let Some(run) = &mut self.run else { return };
        if run.is_next_step_long() && self.waited < FRAMES_BEFORE_LONG_STEP {
            self.waited += 1;
            return;
        }
        self.waited = 0;
        if !run.advance() {
            // The window learns from the abandoned queue that nothing follows.
            self.run = None;
        }
    }

    fn needs_frames(&self) -> bool {
        self.run.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lesson_backend::{InputDevice, LessonCommand, LessonConfig, LessonEvent};
    use std::collections::BTreeMap;
    use std::sync::Arc;
    use std::time::{Duration, Instant};
    use typodont_exercise::record::FILE_NAME;
    use typodont_exercise::scenario;
    use typodont_exercise::scenario::ResolveMode;
    use typodont_exercise::session::Input;
    use typodont_formats::Library;
    use typodont_formats::diagnostic::SourceText;
    use typodont_lesson::{InterruptedSession, SessionSeed};
    use typodont_report::Templates;
    use typodont_report::bundle::{BundleFolder, VerificationOutcome, verify};

    /// Bytes at the end of a recording without which it has no end.
    const END_BYTES: usize = 300;

    #[test]
    fn a_lesson_within_frames_makes_a_bundle_in_memory_that_holds() {
        // Aim: a page without threads and folders gives the same evidence. Method: a lesson with coarse voxels, advanced as
        // frames do, is ended by its trainee after the first tick; nothing is done before the screen could say so.
        let text =
            include_str!("../../scenarios/5-grinding.json").replace("\"spacing_mm\": 0.1", "\"spacing_mm\": 0.2");
        let source = SourceText::new("coarse.json", text);
        let scenario = scenario::resolve(source, &Library::shipped(), ResolveMode::MakeWorkpiece).unwrap();
        let config = LessonConfig {
            scenario: Arc::new(scenario),
            seed: SessionSeed::given(1),
            participant: "P01".into(),
            out: None,
            templates: Templates::shipped(),
            started: jiff::Timestamp::UNIX_EPOCH,
            input_device: InputDevice::Mouse,
            second: None,
            digests: BTreeMap::new(),
            is_kept: true,
            wake: Arc::new(|| ()),
        };
        let (mut client, run) = LessonRun::new(config, typodont_audio::sound_channel().0);
        let mut lesson = InlineLesson::new(run);
        for _ in 0..FRAMES_BEFORE_LONG_STEP {
            lesson.advance();
            assert!(client.next_event().is_none(), "a long step that no screen has announced");
        }
        let begun = Instant::now();
        let (mut is_aborted, mut bundle) = (false, None);
        while lesson.needs_frames() {
            assert!(begun.elapsed() < Duration::from_secs(300), "the lesson does not end");
            lesson.advance();
            if client.snapshot().is_some() && !is_aborted {
                is_aborted = client.send(LessonCommand::Input(Input::Abort));
            }
            while let Some(event) = client.next_event() {
                match event {
                    LessonEvent::Finished(finished) => bundle = Some(finished),
                    LessonEvent::Failed(why) => panic!("{why}"),
                    _ => {}
                }
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        let bundle = bundle.expect("the lesson has a bundle");
        let BundleFolder::InMemory { name, files } = &bundle else { panic!("the bundle is on the disk") };
        let verification = verify(&bundle, &[Templates::shipped()]).unwrap();
        assert_eq!(verification.outcome(), VerificationOutcome::Verified, "{:?}", verification.complaints);

        // A page that was closed before the recording's end has kept the rest of it.
        let whole = &files[FILE_NAME];
        let kept =
            InterruptedSession::kept(name, whole[..whole.len() - END_BYTES].to_vec()).expect("a person's session");
        assert_eq!((kept.scenario_id.as_str(), kept.participant.as_str()), ("5-grinding", "P01"));
        let finished = kept.finish(&Templates::shipped(), &mut |_| ()).unwrap();
        assert!(!finished.remarks.is_empty(), "the end of the recording is not missed");
        let verification = verify(&finished.folder, &[Templates::shipped()]).unwrap();
        assert_eq!(verification.outcome(), VerificationOutcome::Verified, "{:?}", verification.complaints);
        assert_eq!(InterruptedSession::kept(name, whole[..20].to_vec()), None);
    }
}
