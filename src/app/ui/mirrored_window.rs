//! A window that is seen in a mirror: everything in it is drawn flipped, and the pointer acts on what is seen under it.

use crate::settings::MirroredWindow;
use eframe::egui::epaint::{ClippedShape, Primitive};
use eframe::egui::{Context, Event, FullOutput, Plugin, Pos2, RawInput, Rect, Shape, Vec2};

/// Flips the input and the output of each frame.
#[derive(Default)]
pub struct MirrorPlugin {
    pub mirrored: MirroredWindow,
}

impl MirroredWindow {
    fn flips_x(self) -> bool {
        self == MirroredWindow::LeftRight
    }

    fn flips_y(self) -> bool {
        self == MirroredWindow::TopBottom
    }

    /// The place on the screen of a place in the window that is drawn, or the other way round.
    fn place(self, at: Pos2, screen: Rect) -> Pos2 {
        let x = if self.flips_x() { screen.min.x + screen.max.x - at.x } else { at.x };
        let y = if self.flips_y() { screen.min.y + screen.max.y - at.y } else { at.y };
        Pos2::new(x, y)
    }

    /// The same for a movement.
    fn movement(self, by: Vec2) -> Vec2 {
        Vec2::new(if self.flips_x() { -by.x } else { by.x }, if self.flips_y() { -by.y } else { by.y })
    }

    /// The same for an event of the pointer.
    pub fn event(self, mut event: Event, screen: Rect) -> Event {
        match &mut event {
            Event::PointerMoved(pos) | Event::PointerButton { pos, .. } | Event::Touch { pos, .. } => {
                *pos = self.place(*pos, screen);
            }
            Event::MouseMoved(by) => *by = self.movement(*by),
            _ => {}
        }
        event
    }

    /// The same for a rectangle.
    pub fn rect(self, rect: Rect, screen: Rect) -> Rect {
        Rect::from_two_pos(self.place(rect.min, screen), self.place(rect.max, screen))
    }
}

impl Plugin for MirrorPlugin {
    fn debug_name(&self) -> &'static str {
        "mirrored window"
    }

    fn input_hook(&mut self, ctx: &Context, input: &mut RawInput) {
        let mirrored = self.mirrored;
        if mirrored == MirroredWindow::No {
            return;
        }
        let screen = input.screen_rect.unwrap_or_else(|| ctx.viewport_rect());
        for event in &mut input.events {
            *event = mirrored.event(event.clone(), screen);
        }
    }

    fn output_hook(&mut self, ctx: &Context, output: &mut FullOutput) {
        let mirrored = self.mirrored;
        if mirrored == MirroredWindow::No {
            return;
        }
        let screen = ctx.viewport_rect();
        let drawn = ctx.tessellate(std::mem::take(&mut output.shapes), output.pixels_per_point);
        let flipped = drawn.into_iter().map(|part| {
            let shape = match part.primitive {
                Primitive::Mesh(mut mesh) => {
                    for vertex in &mut mesh.vertices {
                        vertex.pos = mirrored.place(vertex.pos, screen);
                    }
                    Shape::mesh(mesh)
                }
                Primitive::Callback(mut callback) => {
                    callback.rect = mirrored.rect(callback.rect, screen);
                    Shape::Callback(callback)
                }
            };
            ClippedShape::new(mirrored.rect(part.clip_rect, screen), shape)
        });
        output.shapes = flipped.collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::{Modifiers, PointerButton};

    /// Runs frames of a window with one button at the upper left, in which the mouse clicks at a place of the screen;
    /// returns true if the button was clicked, and the middle of what was drawn.
    fn click(mirrored: MirroredWindow, at: Pos2) -> (bool, Pos2) {
        let ctx = Context::default();
        ctx.add_plugin(MirrorPlugin { mirrored });
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, Vec2::new(400.0, 300.0)));
        let button = |pressed| Event::PointerButton {
            pos: at,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        let frames = [vec![], vec![Event::PointerMoved(at)], vec![button(true)], vec![button(false)], vec![]];
        let (mut is_clicked, mut drawn) = (false, Rect::NOTHING);
        for events in frames {
            let input = RawInput { screen_rect, events, ..RawInput::default() };
            let output = ctx.run_ui(input, |ui| {
                let place = Rect::from_min_size(Pos2::new(10.0, 10.0), Vec2::new(60.0, 30.0));
                is_clicked |= ui.put(place, eframe::egui::Button::new("Finish")).clicked();
            });
            drawn = Rect::NOTHING;
            for part in ctx.tessellate(output.shapes, output.pixels_per_point) {
                if let Primitive::Mesh(mesh) = part.primitive {
                    let seen =
                        mesh.vertices.iter().map(|vertex| vertex.pos).filter(|pos| part.clip_rect.contains(*pos));
                    drawn = seen.fold(drawn, |drawn, pos| Rect::from_min_max(drawn.min.min(pos), drawn.max.max(pos)));
                }
            }
        }
        (is_clicked, drawn.center())
    }

    #[test]
    fn a_button_is_clicked_where_it_is_seen() {
        // Aim: what is drawn at the upper left is at the upper right, or at the lower left, and hears the mouse there only.
        let seen = [
            (MirroredWindow::No, Pos2::new(40.0, 25.0)),
            (MirroredWindow::LeftRight, Pos2::new(360.0, 25.0)),
            (MirroredWindow::TopBottom, Pos2::new(40.0, 275.0)),
        ];
        for (mirrored, here) in seen {
            for (_, at) in seen {
                let (is_clicked, drawn) = click(mirrored, at);
                assert!(drawn.distance(here) < 2.0, "{mirrored:?}: drawn at {drawn}");
                assert_eq!(is_clicked, at == here, "{mirrored:?}, mouse at {at}");
            }
        }
    }
}
