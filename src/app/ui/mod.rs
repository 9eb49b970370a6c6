//! The screens: what is drawn, and the commands that it asks for.
//!
//! Takes the program's state. Gives pictures, texts and [`AppCommand`](crate::command::AppCommand)s. Nothing outside of
//! this folder but `app` knows of it, and nothing here carries out a command.

pub mod briefing;
pub mod case_pictures;
pub mod controls_guide;
pub mod editor;
pub mod exercise_list;
pub mod kiosk_exit;
pub mod lesson_view;
pub mod mirrored_window;
pub mod periodontal_chart;
pub mod practice;
pub mod preview_view;
pub mod questionnaire;
pub mod questions;
pub mod registration_view;
pub mod report_texts;
pub mod results;
pub mod section_view;
pub mod settings_screen;
pub mod shortcuts;
pub mod shutter_glasses;
pub mod text_field;
pub mod theme;
pub mod tools_panel;
pub mod touches;
pub mod transfer_function_editor;
pub mod ui_anchors;
pub mod view_refresh;
pub mod viewport;
pub mod viewport_input;
pub mod views;
pub mod zip_verification;
