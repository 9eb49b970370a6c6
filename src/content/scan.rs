//! x
use super::nrrd::Image;
use crate::anatomy::Tissues;
use crate::volume::*;
use std::collections::BTreeMap;
pub fn segmented(_i: &Image, _s: Option<[f32; 3]>, _t: &Tissues) -> Result<Volume, String> {
    Err("todo".into())
}
pub fn labelled(_i: &Image, _s: Option<[f32; 3]>, _n: &BTreeMap<u8, Label>) -> Result<Volume, String> {
    Err("todo".into())
}
pub fn mask(_i: &Image, _v: u8) -> Result<Vec<bool>, String> {
    Err("todo".into())
}
