//! A page in a browser: settings in the page's own storage, bundles in memory and as downloads.

use super::{DeviceAnswer, GamepadState, LogSink, Pen};
use crate::given_file::{GivenContent, GivenFile};
use crate::inbox::Inbox;
use crate::user_folder::UserFolder;
use eframe::egui;
use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::sync::mpsc::Sender;
use typodont_devices::hid::HidMatch;
use typodont_lesson::InterruptedSession;
use typodont_report::bundle::{BundleFolder, REPORT_FILE, RecordingChange};
use wasm_bindgen::prelude::Closure;
use wasm_bindgen::{JsCast, JsValue};
use wasm_bindgen_futures::{JsFuture, spawn_local};

/// True for a page in a browser: it has no folders, and only devices that the browser passes on.
pub const IS_PAGE: bool = true;

/// Key of the settings in the page's own storage.
const SETTINGS_KEY: &str = "typodont.settings";

/// Key of the results of earlier sessions in the page's own storage.
const HISTORY_KEY: &str = "typodont.history";

/// Beginning of the keys of exercises' unsaved texts in the page's own storage.
const DRAFT_KEY: &str = "typodont.draft.";

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

/// True if exercises can be opened and written here: not within another page, which would receive their results.
pub fn opens_exercises() -> bool {
    web_sys::window().is_some_and(|window| matches!(window.parent(), Ok(Some(parent)) if parent == window))
}

