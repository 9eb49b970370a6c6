//! The page's address and the page around it: an exercise to be fetched, and who waits for the result.
//!
//! Takes `?exercise=FILE&participant=CODE&language=xx`. Gives the exercise with the files that it names, and tells the
//! page in whose frame it is of each finished bundle. Never fetches from, or tells, another origin.

use eframe::wasm_bindgen::{JsCast, JsValue};
use js_sys::{JSON, Object, Reflect, Uint8Array};
use std::path::{Component, Path};
use typodont_app::GivenExercise;
use typodont_exercise::scenario::file::ScenarioFile;
use typodont_formats::diagnostic::{Diagnostic, headlines};
use typodont_formats::{Library, decode_text, json};
use typodont_report::bundle::{BundleFolder, SESSION_FILE, sha256};
use wasm_bindgen_futures::JsFuture;
use web_sys::{Response, Url, UrlSearchParams, Window};

/// Version of the messages to the page around this one.
const MESSAGE_VERSION: i32 = 1;

/// Parameters in the page's address.
#[derive(Default)]
pub struct Launch {
    /// Address of the exercise, relative to the page.
    exercise: Option<String>,
    pub participant: String,
    pub language: Option<String>,
}

impl Launch {
    pub fn of(window: &Window) -> Launch {
        let query = window.location().search().unwrap_or_default();
        let Ok(parameters) = UrlSearchParams::new_with_str(&query) else { return Launch::default() };
        Launch {
            exercise: parameters.get("exercise"),
            participant: parameters.get("participant").unwrap_or_default(),
            language: parameters.get("language"),
        }
    }

    /// Fetches the exercise and its files; `None` if the address names no exercise.
    ///
    /// # Errors
    /// A sentence with the file that cannot be had, and the reason.
    pub async fn fetch_exercise(&self, window: &Window) -> Result<Option<GivenExercise>, String> {
        let Some(address) = &self.exercise else { return Ok(None) };
        let from = |error: JsValue| format!("{address}: unreadable-file: {}", reason(&error));
        let page = window.location().href().map_err(from)?;
        let url = Url::new_with_base(address, &page).map_err(from)?;
        if Ok(url.origin()) != window.location().origin() {
            return Err(format!("{address}: outside-folder: an exercise is fetched only from the page's own server"));
        }
        let file =
            Path::new(&url.pathname()).file_name().map_or_else(String::new, |name| name.to_string_lossy().into());
        let bytes = fetch(window, &url.href()).await.map_err(from)?;
        let source = decode_text(&file, bytes).map_err(one)?;
        let written = json::read::<ScenarioFile>(source.clone()).map_err(|found| headlines(&found))?.value;
        let mut library = Library::shipped();
        for name in written.named_files() {
            insert(window, &mut library, &url, &name).await?;
        }
        for name in written.instrument_files(&library) {
            insert(window, &mut library, &url, &name).await?;
        }
        Ok(Some(GivenExercise { source, library }))
    }
}

/// Fetches a file that an exercise names into the library, unless it is shipped. A file that cannot be had is left to the
/// complaints about the exercise, which name the place where it is named.
async fn insert(window: &Window, library: &mut Library, exercise: &Url, name: &str) -> Result<(), String> {
    let is_inside = Path::new(name).components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
    if !is_inside || library.bytes(name).is_ok() {
        return Ok(());
    }
    let encoded = String::from(js_sys::encode_uri_component(name)).replace("%2F", "/");
    // A name such as "https:x" is a file below the exercise, too.
    let url = Url::new_with_base(&format!("./{encoded}"), &exercise.href()).map_err(|error| reason(&error))?;
    if let Ok(bytes) = fetch(window, &url.href()).await {
        library.insert(name, bytes);
    }
    Ok(())
}

async fn fetch(window: &Window, url: &str) -> Result<Vec<u8>, JsValue> {
    let response: Response = JsFuture::from(window.fetch_with_str(url)).await?.dyn_into()?;
    if !response.ok() {
        return Err(format!("the server answers {}", response.status()).into());
    }
    let buffer = JsFuture::from(response.array_buffer()?).await?;
    Ok(Uint8Array::new(&buffer).to_vec())
}

fn one(diagnostic: Diagnostic) -> String {
    headlines(&[diagnostic])
}

/// The reason of an error, without its stack.
fn reason(error: &JsValue) -> String {
    let message = Reflect::get(error, &"message".into()).ok().and_then(|message| message.as_string());
    message.or_else(|| error.as_string()).unwrap_or_else(|| format!("{error:?}"))
}

/// Tells the page in whose frame this one is of a finished bundle: its `session.json`, and the name and SHA-256 of the ZIP
/// file in which the trainee can save it. Only a page of the same origin receives it.
pub fn announce(window: &Window, bundle: &BundleFolder) {
    let Ok(Some(parent)) = window.parent() else { return };
    if parent == *window {
        return;
    }
    // A page that cannot be told does not grade; the trainee has the file.
    if let Ok(message) = result_message(bundle)
        && let Ok(origin) = window.location().origin()
    {
        let _ = parent.post_message(&message, &origin);
    }
}

fn result_message(bundle: &BundleFolder) -> Result<JsValue, JsValue> {
    let session = bundle.read(SESSION_FILE)?;
    let session = JSON::parse(std::str::from_utf8(&session).map_err(|error| error.to_string())?)?;
    let zip =
        object(&[("name", format!("{}.zip", bundle.name()).into()), ("sha256", sha256(&bundle.to_zip()?).into())])?;
    object(&[("typodont", MESSAGE_VERSION.into()), ("event", "result".into()), ("session", session), ("zip", zip)])
}

fn object(entries: &[(&str, JsValue)]) -> Result<JsValue, JsValue> {
    let made = Object::new();
    for (name, value) in entries {
        Reflect::set(&made, &(*name).into(), value)?;
    }
    Ok(made.into())
}
