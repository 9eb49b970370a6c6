//! Commands that screens send to the application.

use crate::camera_preset::CameraPreset;
use crate::editor::EditorCommand;
use crate::lesson_scene::DisplayMode;
use crate::pointer_hand::PointedPlace;
use crate::settings::Settings;
use crate::transfer_function_draft::TransferFunctionDraft;
use std::path::PathBuf;
use typodont_core::touch::Coefficient;
use typodont_core::volume::Label;
use typodont_exercise::session::{AnswerValue, ChartInput};

/// A command of a screen.
#[derive(Clone, Debug)]
pub enum AppCommand {
    /// Selects an exercise by its index in the list.
    SelectExercise(usize),
    /// Moves the selection down the list by this many places; negative is up.
    SelectNextExercise(i32),
    /// Shows the instructions of the selected exercise.
    OpenBriefing,
    OpenFolder(PathBuf),
    /// The text of a field as it is being typed.
    TypeText(TextField, String),
    BackToList,
    /// Shows one of the exercise's pictures of the case, by its index, or none.
    ShowPicture(Option<usize>),
    /// Begins the lesson.
    BeginLesson,
    /// Opens a new exercise at the author's screen.
    NewExercise,
    /// Opens the selected exercise at the author's screen.
    EditExercise,
    /// A command of the author's screen.
    Editor(EditorCommand),
    /// A command of the practice screen; without effect on other screens.
    Practice(PracticeCommand),
    /// A movement of the camera, in a lesson or at the author's screen.
    Camera(CameraCommand),
    OpenReport,
    /// Gives the bundle to the user as one file; only in a page.
    DownloadBundle,
    /// Lets the browser ask for a ZIP file that is to be verified; only in a page.
    ChooseZip,
    /// Lets the browser ask for a device of the chosen kind; only in a page.
    AllowDevice,
    /// Lets the browser ask for the file of an exercise that is to be opened; only in a page.
    ChooseExercise,
    /// Shows the instructions of the exercise whose results are shown again.
    TryAgain,
    /// Scores the interrupted session that the list offers, and makes its bundle.
    FinishInterrupted,
    /// Goes on with the interrupted session that the list offers.
    ResumeInterrupted,
    /// Moves the interrupted session that the list offers aside.
    SetAsideInterrupted,
    ShowShortcuts(bool),
    ShowSettings(bool),
    ApplySettings(Box<Settings>),
    /// Closes the window (asks first if work would be lost), or withdraws that request.
    CloseWindow(bool),
    /// Makes the list ready for the next participant.
    ChangeParticipant,
    /// Opens or closes the question for the supervisor's code.
    AskToLeaveKiosk(bool),
    /// Closes a kiosk if the supervisor's code was typed.
    LeaveKiosk,
}

impl AppCommand {
    /// True for what the user saw or typed in the frame itself: it comes before every other command of that frame.
    pub fn is_of_this_frame(&self) -> bool {
        use PracticeCommand::{RecordView, TypeAnswer};
        matches!(
            self,
            AppCommand::TypeText(..)
                | AppCommand::Editor(EditorCommand::TypePath(_))
                | AppCommand::Practice(TypeAnswer(..) | RecordView(_))
        )
    }
}

/// A text field that belongs to no single lesson.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TextField {
    Participant,
    ExaminerCode,
    SupervisorCode,
    /// Further folder with exercises.
    ExerciseFolder,
}

/// A command of the practice screen, for the running lesson and its questionnaire.
#[derive(Clone, Debug)]
pub enum PracticeCommand {
    SelectInstrument(usize),
    AnswerQuestion(String, AnswerValue),
    /// The answer to a question, by its id, as it is being typed.
    TypeAnswer(String, String),
    /// Records an entry in the periodontal chart, at the site of the instrument.
    AddToChart(ChartInput),
    /// Asks whether the stage is finished; a second time, finishes it.
    FinishStage,
    /// Withdraws the question whether the stage is finished.
    ContinueStage,
    Pause(bool),
    /// Opens or closes the question before aborting the lesson.
    AskToAbort(bool),
    Abort,
    /// Sets one coefficient of a tissue.
    AdjustCoefficient(Label, Coefficient, f32),
    SetDisplayMode(DisplayMode),
    /// Sets a transfer function drawn by the user.
    SetTransferFunction(Box<TransferFunctionDraft>),
    /// Makes the pointer act as the device, or releases it.
    CapturePointer(bool),
    /// Aims the hand at the surface under the pointer; `None` while the pointer is outside the view.
    PointAt(Option<PointedPlace>),
    /// Changes the strength of a press, steps of the mouse wheel.
    ChangeStrength(f32),
    /// Sets the share of the strength with which a pen presses, 0 to 1.
    SetPressure(f32),
    /// Leans the handle further to the right and toward the eye, as shares of its length.
    Lean {
        right: f32,
        near: f32,
    },
    /// Holds the handle upright again.
    HoldUpright,
    /// Sets the direction of a pen, as in [`crate::pointer_hand::PointerHand::pen`].
    SetPenDirection(Option<[f32; 2]>),
    SetDeviceButton {
        bit: u32,
        is_down: bool,
    },
    /// Presses the clutch of an arm, with which the hand moves while the instrument stays, or releases it.
    PressClutch(bool),
    /// Begins the registration of an arm's hand with the picture, or ends it without one.
    RegisterHand(bool),
    /// Takes over that the tip is seen at the cross that is shown.
    TouchCross,
    /// Opens the mouth further by this angle, degrees; negative closes it.
    AdjustMouthOpening(f32),
    SetCamera(CameraPreset),
    /// Passes the view to the recording: width of the image divided by its height.
    RecordView(f32),
    /// The picture was drawn with all edits of the volume so far.
    PictureDrawn,
    RateStatement(String, u8),
    SelectNextStatement(i32),
    /// Submits the questionnaire; asks first if statements are not rated.
    SubmitQuestionnaire,
}

/// A movement of the camera.
#[derive(Clone, Copy, Debug)]
pub enum CameraCommand {
    /// Rotates the camera around the tooth, rad.
    Orbit { right: f32, up: f32 },
    /// Multiplies the camera's distance by this factor.
    Zoom(f32),
    /// Shifts the camera, as shares of the image height.
    Pan { right: f32, up: f32 },
}
