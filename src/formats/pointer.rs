//! JSON pointers (RFC 6901), such as `/stages/0/title`.

use std::fmt;

/// Returns the pointer to a member or an element of the value at `pointer`.
pub fn child(pointer: &str, name: impl fmt::Display) -> String {
    format!("{pointer}/{}", escape(&name.to_string()))
}

/// Escapes a name for use in a pointer.
pub fn escape(name: &str) -> String {
    name.replace('~', "~0").replace('/', "~1")
}

/// Returns the unescaped names on the path of a pointer; none for the whole file.
pub fn tokens(pointer: &str) -> impl Iterator<Item = String> {
    pointer.split('/').skip(1).map(unescape)
}

/// Returns the parent's pointer and the last name; `None` for the whole file.
pub fn split(pointer: &str) -> Option<(&str, String)> {
    let (parent, name) = pointer.rsplit_once('/')?;
    Some((parent, unescape(name)))
}

fn unescape(name: &str) -> String {
    name.replace("~1", "/").replace("~0", "~")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_found_again() {
        let odd = ["a/b", "m~n", "~1", "", "ö ü"];
        let pointer = odd.iter().fold(String::new(), |pointer, name| child(&pointer, name));
        assert_eq!(tokens(&pointer).collect::<Vec<_>>(), odd);
        let (parent, name) = split(&pointer).unwrap();
        assert_eq!((tokens(parent).count(), name.as_str()), (odd.len() - 1, "ö ü"));
        assert_eq!((tokens("").count(), split("")), (0, None));
    }
}
