//! A bundle as one ZIP file, to be handed in, kept or sent.

use super::bundle_folder::BundleFolder;
use std::collections::BTreeMap;
use typodont_exercise::record;
use typodont_formats::zip;

/// Folder that a file manager adds to the archives that it makes.
const FILE_MANAGERS: &str = "__MACOSX/";

impl BundleFolder {
    /// The bundle as one ZIP archive, in which all files are in a folder with the bundle's name. Equal bundles give equal
    /// bytes.
    ///
    /// # Errors
    ///
    /// When a file cannot be read.
    pub fn to_zip(&self) -> Result<Vec<u8>, String> {
        let mut files = Vec::new();
        for name in self.names() {
            let bytes = self.read(&name).map_err(|why| format!("{}: {name}: {why}", self.path().display()))?;
            files.push((format!("{}/{name}", self.name()), bytes));
        }
        let files = files.iter().map(|(name, bytes)| (name.clone(), bytes.as_ref()));
        zip::write(files).map_err(|error| format!("{}: {error}", self.path().display()))
    }

    /// The bundle of a ZIP archive, in memory; its files may be in a folder of the archive. `otherwise` is its name if
    /// they are not.
    ///
    /// # Errors
    ///
    /// When the bytes are not an archive, or not that of exactly one bundle.
    pub fn from_zip(bytes: &[u8], otherwise: &str) -> Result<BundleFolder, String> {
        let mut files = zip::read(bytes).map_err(|error| error.to_string())?;
        files.retain(|name, _| !name.starts_with(FILE_MANAGERS));
        let folder_of = |name: &str| match name.strip_suffix(record::FILE_NAME)? {
            folder if folder.is_empty() || folder.ends_with('/') => Some(folder.to_string()),
            _ => None,
        };
        let folders: Vec<String> = files.keys().filter_map(|name| folder_of(name)).collect();
        let [folder] = &folders[..] else {
            return Err(match folders.len() {
                0 => format!("the archive has no {}; give the ZIP file of a bundle", record::FILE_NAME),
                count => format!("the archive has {count} recordings; unpack it and give one of its bundles"),
            });
        };
        // A file outside the bundle's folder must not replace one in it: no file of an archive may begin with "../".
        let short = |name: String| name.strip_prefix(folder).map_or_else(|| format!("../{name}"), str::to_string);
        let files: BTreeMap<String, Vec<u8>> = files.into_iter().map(|(name, bytes)| (short(name), bytes)).collect();
        let last = folder.trim_end_matches('/').rsplit('/').next().filter(|last| !last.is_empty());
        Ok(BundleFolder::InMemory { name: last.unwrap_or(otherwise).to_string(), files })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Templates;
    use crate::bundle::{VerificationOutcome, verify};
    use std::path::Path;

    fn in_memory(names: &[&str]) -> BundleFolder {
        let files = names.iter().map(|name| (name.to_string(), name.as_bytes().to_vec())).collect();
        BundleFolder::InMemory { name: "a_1".into(), files }
    }

    #[test]
    fn a_bundle_on_disk_is_the_same_in_a_zip() {
        let example = BundleFolder::on_disk(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../reports/example"));
        let read = BundleFolder::from_zip(&example.to_zip().unwrap(), "other").unwrap();
        assert_eq!((read.name(), read.names()), (example.name(), example.names()));
        for name in example.names() {
            assert_eq!(read.read(&name), example.read(&name), "{name}");
        }
    }

    #[test]
    fn a_file_beside_the_folder_of_a_bundle_does_not_replace_a_forged_one() {
        // Aim: what is verified is what anybody finds who unpacks the folder. Method: a changed session.json in the bundle,
        // and the true one beside its folder.
        let example = BundleFolder::on_disk(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../reports/example"));
        let name = "session.json";
        let genuine = example.read(name).unwrap().into_owned();
        let forged = [genuine.as_slice(), b" "].concat();
        let read = |name: &str| example.read(name).unwrap().into_owned();
        let mut files: Vec<(String, Vec<u8>)> =
            example.names().iter().filter(|n| *n != name).map(|n| (format!("a/{n}"), read(n))).collect();
        files.extend([(format!("a/{name}"), forged.clone()), (name.to_string(), genuine)]);
        let archive = zip::write(files.iter().map(|(name, bytes)| (name.clone(), bytes.as_slice()))).unwrap();
        let bundle = BundleFolder::from_zip(&archive, "other").unwrap();
        assert_eq!(bundle.read(name).unwrap().as_ref(), forged);
        let verification = verify(&bundle, &[Templates::shipped()]).unwrap();
        assert_eq!(verification.outcome(), VerificationOutcome::Differs, "{:?}", verification.complaints);
    }

    #[test]
    fn an_archive_of_one_bundle_is_found_wherever_its_files_are() {
        let pack = |names: &[&str]| zip::write(names.iter().map(|name| (name.to_string(), name.as_bytes()))).unwrap();
        let read = |names: &[&str]| BundleFolder::from_zip(&pack(names), "other");
        let names = ["recording.mcap", "session.json", "views/front.png"];
        assert_eq!(BundleFolder::from_zip(&in_memory(&names).to_zip().unwrap(), "other"), Ok(in_memory(&names)));
        assert_eq!(read(&names).unwrap().name(), "other");
        let inside = ["class/anna/recording.mcap", "class/anna/session.json", "class/note.txt", "__MACOSX/class/x"];
        let found = read(&inside).unwrap();
        assert_eq!(
            (&*found.name(), found.names().join(" ")),
            ("anna", "../class/note.txt recording.mcap session.json".into())
        );
        assert!(read(&["a/recording.mcap", "b/recording.mcap"]).unwrap_err().contains("2 recordings"));
        assert!(read(&["session.json", "my-recording.mcap"]).unwrap_err().contains("no recording.mcap"));
    }
}
