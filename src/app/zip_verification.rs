//! Verification of a ZIP file that the user gives to the window: on a thread of its own or, in a page, which has no threads,
//! within a frame.

use crate::given_file::{GivenContent, GivenFile};
use crate::platform;
use std::sync::mpsc::{self, Receiver, TryRecvError};
use typodont_report::bundle::{BundleFolder, SESSION_FILE, Verification, VerificationOutcome, sha256, verify};
use typodont_report::{SessionFile, Templates};

/// A ZIP file that is being verified, and the answer once there is one.
pub struct ZipVerification {
    pub file_name: String,
    /// Number of files that were given with it and are not verified.
    pub left_out: usize,
    pub answer: Option<ZipAnswer>,
    work: VerificationWork,
}

/// Answer about a file.
#[derive(Clone, Debug)]
pub struct ZipAnswer {
    /// SHA-256 of the file; `None` for one that cannot be read.
    pub sha256: Option<String>,
    /// The findings, or the reason why the file cannot be verified at all.
    pub findings: Result<BundleFindings, String>,
}

/// Findings of a verification.
#[derive(Clone, Debug)]
pub struct BundleFindings {
    pub verification: Verification,
    /// The result in the file; `None` unless everything in it that could be judged follows from the recording.
    pub session: Option<Box<SessionFile>>,
}

/// Work that remains to be done.
enum VerificationWork {
    /// The file is verified within a frame, after some frames.
    InFrame {
        content: GivenContent,
        templates: Templates,
        frames_left: u32,
    },
    OnThread(Receiver<ZipAnswer>),
    Over,
}

impl ZipVerification {
    /// Begins to verify a file. The page in the bundle may be made from `templates` or the shipped ones. `wake` is called
    /// when the answer is there.
    pub fn begin(file: GivenFile, templates: Templates, wake: Box<dyn Fn() + Send>) -> ZipVerification {
        let GivenFile { name: file_name, content, left_out } = file;
        if platform::IS_PAGE {
            let work = VerificationWork::InFrame { content, templates, frames_left: platform::FRAMES_BEFORE_LONG_STEP };
            return ZipVerification { file_name, left_out, answer: None, work };
        }
        let (sender, answer) = mpsc::channel();
        let name = file_name.clone();
        let verify = move || {
            // The window may show something else by now.
            let _ = sender.send(ZipAnswer::about(&name, content, &templates));
            wake();
        };
        let (answer, work) = match std::thread::Builder::new().name("verification".into()).spawn(verify) {
            Ok(_) => (None, VerificationWork::OnThread(answer)),
            Err(e) => {
                let why = format!("no-thread: the file cannot be verified: {e}");
                (Some(ZipAnswer { sha256: None, findings: Err(why) }), VerificationWork::Over)
            }
        };
        ZipVerification { file_name, left_out, answer, work }
    }

    /// Takes over the answer once it is there; in a page, this verifies the file.
    pub fn poll(&mut self) {
        let answer = match std::mem::replace(&mut self.work, VerificationWork::Over) {
            VerificationWork::InFrame { content, templates, frames_left: frames_left @ 1.. } => {
                self.work = VerificationWork::InFrame { content, templates, frames_left: frames_left - 1 };
                return;
            }
            VerificationWork::InFrame { content, templates, .. } => {
                ZipAnswer::about(&self.file_name, content, &templates)
            }
            VerificationWork::OnThread(answer) => match answer.try_recv() {
                Ok(answer) => answer,
                Err(TryRecvError::Empty) => {
                    self.work = VerificationWork::OnThread(answer);
                    return;
                }
                Err(TryRecvError::Disconnected) => {
                    let why = "unverified: the verification stopped; please report this".to_string();
                    ZipAnswer { sha256: None, findings: Err(why) }
                }
            },
            VerificationWork::Over => return,
        };
        self.answer = Some(answer);
    }

    /// The answer in a word, for the state log.
    pub fn answer_word(&self) -> &'static str {
        match self.answer.as_ref().map(|answer| &answer.findings) {
            None => "pending",
            Some(Err(_)) => "unreadable",
            Some(Ok(findings)) => match findings.outcome() {
                VerificationOutcome::Verified => "verified",
                VerificationOutcome::PartlyVerified => "partly verified",
                VerificationOutcome::Differs => "differs",
            },
        }
    }

    /// True if the verification goes on only with further frames.
    pub fn needs_frames(&self) -> bool {
        matches!(self.work, VerificationWork::InFrame { .. })
    }
}

