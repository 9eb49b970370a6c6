//! Bundles, session reports and cohort reports.

#[path = "../support/mod.rs"]
mod support;
mod bundle_in_memory;
mod bundle_python;
mod cohort;
mod cohort_page;
mod pictures;
mod report_page;
mod statistics;
mod verification;
