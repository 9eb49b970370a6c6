//! Bundles, session reports and cohort reports.

#[path = "../support/mod.rs"]
mod support;
mod bundle_python;
mod cohort;
mod pictures;
mod report_page;
mod statistics;
mod verification;