impl ZipAnswer {
    /// Reads a file and verifies it.
    fn about(name: &str, content: GivenContent, templates: &Templates) -> ZipAnswer {
        match content.read() {
            Ok(bytes) => ZipAnswer { sha256: Some(sha256(&bytes)), findings: verify_zip(name, &bytes, templates) },
            Err(why) => ZipAnswer { sha256: None, findings: Err(why) },
        }
    }
}

impl BundleFindings {
    pub fn outcome(&self) -> VerificationOutcome {
        self.verification.outcome()
    }

    /// Everything that was found: differences, parts that were not judged, and remarks.
    pub fn lines(&self) -> impl Iterator<Item = &str> {
        let Verification { complaints, unverified, remarks } = &self.verification;
        complaints.iter().chain(unverified).chain(remarks).map(String::as_str)
    }
}

/// Verifies the bundle in a ZIP file, as `typodont verify` does.
fn verify_zip(name: &str, bytes: &[u8], templates: &Templates) -> Result<BundleFindings, String> {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let bundle = BundleFolder::from_zip(bytes, stem).map_err(|why| format!("wrong-zip: {why}"))?;
    let verification = verify(&bundle, &[templates.clone(), Templates::shipped()])?;
    let is_trusted = verification.outcome() != VerificationOutcome::Differs;
    let session = bundle.read(SESSION_FILE).ok().filter(|_| is_trusted);
    let session = session.and_then(|text| serde_json::from_slice(&text).ok());
    Ok(BundleFindings { verification, session })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;
    use std::path::Path;
    use std::time::{Duration, Instant};

    fn example() -> BundleFolder {
        BundleFolder::on_disk(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../reports/example"))
    }

    fn answer(content: GivenContent) -> ZipAnswer {
        let file = GivenFile { name: "example.zip".into(), content, left_out: 0 };
        let mut verification = ZipVerification::begin(file, Templates::shipped(), Box::new(|| ()));
        let begun = Instant::now();
        while verification.answer.is_none() {
            assert!(begun.elapsed() < Duration::from_secs(300), "the verification does not end");
            std::thread::sleep(Duration::from_millis(5));
            verification.poll();
        }
        verification.answer.unwrap()
    }

    #[test]
    fn a_genuine_result_is_verified_and_shown() {
        let zip = example().to_zip().unwrap();
        let answer = answer(GivenContent::Read(Ok(zip.clone())));
        let findings = answer.findings.unwrap();
        let lines: Vec<&str> = findings.lines().collect();
        assert_eq!(findings.outcome(), VerificationOutcome::Verified, "{lines:?}");
        assert_eq!(answer.sha256, Some(sha256(&zip)));
        let session = findings.session.unwrap();
        assert_eq!((session.participant.as_str(), session.operator.as_deref()), ("example", Some("hasty")));
    }

    #[test]
    fn a_forged_result_differs_and_its_points_are_not_shown() {
        let genuine = example();
        let names = genuine.names();
        let mut files: BTreeMap<String, Vec<u8>> =
            names.into_iter().map(|name| (name.clone(), genuine.read(&name).unwrap().into_owned())).collect();
        let session = String::from_utf8(files[SESSION_FILE].clone()).unwrap();
        assert!(session.contains("\"passed\": false"), "the example does not pass");
        files.insert(SESSION_FILE.into(), session.replacen("\"passed\": false", "\"passed\": true", 1).into_bytes());
        let forged = BundleFolder::InMemory { name: "example".into(), files };
        let findings = answer(GivenContent::Read(forged.to_zip())).findings.unwrap();
        assert_eq!(findings.outcome(), VerificationOutcome::Differs);
        assert!(findings.session.is_none());
        assert!(findings.lines().count() > 0);
    }

    #[test]
    fn a_file_that_is_no_bundle_is_said_to_be_none() {
        let why = |content| answer(content).findings.unwrap_err();
        assert!(why(GivenContent::Read(Ok(b"no archive".to_vec()))).starts_with("wrong-zip: "));
        assert_eq!(why(GivenContent::Read(Err("unreadable-file: gone".into()))), "unreadable-file: gone");
        assert!(why(GivenContent::OnDisk(example().path().join("none.zip"))).contains("none.zip"));
    }
}
