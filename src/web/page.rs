//! The canvas of the page, and the texts beside it.

use eframe::wasm_bindgen::JsCast;
use typodont_app::{AppOptions, open_page};
use typodont_report::Templates;
use web_sys::{Document, HtmlCanvasElement};

/// Ids of elements in `page/index.html`.
const CANVAS: &str = "typodont";
const STATUS: &str = "status";

/// Begins to draw, and removes the text that says so.
pub fn open() {
    wasm_bindgen_futures::spawn_local(async {
        let Some(document) = web_sys::window().and_then(|window| window.document()) else { return };
        let canvas = document.get_element_by_id(CANVAS).and_then(|canvas| canvas.dyn_into::<HtmlCanvasElement>().ok());
        let Some(canvas) = canvas else { return };
        let options = AppOptions::at_exercise_list("", Templates::shipped());
        match open_page(canvas, options).await {
            Ok(()) => status(&document, None),
            Err(why) => status(&document, Some(&why)),
        }
    });
}

/// Shows why nothing can be drawn, or removes the status.
fn status(document: &Document, error: Option<&str>) {
    let Some(status) = document.get_element_by_id(STATUS) else { return };
    match error {
        None => status.remove(),
        Some(why) => {
            let _ = status.set_attribute("class", "failed");
            if let Some(reason) = document.get_element_by_id("reason") {
                reason.set_text_content(Some(why));
            }
        }
    }
}
