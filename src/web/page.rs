//! The canvas of the page, and the texts beside it.

use super::launch::{Launch, announce};
use eframe::wasm_bindgen::JsCast;
use typodont_app::{AppOptions, open_page};
use typodont_report::Templates;
use web_sys::{Document, HtmlCanvasElement, Window};

/// Ids of elements in `page/index.html`.
const CANVAS: &str = "typodont";
const STATUS: &str = "status";

/// Begins to draw, and removes the text that says so.
pub fn open() {
    wasm_bindgen_futures::spawn_local(async {
        let Some(window) = web_sys::window() else { return };
        let Some(document) = window.document() else { return };
        let canvas = document.get_element_by_id(CANVAS).and_then(|canvas| canvas.dyn_into::<HtmlCanvasElement>().ok());
        let Some(canvas) = canvas else { return };
        match options(&window).await {
            Ok(options) => match open_page(canvas, options).await {
                Ok(()) => {
                    status(&document, None);
                    label_text_input(&document);
                }
                Err(why) => status(&document, Some(("failed", &why))),
            },
            Err(why) => status(&document, Some(("no-exercise", &why))),
        }
    });
}

/// Options that follow from the page's address.
async fn options(window: &Window) -> Result<AppOptions, String> {
    let launch = Launch::of(window);
    let given = launch.fetch_exercise(window).await?;
    let teller = window.clone();
    Ok(AppOptions {
        given,
        language: launch.language,
        participant: launch.participant,
        on_bundle: Some(Box::new(move |bundle| announce(&teller, bundle))),
        ..AppOptions::at_exercise_list("", Templates::shipped())
    })
}

/// Names the field into which the window system beside the canvas takes typed text, for screen readers.
fn label_text_input(document: &Document) {
    let language = document.document_element().and_then(|root| root.get_attribute("lang"));
    let label = if language.as_deref() == Some("tr") { "Klavye girişi" } else { "Keyboard input" };
    if let Ok(Some(input)) = document.query_selector("input[type=text]:not([aria-label])") {
        let _ = input.set_attribute("aria-label", label);
    }
}

/// Shows why nothing can be drawn, or removes the status. The class of the status selects the sentence before the reason.
fn status(document: &Document, error: Option<(&str, &str)>) {
    let Some(status) = document.get_element_by_id(STATUS) else { return };
    match error {
        None => status.remove(),
        Some((class, why)) => {
            let _ = status.set_attribute("class", class);
            if let Some(reason) = document.get_element_by_id("reason") {
                reason.set_text_content(Some(why));
            }
        }
    }
}
