//! XML text from elements.

/// Element with its attributes in order, and its text or its children.
pub struct Element {
    name: &'static str,
    attributes: Vec<(&'static str, String)>,
    text: Option<String>,
    children: Vec<Element>,
}

impl Element {
    pub fn new(name: &'static str) -> Element {
        Element { name, attributes: Vec::new(), text: None, children: Vec::new() }
    }

    /// Element that contains only text.
    pub fn with_text(name: &'static str, text: &str) -> Element {
        Element { text: Some(text.to_string()), ..Element::new(name) }
    }

    pub fn attribute(mut self, name: &'static str, value: impl Into<String>) -> Element {
        self.attributes.push((name, value.into()));
        self
    }

    pub fn child(mut self, child: Element) -> Element {
        self.children.push(child);
        self
    }

    pub fn children(mut self, children: impl IntoIterator<Item = Element>) -> Element {
        self.children.extend(children);
        self
    }

    /// The document that has this element as its root.
    pub fn into_document(self) -> String {
        let mut text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".to_string();
        self.write(&mut text, 0);
        text
    }

    fn write(&self, text: &mut String, depth: usize) {
        let indent = "  ".repeat(depth);
        *text += &format!("{indent}<{}", self.name);
        for (name, value) in &self.attributes {
            *text += &format!(" {name}=\"{}\"", escape(value));
        }
        if let Some(only) = &self.text {
            *text += &format!(">{}</{}>\n", escape(only), self.name);
        } else if self.children.is_empty() {
            *text += "/>\n";
        } else {
            *text += ">\n";
            self.children.iter().for_each(|child| child.write(text, depth + 1));
            *text += &format!("{indent}</{}>\n", self.name);
        }
    }
}

/// Text for the content of an element or a value in double quotes; characters that XML 1.0 forbids become U+FFFD.
fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped += "&amp;",
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '"' => escaped += "&quot;",
            '\t' | '\n' | '\r' => escaped += &format!("&#{};", c as u32),
            '\0'..='\x1f' | '\u{fffe}' | '\u{ffff}' => escaped.push('\u{fffd}'),
            other => escaped.push(other),
        }
    }
    escaped
}
