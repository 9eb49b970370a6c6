//! imsmanifest.xml: IMS Content Packaging 1.1.2 (SCORM 1.2) and 1.1.4 (SCORM 2004, 4th edition).

use super::xml::Element;
use super::{Course, PackageStandard};
use crate::iri::percent_encode;

/// Maximum length of a title that both standards guarantee, characters.
const TITLE_MAX: usize = 200;

/// Manifest of a package with these files.
pub(super) fn manifest(course: &Course, standard: PackageStandard, files: &[String]) -> String {
    let is_2004 = standard == PackageStandard::Scorm2004;
    let manifest = Element::new("manifest").attribute("identifier", format!("typodont-{}", course.digest()));
    let manifest = match is_2004 {
        true => manifest
            .attribute("version", "1")
            .attribute("xmlns", "http://www.imsglobal.org/xsd/imscp_v1p1")
            .attribute("xmlns:adlcp", "http://www.adlnet.org/xsd/adlcp_v1p3")
            .attribute("xmlns:imsss", "http://www.imsglobal.org/xsd/imsss"),
        false => manifest
            .attribute("version", "1")
            .attribute("xmlns", "http://www.imsproject.org/xsd/imscp_rootv1p1p2")
            .attribute("xmlns:adlcp", "http://www.adlnet.org/xsd/adlcp_rootv1p2"),
    };
    let version = if is_2004 { "2004 4th Edition" } else { "1.2" };
    let metadata = Element::new("metadata")
        .child(Element::with_text("schema", "ADL SCORM"))
        .child(Element::with_text("schemaversion", version));
    manifest
        .child(metadata)
        .child(Element::new("organizations").attribute("default", "course").child(organization(course, is_2004)))
        .child(resources(course, is_2004, files))
        .into_document()
}

fn organization(course: &Course, is_2004: bool) -> Element {
    let items = course.exercises.iter().enumerate().map(|(index, exercise)| {
        let item = Element::new("item")
            .attribute("identifier", format!("item-{index}"))
            .attribute("identifierref", format!("exercise-{index}"))
            .attribute("isvisible", "true")
            .child(title(exercise.title()));
        if is_2004 { item.child(sequencing(delivery_controls())) } else { item }
    });
    let organization =
        Element::new("organization").attribute("identifier", "course").child(title(&course.title)).children(items);
    if !is_2004 {
        return organization;
    }
    // Exercises may be chosen in any order, or follow one another.
    let modes = Element::new("imsss:controlMode").attribute("choice", "true").attribute("flow", "true");
    organization.child(sequencing(modes))
}

fn sequencing(content: Element) -> Element {
    Element::new("imsss:sequencing").child(content)
}

/// The page itself reports completion and success: nothing is assumed in their absence.
fn delivery_controls() -> Element {
    Element::new("imsss:deliveryControls")
        .attribute("completionSetByContent", "true")
        .attribute("objectiveSetByContent", "true")
}

fn title(text: &str) -> Element {
    Element::with_text("title", &text.chars().take(TITLE_MAX).collect::<String>())
}

fn resources(course: &Course, is_2004: bool, files: &[String]) -> Element {
    let kind = if is_2004 { "adlcp:scormType" } else { "adlcp:scormtype" };
    let file = |name: &String| {
        let path: Vec<String> = name.split('/').map(percent_encode).collect();
        Element::new("file").attribute("href", path.join("/"))
    };
    let starts = (0..course.exercises.len()).map(|index| {
        Element::new("resource")
            .attribute("identifier", format!("exercise-{index}"))
            .attribute("type", "webcontent")
            .attribute(kind, "sco")
            .attribute("href", Course::launch_address(index))
            .child(Element::new("file").attribute("href", "launch.html"))
            .child(Element::new("dependency").attribute("identifierref", "common"))
    });
    let common = Element::new("resource")
        .attribute("identifier", "common")
        .attribute("type", "webcontent")
        .attribute(kind, "asset")
        .children(files.iter().map(file));
    Element::new("resources").children(starts).child(common)
}
