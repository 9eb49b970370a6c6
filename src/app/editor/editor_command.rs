//! Commands of the author's screen.

use crate::editor::editor_section::EditorSection;
use crate::editor::preview::PreviewMode;
use serde_json::Value;
use std::path::PathBuf;
use typodont_core::frame::Vec3;

/// Command of the author's screen.
#[derive(Clone, Debug)]
pub enum EditorCommand {
    ShowSection(EditorSection),
    SetValue(String, Value),
    RemoveValue(String),
    /// Adds a list entry, or an optional value, with its default content.
    AddDefault(String),
    PushEntry(String, Value),
    SwapEntries(String, usize, usize),
    /// Sets the FDI number (ISO 3950) of the selected tooth.
    SetToothNumber(u8),
    /// Selects a decay: index of the tooth, and index in that tooth's list.
    SelectDecay(usize, usize),
    /// Places the selected decay: point on the surface, tooth space, mm, and the outward direction there.
    PlaceDecay(Vec3, Vec3),
    /// Moves the three slices to a point, tooth space, mm.
    MoveSlices(Vec3),
    /// Draws the random choices of the exercise again, with the next seed.
    Reroll,
    SetPreviewMode(PreviewMode),
    ShowSurroundings(bool),
    ReplaceText(String),
    Undo,
    Redo,
    Save,
    /// Opens or closes the dialog that asks for a path.
    ShowSaveAs(bool),
    /// The path to save to as it is being typed.
    TypePath(String),
    SaveAs(PathBuf),
    /// Saves even if the file exists.
    SaveOverExisting(PathBuf),
    /// Takes over the text that was changed elsewhere.
    ReloadFromDisk,
    /// Keeps the text of this screen, which later replaces the one changed elsewhere.
    KeepLocal,
    Check,
    CloseCheck,
    TestRun,
    Leave,
}
