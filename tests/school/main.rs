//! A school's systems: gradebooks, the review pages, stations and their records.

#[path = "../support/mod.rs"]
mod support;
mod agreement;
mod blind;
mod handover;
mod learning_platform;
mod review;
mod review_page;
mod stations;
