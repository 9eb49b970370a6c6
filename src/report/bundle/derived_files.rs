//! The files of a bundle that follow from its recording.

use super::template_name::with_template_name;
use super::{CompletionObserver, CompletionStep, REPORT_FILE, SESSION_FILE, sha256};
use crate::session_file::SessionFile;
use crate::templates::Templates;
use crate::{glb, labelmap, pictures, session_page};
use std::collections::BTreeMap;
use typodont_exercise::record;
use typodont_exercise::record::Recording;
use typodont_exercise::score::Scored;

/// Everything in a bundle that follows from its recording, by name.
pub(super) fn derive_files(
    recording: &Recording,
    bytes: &[u8],
    scored: &Scored,
    templates: &Templates,
    observer: CompletionObserver,
) -> Result<BTreeMap<String, Vec<u8>>, String> {
    observer(CompletionStep::Maps);
    let mut files = derive_maps(recording, scored)?;
    observer(CompletionStep::Surfaces);
    files.insert("performance.glb".to_string(), glb::encode(&pictures::surface_parts(scored))?);
    let views = pictures::all_pictures(recording, scored, &mut |done, all| {
        observer(CompletionStep::Pictures { done, all });
    });
    observer(CompletionStep::Page);
    files.extend(views.iter().map(|view| (format!("views/{}.png", view.name), view.png.clone())));
    let mut session = SessionFile::of(recording, scored);
    session.digests = files.iter().map(|(name, bytes)| (name.clone(), sha256(bytes))).collect();
    session.digests.insert(record::FILE_NAME.to_string(), sha256(bytes));
    session.template_sha256 = sha256(templates.session_source_text().as_bytes());
    let page = session_page::render(templates, recording, scored, &session, &views)?;
    let page = with_template_name(&page, &session.template_sha256);
    session.digests.insert(REPORT_FILE.to_string(), sha256(page.as_bytes()));
    files.insert(REPORT_FILE.to_string(), page.into_bytes());
    files.insert(SESSION_FILE.to_string(), session.to_json().into_bytes());
    Ok(files)
}

/// Label maps and removal times, by file name.
pub(crate) fn derive_maps(recording: &Recording, scored: &Scored) -> Result<BTreeMap<String, Vec<u8>>, String> {
    let workpiece = &scored.replay.workpiece;
    let tissues = &recording.scenario.tissues;
    let grid = workpiece.volume.grid();
    Ok(BTreeMap::from([
        ("initial.seg.nrrd".to_string(), labelmap::tissues(&workpiece.volume, tissues)?),
        ("final.seg.nrrd".to_string(), labelmap::tissues(&scored.replay.volume, tissues)?),
        ("performance.seg.nrrd".to_string(), labelmap::performance(grid, &scored.verdicts)?),
        ("removal_time.nrrd".to_string(), labelmap::removal_times(grid, &scored.removals)?),
    ]))
}
