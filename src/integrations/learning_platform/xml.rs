//! XML text from elements.

/// Element with its attributes in order, and its content.
pub struct Element {
    name: &'static str,
    attributes: Vec<(&'static str, String)>,
    content: Vec<Content>,
}

enum Content {
    Element(Element),
    Text(String),
}

impl Element {
    pub fn new(name: &'static str) -> Element {
        Element { name, attributes: Vec::new(), content: Vec::new() }
    }

    /// Element that contains only text.
    pub fn with_text(name: &'static str, text: &str) -> Element {
        let mut element = Element::new(name);
        element.content.push(Content::Text(text.to_string()));
        element
    }

    pub fn attribute(mut self, name: &'static str, value: impl Into<String>) -> Element {
        self.attributes.push((name, value.into()));
        self
    }

    pub fn child(mut self, child: Element) -> Element {
        self.content.push(Content::Element(child));
        self
    }

    pub fn children(mut self, children: impl IntoIterator<Item = Element>) -> Element {
        self.content.extend(children.into_iter().map(Content::Element));
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
        match self.content.as_slice() {
            [] => *text += "/>\n",
            [Content::Text(only)] => *text += &format!(">{}</{}>\n", escape(only), self.name),
            several => {
                *text += ">\n";
                for content in several {
                    match content {
                        Content::Element(element) => element.write(text, depth + 1),
                        Content::Text(part) => *text += &format!("{indent}  {}\n", escape(part)),
                    }
                }
                *text += &format!("{indent}</{}>\n", self.name);
            }
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
