//! A card over the view that teaches how the instrument is handled, with a picture of each action and a mark for those
//! that were done. Pointers, pens and haptic devices have cards of their own.

use crate::i18n::Translations;
use crate::lesson_state::LessonState;
use crate::pointer_hand::PointerKind;
use crate::ui::theme;
use eframe::egui::{self, Color32, Pos2, Rect, Stroke, Vec2, vec2};

/// Picture of an action.
#[derive(Clone, Copy)]
enum ActionPicture {
    /// A mouse, with the part that is used.
    Mouse(MousePart),
    /// A stylus over a surface: free, touching or pressed.
    Stylus(f32),
    /// The places where this many fingers touch the screen.
    Fingers(u8),
}

#[derive(Clone, Copy, PartialEq)]
enum MousePart {
    Whole,
    LeftButton,
    RightButton,
}

/// Draws the card in the upper left corner of the view.
pub fn controls_guide_ui(ui: &mut egui::Ui, lesson: &LessonState, view: Rect, words: &Translations) {
    let Some(stage) = lesson.stage().filter(|stage| stage.shows_controls) else { return };
    let progress = lesson.controls;
    let pointer = lesson.has_mouse().then_some(lesson.pointer_hand.kind);
    let is_picked_up = lesson.is_pointer_captured || progress.has_moved;
    let has_followed = progress.has_moved && progress.has_touched;
    let mut rows = match pointer {
        Some(PointerKind::Pen) => vec![
            (ActionPicture::Stylus(0.0), "guide.tap_pick_up", is_picked_up),
            (ActionPicture::Stylus(0.35), "guide.pen_move", has_followed),
            (ActionPicture::Stylus(-0.12), "guide.pen_press", progress.has_pressed),
            (ActionPicture::Stylus(0.0), "guide.pen_rotate", progress.has_rotated),
        ],
        Some(PointerKind::Finger) => vec![
            (ActionPicture::Fingers(1), "guide.tap_pick_up", is_picked_up),
            (ActionPicture::Fingers(1), "guide.finger_move", has_followed),
            (ActionPicture::Fingers(2), "guide.finger_press", progress.has_pressed),
            (ActionPicture::Fingers(1), "guide.finger_rotate", progress.has_rotated),
        ],
        Some(PointerKind::Mouse) => vec![
            (ActionPicture::Mouse(MousePart::LeftButton), "guide.mouse_pick_up", is_picked_up),
            (ActionPicture::Mouse(MousePart::Whole), "guide.mouse_move", has_followed),
            (ActionPicture::Mouse(MousePart::LeftButton), "guide.mouse_press", progress.has_pressed),
            (ActionPicture::Mouse(MousePart::RightButton), "guide.mouse_rotate", progress.has_rotated),
        ],
        None => vec![
            (ActionPicture::Stylus(0.35), "guide.arm_move", progress.has_moved),
            (ActionPicture::Stylus(0.0), "guide.arm_touch", progress.has_touched),
            (ActionPicture::Stylus(-0.12), "guide.arm_press", progress.has_pressed),
            (ActionPicture::Mouse(MousePart::LeftButton), "guide.arm_rotate", progress.has_rotated),
        ],
    };
    if stage.cutting {
        let picture = match pointer {
            Some(PointerKind::Mouse) => ActionPicture::Mouse(MousePart::LeftButton),
            Some(PointerKind::Finger) => ActionPicture::Fingers(2),
            Some(PointerKind::Pen) | None => ActionPicture::Stylus(-0.12),
        };
        rows.push((picture, "guide.cut", progress.has_cut));
    }
    let width = 300.0f32.min(view.width() - 24.0);
    let place = Rect::from_min_size(view.min + vec2(12.0, 12.0), vec2(width, view.height() - 24.0));
    let mut card = ui.new_child(egui::UiBuilder::new().max_rect(place));
    let frame = egui::Frame::NONE.fill(Color32::from_white_alpha(235)).corner_radius(8).inner_margin(10);
    frame.show(&mut card, |ui| {
        ui.strong(words.get("guide.title"));
        for (picture, key, is_done) in rows {
            row_ui(ui, picture, words.get(key), is_done);
        }
        if pointer == Some(PointerKind::Mouse) {
            ui.add(egui::Label::new(egui::RichText::new(words.get("guide.keyboard")).size(14.0).weak()).wrap());
        }
    });
}

