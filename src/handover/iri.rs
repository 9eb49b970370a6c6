//! Names of activities and extensions: IRIs.

/// Where our extensions and measures are named; nothing need be found there.
const OURS: &str = "https://github.com/typodont/typodont/xapi";

/// A part of a path, whatever a person wrote: everything but letters, digits and `-._~` as its bytes.
pub fn part(text: &str) -> String {
    let keep = |b: u8| b.is_ascii_alphanumeric() || b"-_.~".contains(&b);
    text.bytes().map(|b| if keep(b) { char::from(b).to_string() } else { format!("%{b:02X}") }).collect()
}

/// The key of one of our extensions.
pub fn extension(name: &str) -> String {
    format!("{OURS}/{}", part(name))
}

/// The key of a measure.
pub fn metric(name: &str) -> String {
    format!("{OURS}/metric/{}", part(name))
}

/// The home page of a school's accounts: an absolute http(s) address, without what follows its path and without a last slash.
pub fn home_page(text: &str) -> Result<String, String> {
    let wrong = || "a home page is an address such as https://school.example.edu".to_string();
    let url = url::Url::parse(text).map_err(|_| wrong())?;
    let is_plain =
        url.query().is_none() && url.fragment().is_none() && url.username().is_empty() && url.password().is_none();
    match matches!(url.scheme(), "http" | "https") && url.host().is_some() && is_plain {
        true => Ok(url.as_str().trim_end_matches('/').to_string()),
        false => Err(wrong()),
    }
}
