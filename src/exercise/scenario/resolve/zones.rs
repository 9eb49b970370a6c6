//! Zones: tissue to be removed, and tissue to be preserved.

use super::Resolver;

use crate::scenario::file;
use crate::scenario::{Mask, Zone, ZoneRegion};
use std::sync::Arc;

impl Resolver<'_> {
    pub(super) fn zones(&mut self, written: &[file::ZoneFile]) -> Vec<Zone> {
        self.unique(written.iter().enumerate().map(|(i, z)| (z.id.as_str(), format!("/zones/{i}/id"))));
        let zone = |(i, z): (usize, &file::ZoneFile)| {
            let region = self.region(&z.region, &format!("/zones/{i}/region"))?;
            Some(Zone { id: z.id.clone(), title: z.title.to_string(), role: z.role, region })
        };
        written.iter().enumerate().filter_map(zone).collect()
    }

    fn region(&mut self, written: &file::RegionFile, path: &str) -> Option<ZoneRegion> {
        let point = |p: [file::CoordinateFile; 3]| p.map(|c| c.0);
        Some(match written {
            file::RegionFile::Tissue(name) => ZoneRegion::Tissue(self.label(name, &format!("{path}/tissue"))),
            file::RegionFile::Around(around) => ZoneRegion::Around {
                label: self.label(&around.tissue, &format!("{path}/around/tissue")),
                within: around.within_mm,
            },
            file::RegionFile::Sphere(sphere) => {
                ZoneRegion::Sphere { centre: point(sphere.centre_mm), radius: sphere.radius_mm }
            }
            file::RegionFile::Box(corners) => {
                let (min, max) = (point(corners.min_mm), point(corners.max_mm));
                if (0..3).any(|a| min[a] >= max[a]) {
                    self.complain(
                        &format!("{path}/box"),
                        "empty-region",
                        "the box is empty",
                        "each of min_mm must be less than its max_mm",
                    );
                }
                ZoneRegion::Box { min, max }
            }
            file::RegionFile::Cylinder(c) => {
                if point(c.from_mm) == point(c.to_mm) {
                    self.complain(
                        &format!("{path}/cylinder"),
                        "empty-region",
                        "the length of the cylinder is zero",
                        "from_mm and to_mm must differ",
                    );
                }
                ZoneRegion::Cylinder { from: point(c.from_mm), to: point(c.to_mm), radius: c.radius_mm }
            }
            file::RegionFile::Labels(labels) => {
                let path = format!("{path}/labels/file");
                let mask = self.library.bytes(&labels.file).map_err(|e| (e.code, e.message)).and_then(|bytes| {
                    self.files.insert(labels.file.clone(), bytes.clone());
                    let image = typodont_formats::nrrd::parse(&bytes).map_err(|e| ("wrong-volume", e.to_string()))?;
                    let mask =
                        crate::tooth_import::mask(&image, labels.value).map_err(|e| ("wrong-volume", e.to_string()))?;
                    Ok(Mask { dims: image.geometry.dims, is_inside: mask })
                });
                match mask {
                    Ok(mask) => ZoneRegion::Mask(Arc::new(mask)),
                    Err((code, message)) => {
                        self.complain(&path, code, format!("\"{}\": {message}", labels.file), "");
                        return None;
                    }
                }
            }
        })
    }
}
