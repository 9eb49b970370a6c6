//! The text that is being edited, with undo and redo.

use super::edit::{self, EditError};
use serde_json::Value;

/// Maximum number of steps that can be undone. A shipped exercise has 5 kB, so that all steps take about 1 MB.
const MAX_UNDO_STEPS: usize = 200;

/// A text with its earlier versions.
#[derive(Clone, Debug)]
pub struct ExerciseDraft {
    text: String,
    /// Value of the text; while the text is not JSON, its last value.
    value: Value,
    is_json: bool,
    undo_stack: Vec<String>,
    redo_stack: Vec<String>,
    /// Key of the latest step. A further change with the same key is merged into this step, so that a drag or a typed
    /// word is one step.
    merge_key: Option<String>,
}

impl ExerciseDraft {
    pub fn new(text: impl Into<String>) -> ExerciseDraft {
        let text = text.into();
        let value = edit::parse_value(&text);
        let is_json = value.is_some();
        let (undo_stack, redo_stack, merge_key) = (Vec::new(), Vec::new(), None);
        ExerciseDraft { text, value: value.unwrap_or_default(), is_json, undo_stack, redo_stack, merge_key }
    }

    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns the value of the text; while the text is not JSON, its last value.
    pub fn value(&self) -> &Value {
        &self.value
    }

    /// Returns false while the text is not JSON and can only be corrected by hand.
    pub fn is_json(&self) -> bool {
        self.is_json
    }

    /// Returns the value at a pointer.
    pub fn value_at(&self, pointer: &str) -> Option<&Value> {
        self.value.pointer(pointer)
    }

    /// Sets the value at a pointer. Consecutive changes at the same pointer are undone as one step.
    ///
    /// # Errors
    /// Returns an error if the text is not JSON, or if there is no place for the value.
    pub fn set(&mut self, pointer: &str, value: &Value) -> Result<(), EditError> {
        self.change(edit::set(&self.text, pointer, value)?, Some(pointer));
        Ok(())
    }

    /// Removes a key or an entry of a list. A missing one changes nothing.
    ///
    /// # Errors
    /// Returns an error if the text is not JSON, or if the pointer is that of the whole text.
    pub fn remove(&mut self, pointer: &str) -> Result<(), EditError> {
        self.change(edit::remove(&self.text, pointer)?, None);
        Ok(())
    }

    /// Appends an entry to a list; a missing list is created.
    ///
    /// # Errors
    /// Returns an error if the text is not JSON, or if the pointer is not that of a list.
    pub fn push(&mut self, list: &str, value: &Value) -> Result<(), EditError> {
        self.change(edit::push(&self.text, list, value)?, None);
        Ok(())
    }

    /// Exchanges two entries of a list.
    ///
    /// # Errors
    /// Returns an error if the text is not JSON, or if the list or one of the entries does not exist.
    pub fn swap(&mut self, list: &str, a: usize, b: usize) -> Result<(), EditError> {
        self.change(edit::swap(&self.text, list, a, b)?, None);
        Ok(())
    }

    /// Sets several values as one step. Consecutive changes with the same `name` are undone as one step.
    ///
    /// # Errors
    /// Returns an error if the text is not JSON, or if there is no place for one of the values; the text is then
    /// unchanged.
    pub fn set_all(&mut self, name: &str, values: &[(String, Value)]) -> Result<(), EditError> {
        let text = values.iter().try_fold(self.text.clone(), |text, (at, value)| edit::set(&text, at, value))?;
        self.change(text, Some(name));
        Ok(())
    }

    /// Replaces the whole text while a person types. Consecutive changes within a line are one step.
    pub fn type_text(&mut self, text: String) {
        let lines = |text: &str| text.bytes().filter(|byte| *byte == b'\n').count();
        let is_new_line = lines(&text) != lines(&self.text);
        self.change(text, Some("text"));
        if is_new_line {
            self.merge_key = None;
        }
    }

    /// Replaces the whole text from another source, as a separate step.
    pub fn replace(&mut self, text: String) {
        self.change(text, None);
    }

    pub fn undo(&mut self) {
        if let Some(text) = self.undo_stack.pop() {
            let left = self.swap_text(text);
            self.redo_stack.push(left);
        }
    }

    pub fn redo(&mut self) {
        if let Some(text) = self.redo_stack.pop() {
            let left = self.swap_text(text);
            self.undo_stack.push(left);
        }
    }

    pub fn can_undo(&self) -> bool {
        !self.undo_stack.is_empty()
    }

    pub fn can_redo(&self) -> bool {
        !self.redo_stack.is_empty()
    }

    fn change(&mut self, text: String, merge_key: Option<&str>) {
        if text == self.text {
            return;
        }
        let is_merged = merge_key.is_some() && self.merge_key.as_deref() == merge_key;
        let left = self.swap_text(text);
        if !is_merged {
            self.undo_stack.push(left);
            if self.undo_stack.len() > MAX_UNDO_STEPS {
                self.undo_stack.remove(0);
            }
        }
        self.redo_stack.clear();
        self.merge_key = merge_key.map(str::to_string);
    }

    /// Replaces the text and returns the previous text.
    fn swap_text(&mut self, text: String) -> String {
        let value = edit::parse_value(&text);
        self.is_json = value.is_some();
        self.value = value.unwrap_or(std::mem::take(&mut self.value));
        self.merge_key = None;
        std::mem::replace(&mut self.text, text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn the_way_back_ends_at_the_very_bytes_and_leads_forth_again() {
        let text = "{ \"a\":1,\"b\" : [1 , 2] }";
        let mut draft = ExerciseDraft::new(text);
        draft.set("/a", &json!(2)).unwrap();
        draft.set("/a", &json!(3)).unwrap();
        draft.push("/b", &json!(3)).unwrap();
        let after = draft.text().to_string();
        draft.undo();
        assert_eq!(draft.text(), "{ \"a\":3,\"b\" : [1 , 2] }");
        draft.undo();
        assert_eq!(draft.text(), text, "two changes of one place are one step");
        assert!(!draft.can_undo());
        draft.redo();
        draft.redo();
        assert_eq!(draft.text(), after);
    }

    #[test]
    fn typing_is_taken_back_line_by_line_and_what_came_from_elsewhere_by_itself() {
        let mut draft = ExerciseDraft::new("a");
        for text in ["ab", "abc", "abc\n", "abc\nd", "abc\nde"] {
            draft.type_text(text.into());
        }
        draft.replace("theirs".into());
        draft.type_text("theirs!".into());
        let mut back = Vec::new();
        while draft.can_undo() {
            draft.undo();
            back.push(draft.text().to_string());
        }
        assert_eq!(back, ["theirs", "abc\nde", "abc\n", "a"]);
    }

    #[test]
    fn while_the_text_is_broken_what_it_last_said_stays() {
        let mut draft = ExerciseDraft::new("{ \"a\": 1 }");
        draft.type_text("{ \"a\": ".into());
        assert!(!draft.is_json());
        assert_eq!(draft.value_at("/a"), Some(&json!(1)));
        assert_eq!(draft.set("/a", &json!(2)), Err(EditError::NotJson));
        draft.undo();
        assert!(draft.is_json());
    }
}
