//! Screens of a lesson on different monitors, in large type, in high contrast and in Turkish.

use crate::harness::{self, Window};
use crate::support::folder::folder;
use crate::support::window_driver::{SCREEN_SIZE, WindowDriver};
use crate::trainee::{Trainee, lesion_in_world};
use typodont_app::AppOptions;

/// A way in which a window can be shown.
struct Look {
    name: &'static str,
    size: [i32; 2],
    settings: &'static str,
}

const LOOKS: [Look; 6] = [
    Look { name: "1280", size: SCREEN_SIZE, settings: r#""language": "en""# },
    Look { name: "1920", size: [1920, 1080], settings: r#""language": "en""# },
    Look { name: "large", size: SCREEN_SIZE, settings: r#""language": "en", "font_size": 1.6"# },
    Look { name: "contrast", size: SCREEN_SIZE, settings: r#""language": "en", "high_contrast": true"# },
    Look { name: "turkish", size: SCREEN_SIZE, settings: r#""language": "tr""# },
    Look { name: "turkish-large", size: SCREEN_SIZE, settings: r#""language": "tr", "font_size": 1.6"# },
];

#[test]
fn every_screen_fits_every_monitor_type_size_and_language() {
    // Aim: every screen can be used, however the window is shown. Method: a lesson from the list to its result, with the pages over it
    // and the author's screen; no button, field or text of a screen reaches beyond the window's sides. The pictures are for
    // `scripts/guide-pictures`.
    for Look { name, size, settings } in LOOKS {
        let place = folder(&format!("screens_{name}"));
        harness::keep_settings(&place, &format!(r#"{{ {settings}, "introduction_first": false }}"#));
        let options = AppOptions { seed: Some(1), ..harness::options(&place) };
        let Some(mut desk) = Window::open_sized(&place, options, size) else { return };
        let look = |desk: &mut Window, screen: &str| {
            desk.turn();
            desk.picture(&format!("screen-{screen}-{name}"));
            assert_eq!(desk.cut_off(), Vec::<String>::new(), "{screen}, {name}");
        };
        desk.until("screen", |screen| screen == "shelf");
        look(&mut desk, "1-list");
        for (key, page) in [("F1", "keys"), ("F2", "settings")] {
            desk.press(key, "over", page);
            look(&mut desk, &format!("2-{page}"));
            desk.press(key, "over", "nothing");
        }
        desk.click("shelf.new");
        desk.until("screen", |screen| screen == "author");
        desk.until("checked", |checked| checked == "true");
        look(&mut desk, "3-author");
        desk.click("leave");
        desk.until("screen", |screen| screen == "shelf");
        for chosen in ["2-decay", "3-detection", "4-diagnosis", "5-grinding"] {
            desk.press("ArrowDown", "chosen", chosen);
        }
        desk.press("Enter", "screen", "briefing");
        look(&mut desk, "4-briefing");
        desk.press("Enter", "screen", "practice");
        desk.until("hand", |_| true);
        desk.press("o", "pointer", "held");
        desk.move_to(size.map(|pixels| pixels / 2));
        let lesion = lesion_in_world("scenarios/5-grinding.json", 1);
        desk.point_at(lesion);
        desk.wait(std::time::Duration::from_secs(1));
        look(&mut desk, "5-practice");
        desk.press("ctrl+Enter", "asked", "finish");
        look(&mut desk, "6-finish");
        desk.send_key("Enter");
        desk.until("bundle", |_| true);
        look(&mut desk, "7-result");
    }
}
