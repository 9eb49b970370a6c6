//! JSON pointers (RFC 6901): where in a file something stands, such as `/stages/0/title`.

use std::fmt;

/// The pointer to something within what stands at a pointer.
pub fn under(pointer: &str, name: impl fmt::Display) -> String {
    format!("{pointer}/{}", escaped(&name.to_string()))
}

/// A name as pointers write it.
pub fn escaped(name: &str) -> String {
    name.replace('~', "~0").replace('/', "~1")
}

/// The names on the way to what a pointer leads to; none for the whole file.
pub fn names(pointer: &str) -> impl Iterator<Item = String> {
    pointer.split('/').skip(1).map(unescaped)
}

/// The parent's pointer and the last name; `None` for the whole file.
pub fn split(pointer: &str) -> Option<(&str, String)> {
    let (parent, name) = pointer.rsplit_once('/')?;
    Some((parent, unescaped(name)))
}

fn unescaped(name: &str) -> String {
    name.replace("~1", "/").replace("~0", "~")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_found_again() {
        let odd = ["a/b", "m~n", "~1", "", "ö ü"];
        let pointer = odd.iter().fold(String::new(), |pointer, name| under(&pointer, name));
        assert_eq!(names(&pointer).collect::<Vec<_>>(), odd);
        let (parent, name) = split(&pointer).unwrap();
        assert_eq!((names(parent).count(), name.as_str()), (odd.len() - 1, "ö ü"));
        assert_eq!((names("").count(), split("")), (0, None));
    }
}
