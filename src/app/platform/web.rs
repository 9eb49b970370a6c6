//! A page in a browser: settings in the page's own storage, bundles in memory and as downloads.

use super::LogSink;
use crate::user_folder::UserFolder;
use std::path::PathBuf;
use typodont_report::bundle::{BundleFolder, REPORT_FILE};
use wasm_bindgen::{JsCast, JsValue};

/// True for a page in a browser: it has no folders, and one device, the pointer.
pub const IS_PAGE: bool = true;

/// Key of the settings in the page's own storage.
const SETTINGS_KEY: &str = "typodont.settings";

/// Key of the results of earlier sessions in the page's own storage.
const HISTORY_KEY: &str = "typodont.history";

/// Part of the page's address after the `?` that asks for the state log in the browser's console.
const LOG_QUERY: &str = "state-log";

/// A page has no folder for the user's own files.
pub fn config_folder() -> Option<PathBuf> {
    None
}

/// A page has no folder for documents.
pub fn documents_folder() -> Option<PathBuf> {
    None
}

/// URL of a bundle's report, which lives as long as the page.
pub fn report_url(bundle: &BundleFolder) -> Option<String> {
    object_url(&bundle.read(REPORT_FILE).ok()?, "text/html;charset=utf-8").ok()
}

/// Lets the page ask, before it is left, whether work is to be lost (`page/start.js` in the crate `web`).
pub fn set_unsaved_work(is_unsaved: bool) {
    const MARK: &str = "data-unsaved";
    let root = web_sys::window().and_then(|window| window.document()).and_then(|document| document.document_element());
    let Some(root) = root else { return };
    let _ = match is_unsaved {
        true if root.has_attribute(MARK) => Ok(()),
        true => root.set_attribute(MARK, ""),
        false => root.remove_attribute(MARK),
    };
}

/// Lets the browser save a bundle as one ZIP file; returns a complaint if that fails.
pub fn download(bundle: &BundleFolder) -> Option<String> {
    let folder = bundle.name().into_owned();
    let saved = bundle.to_zip().and_then(|bytes| {
        save_as(&format!("{folder}.zip"), &bytes, "application/zip").map_err(|error| format!("{error:?}"))
    });
    saved.err().map(|why| format!("{folder}.zip: unwritable-file: {why}"))
}

fn save_as(name: &str, bytes: &[u8], media_type: &str) -> Result<(), JsValue> {
    let document = web_sys::window().and_then(|window| window.document()).ok_or("no document")?;
    let link: web_sys::HtmlAnchorElement = document.create_element("a")?.dyn_into()?;
    let url = object_url(bytes, media_type)?;
    link.set_href(&url);
    link.set_download(name);
    link.click();
    Ok(())
}

/// URL under which the page keeps bytes.
fn object_url(bytes: &[u8], media_type: &str) -> Result<String, JsValue> {
    let parts = js_sys::Array::of1(&js_sys::Uint8Array::from(bytes));
    let options = web_sys::BlobPropertyBag::new();
    options.set_type(media_type);
    let blob = web_sys::Blob::new_with_u8_array_sequence_and_options(&parts, &options)?;
    web_sys::Url::create_object_url_with_blob(&blob)
}

/// Name of the place where settings are kept, for messages.
pub fn settings_place(_: &UserFolder) -> String {
    format!("localStorage/{SETTINGS_KEY}")
}

/// Text of the settings; `None` if none are kept, or if the browser keeps nothing for this page.
pub fn read_settings(_: &UserFolder) -> Option<String> {
    read(SETTINGS_KEY)
}

/// Keeps the text of the settings; returns the reason if that fails.
pub fn write_settings(_: &UserFolder, text: &str) -> Option<String> {
    write(SETTINGS_KEY, text)
}

/// Text of the results of earlier sessions; `None` if none are kept.
pub fn read_history() -> Option<String> {
    read(HISTORY_KEY)
}

/// Keeps the text of the results; returns the reason if that fails.
pub fn write_history(text: &str) -> Option<String> {
    write(HISTORY_KEY, text)
}

fn read(key: &str) -> Option<String> {
    storage()?.get_item(key).ok().flatten()
}

fn write(key: &str, text: &str) -> Option<String> {
    let kept = storage().map(|storage| storage.set_item(key, text));
    (!matches!(kept, Some(Ok(())))).then(|| "the browser keeps nothing for this page".to_string())
}

fn storage() -> Option<web_sys::Storage> {
    web_sys::window()?.local_storage().ok().flatten()
}

/// Locale of the user, from the browser's preferred language.
pub fn locale() -> Option<String> {
    web_sys::window()?.navigator().language()
}

/// Writer of the state log's lines, to the browser's console; `None` unless the page's address asks for it.
pub fn open_log() -> Option<LogSink> {
    let query = web_sys::window()?.location().search().ok()?;
    let write = |line: &str| web_sys::console::log_1(&JsValue::from_str(&format!("typodont: {line}")));
    query.contains(LOG_QUERY).then(|| Box::new(write) as LogSink)
}
