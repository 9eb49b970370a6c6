//! x
use super::glb::Part;
use crate::record::Recording;
use crate::scenario::*;
use crate::score::Scored;
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shows {
    Before,
    After,
    Map,
    BeforeSlice,
    AfterSlice,
    MapSlice,
}
pub struct Picture {
    pub name: String,
    pub title: String,
    pub shows: Shows,
    pub png: Vec<u8>,
}
pub fn all(_r: &Recording, _s: &Scored) -> Vec<Picture> {
    vec![]
}
pub fn parts(_s: &Scored) -> Vec<Part> {
    vec![]
}
pub fn preview_png(_s: &Scenario, _w: &Workpiece) -> Vec<u8> {
    vec![]
}
