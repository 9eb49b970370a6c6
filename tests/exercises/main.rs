//! Exercises: written, checked, played by scripted operators.

#[path = "../support/mod.rs"]
mod support;
mod authoring;
mod broken_scenarios;
mod case_pictures;
mod charting;
mod documented_commands;
mod fairness;
mod fuzz_scenario;
mod guessing;
mod near_zones;
mod operators;
mod restoring;
mod schema;
mod station;
mod visibility;
