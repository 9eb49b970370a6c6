//! `typodont import`: from a scan to a labelled tooth.

use super::{Failure, say, write};
use crate::content::{self, Library, TissueTable, nrrd, scan};
use crate::report::tissue_map;
use crate::scenario;
use crate::volume::Volume;
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
pub struct Arguments {
    /// A CT of one tooth (NRRD)
    scan: PathBuf,
    /// The label map: enamel, dentine and pulp, crown up; 3D Slicer opens it, a scenario names it under "labels"
    #[arg(short, long, value_name = "FILE.seg.nrrd")]
    output: PathBuf,
    /// Distance between the scan's voxels, where its header lacks it
    #[arg(long, value_name = "MM", value_parser = super::run::spacing)]
    spacing_mm: Option<f32>,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { scan: path, output, spacing_mm } = arguments;
    let wrong = |what: String| Failure::Wrong(format!("{}: wrong-volume: {what}", path.display()));
    if !output.to_string_lossy().ends_with(".nrrd") {
        return Err(Failure::misuse(format!("{}: the label map is a .seg.nrrd file", output.display())));
    }
    if output.canonicalize().is_ok_and(|o| path.canonicalize().is_ok_and(|p| p == o)) {
        return Err(Failure::misuse(format!("{}: this is the scan itself", output.display())));
    }
    content::read_file(path)?;
    let image = nrrd::read(path).map_err(|e| wrong(e.to_string()))?;
    let table = TissueTable::read(&Library::shipped())?;
    let tissues = scenario::anatomy_tissues(&table);
    let bar = super::run::spinner("telling tissues apart");
    let tooth = scan::segmented(&image, spacing_mm.map(|mm| [mm; 3]), &tissues).map_err(wrong);
    bar.finish_and_clear();
    let tooth = tooth?;
    write(output, tissue_map(&tooth, &table).map_err(Failure::Wrong)?)?;
    say(describe(&tooth, &table))
}

/// Size and tissues in a line each, so that a wrong spacing or a wrong threshold is seen at once.
fn describe(tooth: &Volume, table: &TissueTable) -> String {
    let grid = tooth.grid();
    let size = tooth.tight_box().map_or([0.0; 3], |[low, high]| (grid.centre(high) - grid.centre(low)).to_array());
    let mut lines = vec![format!("{:.1} × {:.1} × {:.1} mm", size[0], size[1], size[2])];
    for entry in table.entries() {
        let mm3 = tooth.count(entry.label()) as f64 * grid.voxel_mm3();
        if mm3 > 0.0 {
            lines.push(format!("{}: {mm3:.1} mm³", entry.title));
        }
    }
    lines.join("\n")
}
