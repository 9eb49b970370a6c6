//! The window in the test's own process, without a display (`egui_kittest`).
//!
//! Its lesson runs on a thread of its own and in real time, as in the program. Every widget must have a name that a screen
//! reader can say, and no text may contain a character that the fonts lack.

use crate::support::tools::skip;
use crate::support::window_driver::{SCREEN_SIZE, WindowDriver};
use eframe::egui::accesskit::Role;
use eframe::egui::{Event, Key, Modifiers, PointerButton, Pos2, Theme, TouchDeviceId, TouchId, TouchPhase, Vec2};
use eframe::egui_wgpu::WgpuSetup;
use egui_kittest::kittest::{NodeT, Queryable};
use egui_kittest::{Harness, Node};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::{Duration, Instant};
use typodont_app::{App, AppOptions, UserFolder};
use typodont_report::Templates;

/// Time between two frames while the window runs.
const FRAME: Duration = Duration::from_millis(15);

/// Lines of the state log: all of them, and the newest of each topic.
#[derive(Default)]
struct Lines {
    all: Vec<String>,
    latest: BTreeMap<String, String>,
}

/// The window, and its state log in memory.
pub struct Window {
    harness: Harness<'static, App>,
    lines: Rc<RefCell<Lines>>,
    opened: Instant,
    /// Size of the screen, pixels.
    size: Vec2,
    /// Position of the pointer, pixels.
    pointer: Pos2,
}

/// The press or the release of a key, without others.
fn key_event(key: &str, pressed: bool) -> Event {
    let key = Key::from_name(key).unwrap_or_else(|| panic!("no key {key}"));
    Event::Key { key, physical_key: None, pressed, repeat: false, modifiers: Modifiers::NONE }
}

/// Folder of the user's own files, for a window whose home is in `place`.
pub fn user_folder(place: &Path) -> PathBuf {
    place.join("home/config/typodont")
}

/// Writes a settings file for the window that opens at `place`.
pub fn keep_settings(place: &Path, settings: &str) {
    let folder = user_folder(place);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("settings.json"), settings).unwrap();
}

/// Options of a window at the exercise list, which writes into `place`.
pub fn options(place: &Path) -> AppOptions {
    AppOptions::at_exercise_list(place.join("bundles"), Templates::shipped())
}

impl Window {
    /// Opens the window; prints the reason and returns `None` where nothing can draw its pictures.
    pub fn open(place: &Path, options: AppOptions) -> Option<Window> {
        Window::open_sized(place, options, SCREEN_SIZE)
    }

