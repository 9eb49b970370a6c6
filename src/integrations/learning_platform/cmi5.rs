//! cmi5.xml: the course structure of cmi5 (Quartz), chapter 13.

use super::Course;
use super::xml::Element;
use crate::iri;

/// Course structure of a package; its addresses are relative to the archive.
pub(super) fn course_structure(course: &Course) -> String {
    let base = iri::extension(&format!("course-{}", course.digest()));
    let head = Element::new("course")
        .attribute("id", base.clone())
        .child(texts("title", &[("en".to_string(), course.title.clone())]))
        .child(texts("description", &[("en".to_string(), course.title.clone())]));
    let units = course.exercises.iter().enumerate().map(|(index, exercise)| {
        let description: Vec<_> =
            exercise.titles.iter().take(1).map(|(code, _)| (code.clone(), exercise.summary.clone())).collect();
        Element::new("au")
            .attribute("id", format!("{base}/{}", iri::percent_encode(&exercise.id)))
            .attribute("moveOn", if exercise.is_graded { "Passed" } else { "Completed" })
            .attribute("launchMethod", "AnyWindow")
            .child(texts("title", &exercise.titles))
            .child(texts("description", &description))
            .child(Element::with_text("url", &Course::launch_address(index)))
    });
    Element::new("courseStructure")
        .attribute("xmlns", "https://w3id.org/xapi/profiles/cmi5/v1/CourseStructure.xsd")
        .child(head)
        .children(units)
        .into_document()
}

/// Text by language.
fn texts(name: &'static str, texts: &[(String, String)]) -> Element {
    let strings =
        texts.iter().map(|(code, text)| Element::with_text("langstring", text).attribute("lang", code.clone()));
    Element::new(name).children(strings)
}