fn row_ui(ui: &mut egui::Ui, picture: ActionPicture, text: &str, is_done: bool) {
    const SIZE: Vec2 = vec2(30.0, 34.0);
    ui.horizontal(|ui| {
        let (rect, _) = ui.allocate_exact_size(SIZE, egui::Sense::hover());
        match picture {
            ActionPicture::Mouse(part) => mouse_picture(ui.painter(), rect, part),
            ActionPicture::Stylus(height) => stylus_picture(ui.painter(), rect, height),
            ActionPicture::Fingers(count) => fingers_picture(ui.painter(), rect, count),
        }
        let (mark, _) = ui.allocate_exact_size(vec2(18.0, 18.0), egui::Sense::hover());
        if is_done {
            theme::tick(ui.painter(), mark, Stroke::new(2.5, theme::SUCCESS));
        } else {
            ui.painter().circle_stroke(mark.center(), 6.0, Stroke::new(1.5, theme::WARNING));
        }
        ui.add(egui::Label::new(egui::RichText::new(text).size(14.0)).wrap().selectable(false));
    });
}

/// Outline of a mouse, with the part in use filled.
fn mouse_picture(painter: &egui::Painter, rect: Rect, part: MousePart) {
    let body = Rect::from_center_size(rect.center(), vec2(22.0, 32.0));
    let line = Stroke::new(1.5, Color32::from_gray(0x40));
    let button = |is_right: bool| {
        let half = vec2(0.5 * body.width(), 0.42 * body.height());
        Rect::from_min_size(body.min + vec2(if is_right { half.x } else { 0.0 }, 0.0), half)
    };
    let (round, sharp) = (10, 2);
    match part {
        MousePart::Whole => painter.rect_filled(body, round, theme::ACCENT.gamma_multiply(0.35)),
        MousePart::LeftButton => {
            let corners = egui::CornerRadius { nw: round, ne: sharp, sw: sharp, se: sharp };
            painter.rect_filled(button(false), corners, theme::ACCENT)
        }
        MousePart::RightButton => {
            let corners = egui::CornerRadius { nw: sharp, ne: round, sw: sharp, se: sharp };
            painter.rect_filled(button(true), corners, theme::ACCENT)
        }
    };
    painter.rect_stroke(body, round, line, egui::StrokeKind::Inside);
    painter.vline(body.center().x, body.top()..=body.top() + 0.42 * body.height(), line);
    painter.hline(body.x_range(), body.top() + 0.42 * body.height(), line);
}

/// A stylus whose tip is at a height over a surface, as a share of the picture's height; below zero it presses.
fn stylus_picture(painter: &egui::Painter, rect: Rect, height: f32) {
    let ground = rect.bottom() - 6.0;
    let tip = Pos2::new(rect.left() + 9.0, ground - height.max(-0.05) * rect.height());
    painter.hline(rect.x_range(), ground, Stroke::new(2.0, Color32::from_gray(0x70)));
    painter.line_segment([tip, tip + vec2(16.0, -22.0)], Stroke::new(4.0, theme::ACCENT));
    if height < 0.0 {
        painter.circle_stroke(tip, 6.0, Stroke::new(2.0, theme::WARNING));
    }
}

/// Fingertips on a screen, side by side.
fn fingers_picture(painter: &egui::Painter, rect: Rect, count: u8) {
    let screen = Rect::from_center_size(rect.center(), vec2(28.0, 24.0));
    painter.rect_stroke(screen, 3, Stroke::new(1.5, Color32::from_gray(0x40)), egui::StrokeKind::Inside);
    for finger in 0..count {
        let share = f32::from(finger + 1) / f32::from(count + 1);
        painter.circle_filled(screen.lerp_inside(vec2(share, 0.5)), 4.0, theme::ACCENT);
    }
}
