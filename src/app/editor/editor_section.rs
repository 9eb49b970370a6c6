//! Sections of the author's screen.

/// A section: the part of an exercise that the middle of the screen shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EditorSection {
    Exercise,
    Tooth,
    Decay,
    Tissues,
    Instruments,
    Stages,
    Zones,
    Marks,
    Text,
}

impl EditorSection {
    /// The section in which the value at a JSON pointer is shown.
    pub fn of_pointer(pointer: &str) -> EditorSection {
        let is_in = |name: &str| pointer.contains(name);
        match pointer.split('/').nth(1).unwrap_or_default() {
            "scene" if is_in("/decay") || is_in("/stains") => EditorSection::Decay,
            "scene" => EditorSection::Tooth,
            "tissues" | "new_tissues" | "stiffness_ratio" | "carving" | "vibration" => EditorSection::Tissues,
            "instruments" => EditorSection::Instruments,
            "stages" => EditorSection::Stages,
            "zones" | "limits" => EditorSection::Zones,
            "rubric" | "measures" => EditorSection::Marks,
            _ => EditorSection::Exercise,
        }
    }
}