    /// The same on a screen of another size, pixels.
    pub fn open_sized(place: &Path, options: AppOptions, size: [i32; 2]) -> Option<Window> {
        let pixels = size;
        let size = Vec2::from(pixels.map(|pixels| pixels as f32));
        // OpenGL would look for a display.
        let mut setup = egui_kittest::wgpu::default_wgpu_setup();
        if let WgpuSetup::CreateNew(new) = &mut setup {
            new.instance_descriptor.backends = wgpu::Backends::PRIMARY;
        }
        let instance = pollster::block_on(setup.new_instance());
        if pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default())).is_err() {
            skip("there is no graphics adapter: the window is not opened");
            return None;
        }
        let folder = user_folder(place);
        if !folder.join("settings.json").exists() {
            keep_settings(place, "{ \"language\": \"en\" }");
        }
        let lines = Rc::new(RefCell::new(Lines::default()));
        let log = lines.clone();
        let options = AppOptions {
            user_folder: Some(UserFolder::new(Some(folder))),
            state_log: Some(Box::new(move |line| {
                let mut lines = log.borrow_mut();
                let (topic, value) = line.split_once(' ').unwrap_or((line, ""));
                lines.latest.insert(topic.into(), value.into());
                lines.all.push(line.into());
            })),
            ..options
        };
        let builder = Harness::builder()
            .with_theme(Theme::Light)
            .with_size(size)
            .with_step_dt(FRAME.as_secs_f32())
            .wgpu_setup(setup);
        let harness = builder.build_eframe(|context| App::new(context, options));
        let opened = Instant::now() - Duration::from_secs(1);
        let mut window = Window { harness, lines, opened, size, pointer: Pos2::ZERO };
        window.move_to(pixels.map(|pixels| pixels / 2));
        Some(window)
    }

    /// All lines of a topic of the state log, oldest first.
    pub fn history(&self, topic: &str) -> Vec<String> {
        let lines = self.lines.borrow();
        let values = lines.all.iter().filter_map(|line| line.split_once(' ').filter(|(name, _)| *name == topic));
        values.map(|(_, value)| value.to_string()).collect()
    }

    /// Writes into a text field, by the name that a screen reader says.
    pub fn write_into(&mut self, label: &str, text: &str) {
        self.click_on(self.field(label).rect().center());
        self.type_text(text);
        self.turn();
    }

    /// Clicks on a button, by the name that a screen reader says.
    pub fn click_button(&mut self, label: &str) {
        self.click_on_widget(Role::Button, label);
    }

    /// Opens a part that is folded, by the name that a screen reader says.
    pub fn unfold(&mut self, label: &str) {
        self.click_on_widget(Role::DisclosureTriangle, label);
    }

    /// Buttons, fields and texts that reach beyond the left or the right edge of the window, pictures and gauges that are not
    /// wholly in it, and choices and gauges under a picture; by the names that a screen reader says.
    pub fn cut_off(&self) -> Vec<String> {
        /// Part of a point by which a position may be rounded.
        const ROUNDED: f32 = 1.0;
        let screen = self.size / self.harness.ctx.pixels_per_point();
        let is_text =
            |role| matches!(role, Role::Button | Role::TextInput | Role::Label | Role::RadioButton | Role::CheckBox);
        // Texts may lie below, in an area that scrolls.
        let is_whole = |role| matches!(role, Role::Canvas | Role::Meter);
        let nodes = self.harness.query_all_by(|node| is_text(node.role()) || is_whole(node.role()));
        let is_beyond = |node: &Node| {
            let rect = node.rect();
            let is_below = is_whole(node.accesskit_node().role()) && rect.bottom() > screen.y + ROUNDED;
            rect.left() < -ROUNDED || rect.right() > screen.x + ROUNDED || is_below
        };
        let told = |node: Node| {
            let known = node.accesskit_node();
            format!("{:?} {:?} at {:?}", known.role(), known.label(), node.rect())
        };
        let found = |is_sought: fn(Role) -> bool| self.harness.query_all_by(move |node| is_sought(node.role()));
        let pictures: Vec<_> = found(|role| role == Role::Canvas).map(|node| node.rect()).collect();
        let is_covered = |node: &Node| pictures.iter().any(|picture| picture.shrink(ROUNDED).intersects(node.rect()));
        let beside = found(|role| matches!(role, Role::RadioButton | Role::Meter)).filter(is_covered);
        nodes.filter(is_beyond).chain(beside).map(told).collect()
    }

    /// Chooses a radio button, by the name that a screen reader says.
    pub fn choose(&mut self, label: &str) {
        self.click_on_widget(Role::RadioButton, label);
    }

    /// True if there is a radio button of this name.
    pub fn offers(&self, label: &str) -> bool {
        self.harness.query_by_role_and_label(Role::RadioButton, label).is_some()
    }

    /// Chooses an entry of a list that opens, by the names that a screen reader says.
    pub fn choose_from(&mut self, list: &str, entry: &str) {
        self.click_on_widget(Role::ComboBox, list);
        self.turn();
        self.click_on_widget(Role::Button, entry);
    }

    /// Presses a key, or releases it.
    pub fn set_key(&mut self, key: &str, pressed: bool) {
        self.send(key_event(key, pressed));
    }

    /// Presses a key twice in a row.
    pub fn press_twice(&mut self, key: &str) {
        for pressed in [true, false, true, false] {
            self.harness.event(key_event(key, pressed));
        }
        self.frame();
    }

    /// Draws in a picture from one place to another, each as the share of its width and height from the upper left.
    pub fn draw_in(&mut self, label: &str, [from, to]: [[f32; 2]; 2]) {
        let rect = self.harness.get_by_role_and_label(Role::Canvas, label).rect();
        let [from, to] = [from, to].map(|share| {
            let pixels = (rect.min + Vec2::from(share) * rect.size()) * self.harness.ctx.pixels_per_point();
            [pixels.x.round() as i32, pixels.y.round() as i32]
        });
        self.move_to(from);
        self.set_button(true);
        self.proceed();
        self.move_to(to);
        self.proceed();
        self.set_button(false);
    }

    /// Left, top, right and bottom of a picture, by the name that a screen reader says; pixels.
    pub fn view_of(&self, label: &str) -> [usize; 4] {
        let rect = self.harness.get_by_role_and_label(Role::Canvas, label).rect();
        let scale = self.harness.ctx.pixels_per_point();
        [rect.min.x, rect.min.y, rect.max.x, rect.max.y].map(|at| (at * scale).round() as usize)
    }

    /// Puts a finger or a pen on the screen, pixels; `force`: that of a pen, 0 to 1.
    pub fn touch(&mut self, id: u64, place: [i32; 2], force: Option<f32>) {
        self.send_touch(id, TouchPhase::Start, place, force);
    }

    /// Moves a finger or a pen that touches the screen.
    pub fn slide(&mut self, id: u64, place: [i32; 2], force: Option<f32>) {
        self.send_touch(id, TouchPhase::Move, place, force);
    }

    /// Lifts a finger or a pen off the screen.
    pub fn lift(&mut self, id: u64, place: [i32; 2]) {
        self.send_touch(id, TouchPhase::End, place, None);
    }

    /// Sends the events of a touch as a system does: the first one acts as the pointer, too.
    fn send_touch(&mut self, id: u64, phase: TouchPhase, place: [i32; 2], force: Option<f32>) {
        let pos = Pos2::from(place.map(|pixels| pixels as f32)) / self.harness.ctx.pixels_per_point();
        self.harness.event(Event::Touch { device_id: TouchDeviceId(1), id: TouchId(id), phase, pos, force });
        let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
        let pointer = match (id, phase) {
            (0, TouchPhase::Start) => {
                vec![Event::PointerMoved(pos), Event::PointerButton { pos, button, pressed: true, modifiers }]
            }
            (0, TouchPhase::Move) => vec![Event::PointerMoved(pos)],
            (0, TouchPhase::End | TouchPhase::Cancel) => {
                vec![Event::PointerButton { pos, button, pressed: false, modifiers }, Event::PointerGone]
            }
            _ => Vec::new(),
        };
        pointer.into_iter().for_each(|event| self.harness.event(event));
        self.frame();
    }

    fn click_on_widget(&mut self, role: Role, label: &str) {
        self.click_on(self.harness.get_by_role_and_label(role, label).rect().center());
    }

    /// Clicks on a place in the points of the present text size.
    fn click_on(&mut self, place: Pos2) {
        let pixels = place * self.harness.ctx.pixels_per_point();
        self.click_at([pixels.x, pixels.y].map(|at| at.round() as i32));
    }

    /// Text of a field, by the name that a screen reader says.
    pub fn text_of(&self, label: &str) -> String {
        self.field(label).value().unwrap_or_default()
    }

    fn field<'a>(&'a self, label: &'a str) -> Node<'a> {
        let secret = || self.harness.get_by_role_and_label(Role::PasswordInput, label);
        self.harness.query_by_role_and_label(Role::TextInput, label).unwrap_or_else(secret)
    }

    /// The screen as it is now: red, green, blue and alpha of each pixel, row by row.
    pub fn pixels(&mut self) -> Vec<u8> {
        self.harness.set_render_cursor(false);
        self.harness.render().expect("the window can be drawn").into_raw()
    }

    /// Draws one frame, with this input.
    fn send(&mut self, event: Event) {
        self.harness.event(event);
        self.frame();
    }

    /// Position of the pointer, in the points of the present text size.
    fn pointer(&self) -> Pos2 {
        self.pointer / self.harness.ctx.pixels_per_point()
    }

    fn frame(&mut self) {
        let size = self.size / self.harness.ctx.pixels_per_point();
        self.harness.set_size(size);
        self.harness.input_mut().time = Some(self.opened.elapsed().as_secs_f64());
        self.harness.step();
        self.harness.check_accessibility();
    }
}

