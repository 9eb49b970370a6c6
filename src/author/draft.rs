//! The text that is being edited, with the way back.

use super::edit::{self, Unfit};
use serde_json::Value;

/// Steps that can be taken back. A shipped exercise has 5 kB: a megabyte in all.
const STEPS: usize = 200;

/// A text and what it was before.
#[derive(Clone, Debug)]
pub struct Draft {
    text: String,
    /// What the text says; of a text that is not JSON what it last said.
    value: Value,
    is_json: bool,
    past: Vec<String>,
    future: Vec<String>,
    /// What the newest step changed: more of the same joins it, so that a drag or a word is one step.
    joins: Option<String>,
}

impl Draft {
    pub fn of(text: impl Into<String>) -> Draft {
        let text = text.into();
        let value = edit::value_of(&text);
        let is_json = value.is_some();
        let (past, future, joins) = (Vec::new(), Vec::new(), None);
        Draft { text, value: value.unwrap_or_default(), is_json, past, future, joins }
    }

    pub fn text(&self) -> &str {
        &self.text
    }

    /// What the text says, or last said while it is not JSON.
    pub fn value(&self) -> &Value {
        &self.value
    }

    /// False while the text can only be mended by hand.
    pub fn is_json(&self) -> bool {
        self.is_json
    }

    /// What stands at a pointer.
    pub fn at(&self, pointer: &str) -> Option<&Value> {
        self.value.pointer(pointer)
    }

    /// Another value at a pointer. Changes of one place in a row are one step to take back.
    pub fn set(&mut self, pointer: &str, value: &Value) -> Result<(), Unfit> {
        self.change(edit::set(&self.text, pointer, value)?, Some(pointer));
        Ok(())
    }

    pub fn remove(&mut self, pointer: &str) -> Result<(), Unfit> {
        self.change(edit::remove(&self.text, pointer)?, None);
        Ok(())
    }

    pub fn push(&mut self, list: &str, value: &Value) -> Result<(), Unfit> {
        self.change(edit::push(&self.text, list, value)?, None);
        Ok(())
    }

    pub fn swap(&mut self, list: &str, a: usize, b: usize) -> Result<(), Unfit> {
        self.change(edit::swap(&self.text, list, a, b)?, None);
        Ok(())
    }

    /// Several values as one step.
    pub fn set_all(&mut self, name: &str, values: &[(String, Value)]) -> Result<(), Unfit> {
        let text = values.iter().try_fold(self.text.clone(), |text, (at, value)| edit::set(&text, at, value))?;
        self.change(text, Some(name));
        Ok(())
    }

    /// The whole text anew, as somebody types it: letter after letter of a line is one step.
    pub fn write(&mut self, text: String) {
        let lines = |text: &str| text.bytes().filter(|byte| *byte == b'\n').count();
        let is_new_line = lines(&text) != lines(&self.text);
        self.change(text, Some("text"));
        if is_new_line {
            self.joins = None;
        }
    }

    /// The whole text anew, as it comes from elsewhere: a step of its own.
    pub fn replace(&mut self, text: String) {
        self.change(text, None);
    }

    pub fn undo(&mut self) {
        if let Some(text) = self.past.pop() {
            let left = self.put(text);
            self.future.push(left);
        }
    }

    pub fn redo(&mut self) {
        if let Some(text) = self.future.pop() {
            let left = self.put(text);
            self.past.push(left);
        }
    }

    pub fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    pub fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }

    fn change(&mut self, text: String, joins: Option<&str>) {
        if text == self.text {
            return;
        }
        let is_more_of_it = joins.is_some() && self.joins.as_deref() == joins;
        let left = self.put(text);
        if !is_more_of_it {
            self.past.push(left);
            if self.past.len() > STEPS {
                self.past.remove(0);
            }
        }
        self.future.clear();
        self.joins = joins.map(str::to_string);
    }

    /// Puts a text in place; gives the one that stood there.
    fn put(&mut self, text: String) -> String {
        let value = edit::value_of(&text);
        self.is_json = value.is_some();
        self.value = value.unwrap_or(std::mem::take(&mut self.value));
        self.joins = None;
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
        let mut draft = Draft::of(text);
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
        let mut draft = Draft::of("a");
        for text in ["ab", "abc", "abc\n", "abc\nd", "abc\nde"] {
            draft.write(text.into());
        }
        draft.replace("theirs".into());
        draft.write("theirs!".into());
        let mut back = Vec::new();
        while draft.can_undo() {
            draft.undo();
            back.push(draft.text().to_string());
        }
        assert_eq!(back, ["theirs", "abc\nde", "abc\n", "a"]);
    }

    #[test]
    fn while_the_text_is_broken_what_it_last_said_stays() {
        let mut draft = Draft::of("{ \"a\": 1 }");
        draft.write("{ \"a\": ".into());
        assert!(!draft.is_json());
        assert_eq!(draft.at("/a"), Some(&json!(1)));
        assert_eq!(draft.set("/a", &json!(2)), Err(Unfit::NotJson));
        draft.undo();
        assert!(draft.is_json());
    }
}