/// Lets the browser save a text as a file; returns a complaint if that fails.
pub fn download_text(name: &str, text: &str) -> Option<String> {
    let saved = save_as(name, text.as_bytes(), "application/json");
    saved.err().map(|error| format!("{name}: unwritable-file: {}", reason(&error)))
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

/// Maximum size of a file that is read into the page, bytes; the largest bundles have some 50 MB.
const FILE_MAX: f64 = (400 << 20) as f64;

/// Id of the element by which the browser offers files.
const FILE_INPUT: &str = "typodont-file";

/// Lets the browser ask the user for a file whose name ends as told, such as `.zip`.
pub fn ask_for_file(ending: &str, inbox: Inbox<GivenFile>, ctx: &egui::Context) {
    if let Err(error) = offer_files(ending, inbox.clone(), ctx.clone()) {
        let why = format!("unreadable-file: the browser offers no files ({}); drop the file here", reason(&error));
        inbox.put(GivenFile { name: String::new(), content: GivenContent::Read(Err(why)), left_out: 0 }, ctx);
    }
}

fn offer_files(ending: &str, inbox: Inbox<GivenFile>, ctx: egui::Context) -> Result<(), JsValue> {
    let document = web_sys::window().and_then(|window| window.document()).ok_or("no document")?;
    // The element of a question that was not answered is still there.
    if let Some(earlier) = document.get_element_by_id(FILE_INPUT) {
        earlier.remove();
    }
    let input: web_sys::HtmlInputElement = document.create_element("input")?.dyn_into()?;
    input.set_id(FILE_INPUT);
    input.set_type("file");
    input.set_accept(ending);
    input.set_hidden(true);
    document.body().ok_or("no body")?.append_child(&input)?;
    let offered = input.clone();
    let chosen = Closure::once_into_js(move || {
        offered.remove();
        if let Some(file) = offered.files().and_then(|files| files.get(0)) {
            spawn_local(async move {
                let content = GivenContent::Read(read(&file).await);
                inbox.put(GivenFile { name: file.name(), content, left_out: 0 }, &ctx);
            });
        }
    });
    input.set_onchange(Some(chosen.unchecked_ref()));
    input.click();
    Ok(())
}

/// Bytes of a file that the user chose, or the reason why they cannot be read.
async fn read(file: &web_sys::File) -> Result<Vec<u8>, String> {
    if file.size() > FILE_MAX {
        return Err(format!("too-large: the file has {:.0} MB; the page reads up to 400 MB", file.size() / 1e6));
    }
    let buffer = JsFuture::from(file.array_buffer()).await;
    buffer
        .map(|buffer| js_sys::Uint8Array::new(&buffer).to_vec())
        .map_err(|error| format!("unreadable-file: {}; choose the file again", reason(&error)))
}

/// Lets the browser ask the user for a device of one of these kinds. It does so only for a moment after a click.
pub fn ask_for_device(kinds: &[HidMatch], inbox: Inbox<DeviceAnswer>, ctx: &egui::Context) {
    let asked = call_hid("ask", &js_sys::Array::of1(&hid_kinds_js(kinds)));
    let Some(promise) = asked.and_then(|asked| asked.dyn_into::<js_sys::Promise>().ok()) else {
        return inbox.put(Err("page/hid.js is missing".into()), ctx);
    };
    let ctx = ctx.clone();
    spawn_local(async move {
        let answer = JsFuture::from(promise).await;
        inbox.put(answer.map(|name| name.as_string()).map_err(|error| reason(&error)), &ctx);
    });
}

/// Kinds of devices, as `page/hid.js` takes them.
pub fn hid_kinds_js(kinds: &[HidMatch]) -> JsValue {
    let kind = |kind: &HidMatch| {
        let HidMatch { vendor, products, usage } = kind;
        serde_json::json!({ "vendor": vendor, "products": products, "usage": usage.map(|(page, usage)| [page, usage]) })
    };
    let text = kinds.iter().map(kind).collect::<serde_json::Value>().to_string();
    js_sys::JSON::parse(&text).unwrap_or_default()
}

/// Calls a function of `page/hid.js` in the crate `web`; `None` in a page without it.
pub fn call_hid(function: &str, arguments: &js_sys::Array) -> Option<JsValue> {
    call_script("typodontHid", function, arguments)
}

/// Reads a file that was dropped into the page, with `left_out` others.
pub fn receive_dropped(file: egui::DroppedFileHandle, left_out: usize, inbox: Inbox<GivenFile>, ctx: &egui::Context) {
    let ctx = ctx.clone();
    spawn_local(async move {
        let name = file.path().to_string_lossy().into_owned();
        let read = file.bytes_async().await;
        let content = GivenContent::Read(read.map_err(|why| format!("unreadable-file: {why}; drop the file again")));
        inbox.put(GivenFile { name, content, left_out }, &ctx);
    });
}

/// The message of an error, without its stack.
pub fn reason(error: &JsValue) -> String {
    let message = js_sys::Reflect::get(error, &"message".into()).ok().and_then(|message| message.as_string());
    message.or_else(|| error.as_string()).unwrap_or_else(|| format!("{error:?}"))
}

/// Tells other pages of the same origin that a session runs in this one.
pub fn begin_keeping(session: &str) {
    call_keeper("begin", [session.into()]);
}

/// Keeps a change of a running session's recording in the browser, in case the page is closed or crashes.
pub fn keep_change(session: &str, number: u32, change: &RecordingChange) {
    let bytes = js_sys::Uint8Array::from(&change.bytes[..]);
    call_keeper("keep", [session.into(), number.into(), (change.offset as f64).into(), bytes.into()]);
}

/// Deletes the kept recording of a session whose bundle is saved, or which is set aside.
pub fn forget_recording(session: &str) {
    call_keeper("forget", [session.into()]);
}

/// Deletes the kept recording of a session that goes on as another one, once that is kept.
pub fn replace_recording(former: &str) {
    call_keeper("replace", [former.into()]);
}

/// The reason why a change could not be kept; it is told once.
pub fn keeping_failure() -> Option<String> {
    call_keeper("complaint", [])?.as_string()
}

/// Reads the kept recordings of sessions that were interrupted. `wake` is called after each.
pub fn read_kept_recordings(interrupted: Sender<InterruptedSession>, wake: Box<dyn Fn() + Send>) {
    let Some(promise) = call_keeper("read", []).and_then(|read| read.dyn_into::<js_sys::Promise>().ok()) else {
        return;
    };
    spawn_local(async move {
        // A browser that keeps nothing has nothing to offer.
        let Ok(kept) = JsFuture::from(promise).await else { return };
        for pair in js_sys::Array::from(&kept).iter().map(|pair| js_sys::Array::from(&pair)) {
            let (name, recording) =
                (pair.get(0).as_string().unwrap_or_default(), js_sys::Uint8Array::new(&pair.get(1)));
            if let Some(session) = InterruptedSession::kept(&name, recording.to_vec()) {
                let _ = interrupted.send(session);
                wake();
            }
        }
    });
}

/// Lets the browser save a recording that is set aside; returns a complaint if that fails.
pub fn download_recording(session: &str, recording: &[u8]) -> Option<String> {
    let name = format!("{session}.mcap");
    let saved = save_as(&name, recording, "application/octet-stream");
    saved.err().map(|error| format!("{name}: unwritable-file: {}", reason(&error)))
}

/// Carries out a call of `page/kept.js` that a worker asks for: an object with the function's name and what it is given.
pub fn keep_for_worker(asked: &JsValue) {
    let name = js_sys::Reflect::get(asked, &"keep".into()).ok().and_then(|name| name.as_string());
    let given = js_sys::Reflect::get(asked, &"given".into()).ok().and_then(|given| given.dyn_into().ok());
    if let (Some(name), Some(given)) = (name, given) {
        call_keeper_with(&name, &given);
    }
}

/// Calls a function of `page/kept.js` in the crate `web`; `None` in a page without it.
fn call_keeper<const N: usize>(function: &str, arguments: [JsValue; N]) -> Option<JsValue> {
    call_keeper_with(function, &arguments.into_iter().collect())
}

fn call_keeper_with(function: &str, arguments: &js_sys::Array) -> Option<JsValue> {
    call_script("typodontKept", function, arguments)
}

/// Calls a function of one of the page's scripts, which are global objects.
fn call_script(script: &str, function: &str, arguments: &js_sys::Array) -> Option<JsValue> {
    let script = js_sys::Reflect::get(&js_sys::global(), &script.into()).ok()?;
    let function = js_sys::Reflect::get(&script, &function.into()).ok()?.dyn_into::<js_sys::Function>().ok()?;
    function.apply(&script, arguments).ok()
}

/// Name of the place where settings are kept, for messages.
pub fn settings_place(_: &UserFolder) -> String {
    format!("localStorage/{SETTINGS_KEY}")
}

/// Text of the settings; `None` if none are kept, or if the browser keeps nothing for this page.
pub fn read_settings(_: &UserFolder) -> Option<String> {
    stored(SETTINGS_KEY)
}

/// Keeps the text of the settings; returns the reason if that fails.
pub fn write_settings(_: &UserFolder, text: &str) -> Option<String> {
    write(SETTINGS_KEY, text)
}

/// Text of the results of earlier sessions; `None` if none are kept.
pub fn read_history() -> Option<String> {
    stored(HISTORY_KEY)
}

/// Keeps the text of the results; returns the reason if that fails.
pub fn write_history(text: &str) -> Option<String> {
    write(HISTORY_KEY, text)
}

/// Key of the unsaved text of an exercise in the page's own storage.
fn draft_key(path: Option<&Path>) -> String {
    format!("{DRAFT_KEY}{}", path.map_or("new".into(), |path| path.display().to_string()))
}

/// Keeps the unsaved text of an exercise in the page's own storage. `path` identifies the exercise.
///
/// # Errors
/// A message if the browser keeps nothing for this page.
pub fn store_draft(_: Option<&Path>, path: Option<&Path>, text: &str) -> Result<(), String> {
    write(&draft_key(path), text).map_or(Ok(()), |why| Err(format!("{why}; save the exercise before you leave it")))
}

/// The unsaved text of an exercise; `None` if there is none.
pub fn load_draft(_: Option<&Path>, path: Option<&Path>) -> Option<String> {
    stored(&draft_key(path))
}

/// Deletes the unsaved text of an exercise.
pub fn remove_draft(_: Option<&Path>, path: Option<&Path>) {
    if let Some(storage) = storage() {
        let _ = storage.remove_item(&draft_key(path));
    }
}

fn stored(key: &str) -> Option<String> {
    storage()?.get_item(key).ok().flatten()
}

fn write(key: &str, text: &str) -> Option<String> {
    let kept = storage().map(|storage| storage.set_item(key, text));
    (!matches!(kept, Some(Ok(())))).then(|| "the browser keeps nothing for this page".to_string())
}

fn storage() -> Option<web_sys::Storage> {
    web_sys::window()?.local_storage().ok().flatten()
}

thread_local! {
    /// The pen over the page, until it leaves or a mouse is used.
    static PEN: Cell<Option<Pen>> = const { Cell::new(None) };
    /// True once a pen has told of a tilt.
    static KNOWS_TILT: Cell<bool> = const { Cell::new(false) };
}

/// Listens to the pens over an element: browsers report them as pointers, of which the window system takes the position only.
pub fn listen_to_pens(canvas: &web_sys::HtmlCanvasElement) {
    let listener = Closure::<dyn FnMut(web_sys::PointerEvent)>::new(|event: web_sys::PointerEvent| {
        let is_of_pen = event.pointer_type() == "pen";
        // The palm beside a pen.
        if event.pointer_type() == "touch" && PEN.get().is_some() {
            return;
        }
        let tilt = [event.tilt_x() as f32, event.tilt_y() as f32];
        // A pen that does not measure its tilt always says 0.
        KNOWS_TILT.set(KNOWS_TILT.get() || tilt != [0.0; 2]);
        let is_pen = is_of_pen && !matches!(&*event.type_(), "pointercancel" | "pointerleave");
        PEN.set(is_pen.then(|| Pen {
            pressure: (event.buttons() != 0).then(|| event.pressure()),
            tilt: KNOWS_TILT.get().then_some(tilt),
        }));
    });
    for event in ["pointerdown", "pointermove", "pointerup", "pointercancel", "pointerleave"] {
        // An element takes any listener; without it a pen presses with its full strength.
        let _ = canvas.add_event_listener_with_callback(event, listener.as_ref().unchecked_ref());
    }
    // It lives as long as the page.
    listener.forget();
}

/// The pen in use; `None` if another pointer is.
pub fn pen() -> Option<Pen> {
    PEN.get()
}

/// State of the first gamepad that is connected and has a standard layout.
pub fn gamepad() -> Option<GamepadState> {
    let pads = web_sys::window()?.navigator().get_gamepads().ok()?;
    let pad = pads
        .iter()
        .filter_map(|pad| pad.dyn_into::<web_sys::Gamepad>().ok())
        .find(|pad| pad.connected() && pad.mapping() == web_sys::GamepadMappingType::Standard)?;
    let (axes, buttons) = (pad.axes(), pad.buttons());
    let axis = |index: u32| axes.get(index).as_f64().unwrap_or_default() as f32;
    let button = |index: u32| buttons.get(index).dyn_into::<web_sys::GamepadButton>().ok();
    let pull = |index: u32| button(index).map_or(0.0, |trigger| trigger.value() as f32);
    let is_pressed = |index: &u32| button(*index).is_some_and(|button| button.pressed());
    Some(GamepadState {
        sticks: [[axis(0), axis(1)], [axis(2), axis(3)]],
        triggers: [pull(6), pull(7)],
        buttons: (0..buttons.length().min(32)).filter(is_pressed).fold(0, |mask, index| mask | 1 << index),
    })
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