impl WindowDriver for Window {
    fn latest(&self, topic: &str) -> Option<String> {
        self.lines.borrow().latest.get(topic).cloned()
    }

    fn screen_size(&self) -> [i32; 2] {
        [self.size.x as i32, self.size.y as i32]
    }

    fn proceed(&mut self) {
        let begun = Instant::now();
        self.frame();
        std::thread::sleep(FRAME.saturating_sub(begun.elapsed()));
    }

    fn send_key(&mut self, key: &str) {
        let (modifiers, name) = match key.strip_prefix("ctrl+") {
            Some(name) => (Modifiers::CTRL | Modifiers::COMMAND, name),
            None => (Modifiers::NONE, key),
        };
        let key = Key::from_name(name).unwrap_or_else(|| panic!("no key {name}"));
        self.send(Event::ModifiersChanged(modifiers));
        for pressed in [true, false] {
            self.send(Event::Key { key, physical_key: None, pressed, repeat: false, modifiers });
            // As from a system, which tells the key and the character that it writes.
            if pressed && modifiers.is_none() && name.chars().count() == 1 {
                self.send(Event::Text(name.into()));
            }
        }
        self.send(Event::ModifiersChanged(Modifiers::NONE));
    }

    fn type_text(&mut self, text: &str) {
        for character in text.chars() {
            self.send(Event::Text(character.into()));
        }
    }

    fn move_to(&mut self, place: [i32; 2]) {
        self.pointer = Pos2::from(place.map(|pixels| pixels as f32));
        self.send(Event::PointerMoved(self.pointer()));
    }

    fn move_by(&mut self, by: [i32; 2]) {
        self.pointer += Vec2::from(by.map(|pixels| pixels as f32));
        self.send(Event::PointerMoved(self.pointer()));
    }

    fn set_button(&mut self, is_down: bool) {
        let (pos, button, modifiers) = (self.pointer(), PointerButton::Primary, Modifiers::NONE);
        self.send(Event::PointerButton { pos, button, pressed: is_down, modifiers });
    }

    fn turn(&mut self) {
        for _ in 0..3 {
            self.frame();
        }
    }

    fn complaints(&self) -> String {
        String::new()
    }

    fn picture(&mut self, name: &str) {
        if let Some(folder) = std::env::var_os("TYPODONT_TEST_PICTURES") {
            self.harness.set_render_cursor(false);
            let mut image = self.harness.render().expect("the window can be drawn");
            // A window is filled with the colour of its panels first.
            let fill = self.harness.ctx.global_style().visuals.panel_fill.to_array();
            for pixel in image.pixels_mut() {
                let rest = 255 - u32::from(pixel[3]);
                pixel.0 = std::array::from_fn(|i| pixel[i].saturating_add((rest * u32::from(fill[i]) / 255) as u8));
            }
            image.save(Path::new(&folder).join(format!("{name}.png"))).unwrap();
        }
    }
}
