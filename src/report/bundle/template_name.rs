//! The digest of its template that a page names, so that a changed digest in `session.json` is noticed although the
//! template is not at hand.

/// Beginning and end of the element in which a page names the digest of its template.
const TEMPLATE_NAME: (&str, &str) = ("<meta name=\"typodont-template\" content=\"", "\">");

/// Page that names the digest of its template.
pub(super) fn with_template_name(page: &str, template_sha256: &str) -> String {
    let (begin, end) = TEMPLATE_NAME;
    page.replacen("<head>", &format!("<head>\n{begin}{template_sha256}{end}"), 1)
}

/// Digest of the template as the page names it.
pub(crate) fn named_template(page: &[u8]) -> Option<&[u8]> {
    /// The name is at the beginning of the page.
    const SEARCHED: usize = 4096;
    let start = &page[..page.len().min(SEARCHED)];
    let (begin, end) = (TEMPLATE_NAME.0.as_bytes(), TEMPLATE_NAME.1.as_bytes());
    let at = start.windows(begin.len()).position(|window| window == begin)? + begin.len();
    let length = start[at..].windows(end.len()).position(|window| window == end)?;
    Some(&start[at..at + length])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_a_template_is_found_in_its_page() {
        let page = with_template_name("<html>\n<head>\n<title>a</title>", "ab12");
        assert_eq!(named_template(page.as_bytes()), Some(&b"ab12"[..]));
        assert_eq!(named_template(b"<html><head>"), None);
    }
}
