//! IRIs of xAPI activities and extensions.

/// Namespace of typodont's extensions and metrics. The address need not resolve.
const IRI_BASE: &str = "https://github.com/typodont/typodont/xapi";

/// Percent-encodes arbitrary text as one path segment: every byte except ASCII letters, digits and `-._~`.
pub fn percent_encode(text: &str) -> String {
    let keep = |b: u8| b.is_ascii_alphanumeric() || b"-_.~".contains(&b);
    text.bytes().map(|b| if keep(b) { char::from(b).to_string() } else { format!("%{b:02X}") }).collect()
}

/// Returns the IRI of a typodont extension.
pub fn extension(name: &str) -> String {
    format!("{IRI_BASE}/{}", percent_encode(name))
}

/// Returns the IRI of a metric.
pub fn metric(name: &str) -> String {
    format!("{IRI_BASE}/metric/{}", percent_encode(name))
}

/// Parses the home page of a school's accounts: an absolute http(s) URL without user, query or fragment. Trailing
/// slashes are removed.
///
/// # Errors
///
/// Returns a message when `text` is not such a URL.
pub fn parse_home_page(text: &str) -> Result<String, String> {
    let wrong = || "the home page must be an address such as https://school.example.edu".to_string();
    let url = url::Url::parse(text).map_err(|_| wrong())?;
    let is_plain =
        url.query().is_none() && url.fragment().is_none() && url.username().is_empty() && url.password().is_none();
    match matches!(url.scheme(), "http" | "https") && url.host().is_some() && is_plain {
        true => Ok(url.as_str().trim_end_matches('/').to_string()),
        false => Err(wrong()),
    }
}
