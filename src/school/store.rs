//! The store of bundles: a folder, S3, Azure or Google, named by a URL.

use super::archive::Manifest;
use super::http_client::UreqHttpClient;
use super::records::is_plain_name;
use super::retry::{RetryPolicy, Transient};
use object_store::aws::{AmazonS3Builder, Checksum};
use object_store::azure::MicrosoftAzureBuilder;
use object_store::gcp::GoogleCloudStorageBuilder;
use object_store::local::LocalFileSystem;
use object_store::path::Path as Place;
use object_store::{ObjectStore, ObjectStoreExt, PutPayload, RetryConfig};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::Runtime;
use typodont_report::sanitize_display;
use url::Url;

/// Environment variable with the certificates to trust in place of the public authorities.
const CERTIFICATES_VARIABLE: &str = "TYPODONT_STORE_CERTIFICATES";

/// Maximum length of a store's error text that is printed, characters.
const ERROR_TEXT_MAX: usize = 400;

/// Error of a store.
#[derive(Debug)]
pub struct StoreError {
    pub why: String,
    is_transient: bool,
    /// True if the object does not exist.
    is_missing: bool,
}

impl Transient for StoreError {
    fn is_transient(&self) -> bool {
        self.is_transient
    }
}

impl From<object_store::Error> for StoreError {
    fn from(error: object_store::Error) -> StoreError {
        use object_store::Error as E;
        let is_missing = matches!(error, E::NotFound { .. });
        let is_permanent = matches!(
            error,
            E::PermissionDenied { .. } | E::Unauthenticated { .. } | E::InvalidPath { .. } | E::NotSupported { .. }
        );
        let why = sanitize_display(&error.to_string(), ERROR_TEXT_MAX);
        let is_plain_http = why.contains("plain-http:");
        StoreError { is_transient: !is_missing && !is_permanent && !is_plain_http, why, is_missing }
    }
}

/// A store; requests are repeated as the retry policy allows.
pub struct ObjectStoreHandle {
    runtime: Runtime,
    inner: Arc<dyn ObjectStore>,
    /// Prefix of all object names.
    base: Place,
    retry_policy: RetryPolicy,
    /// Path of the store, if it is a folder of this computer.
    folder: Option<PathBuf>,
}

impl ObjectStoreHandle {
    /// Opens a store by its URL.
    ///
    /// # Errors
    /// A message if the address is not valid.
    pub fn open(address: &str, retry_policy: RetryPolicy) -> Result<ObjectStoreHandle, String> {
        let url = Url::parse(address)
            .map_err(|e| format!("\"{}\" is not an address: {e}", sanitize_display(address, 100)))?;
        if url.password().is_some() || url.query().is_some() || url.fragment().is_some() {
            return Err(
                "the address must not contain a secret, query or fragment; put keys into environment variables".into(),
            );
        }
        let roots = std::env::var_os(CERTIFICATES_VARIABLE).map(PathBuf::from);
        let roots = roots.map(|path| typodont_formats::read_file(&path).map_err(|d| d.headline())).transpose()?;
        let client = UreqHttpClient::new(roots.as_deref())?;
        let wrong = |e: object_store::Error| sanitize_display(&e.to_string(), ERROR_TEXT_MAX);
        // Long waits follow the retry policy; the crate's own retries cover short interruptions.
        let retry = RetryConfig { max_retries: 2, retry_timeout: Duration::from_secs(20), ..RetryConfig::default() };
        let mut base = Place::parse(url.path().trim_matches('/')).map_err(|e| e.to_string())?;
        let mut on_disk = None;
        let inner: Arc<dyn ObjectStore> = match url.scheme() {
            "file" => {
                let folder = url.to_file_path().map_err(|()| {
                    "the folder is on another computer; give a folder of this \
                computer"
                        .to_string()
                })?;
                std::fs::create_dir_all(&folder)
                    .map_err(|e| format!("unwritable-folder: {e}: {}", folder.display()))?;
                base = Place::default();
                on_disk = Some(folder.clone());
                let local = LocalFileSystem::new_with_prefix(folder).map_err(wrong)?;
                Arc::new(local.with_automatic_cleanup(true).with_fsync(true))
            }
            "s3" | "s3a" => {
                // Each part is sent with its SHA-256, which the store compares before it saves the part.
                let builder = AmazonS3Builder::from_env().with_url(address).with_retry(retry);
                let builder = builder.with_checksum_algorithm(Checksum::SHA256).with_allow_http(true);
                Arc::new(builder.with_http_connector(client).build().map_err(wrong)?)
            }
            "az" | "abfs" | "abfss" => {
                let builder = MicrosoftAzureBuilder::from_env().with_url(address).with_retry(retry);
                Arc::new(builder.with_allow_http(true).with_http_connector(client).build().map_err(wrong)?)
            }
            "gs" => {
                let builder = GoogleCloudStorageBuilder::from_env().with_url(address).with_retry(retry);
                Arc::new(builder.with_http_connector(client).build().map_err(wrong)?)
            }
            other => return Err(format!("the address must begin with file, s3, az or gs, not with {other}")),
        };
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_time()
            .max_blocking_threads(4)
            .build()
            .map_err(|e| e.to_string())?;
        Ok(ObjectStoreHandle { runtime, inner, base, retry_policy, folder: on_disk })
    }

    /// Opens a folder of this computer as a store, or a store by its URL.
    pub fn open_folder_or_url(place: &str, retry_policy: RetryPolicy) -> Result<ObjectStoreHandle, String> {
        if place.contains("://") {
            return ObjectStoreHandle::open(place, retry_policy);
        }
        let folder = std::path::absolute(Path::new(place)).map_err(|e| e.to_string())?;
        let url =
            Url::from_file_path(&folder).map_err(|()| format!("{}: the path is not a folder", folder.display()))?;
        ObjectStoreHandle::open(url.as_str(), retry_policy)
    }

    fn object_path(&self, name: &str) -> Place {
        name.split('/').fold(self.base.clone(), |place, part| place.join(part))
    }

    pub fn put(&self, name: &str, bytes: Vec<u8>) -> Result<(), StoreError> {
        let (place, payload) = (self.object_path(name), PutPayload::from(bytes));
        self.retry_policy.retry(|| {
            let put = self.inner.put(&place, payload.clone());
            Ok(self.runtime.block_on(put).map(|_| ())?)
        })
    }

    pub fn get(&self, name: &str) -> Result<Vec<u8>, StoreError> {
        let place = self.object_path(name);
        self.retry_policy.retry(|| {
            let bytes = self.runtime.block_on(async { self.inner.get(&place).await?.bytes().await });
            Ok(bytes?.to_vec())
        })
    }

    /// Reads an object; `None` if it does not exist.
    ///
    /// # Errors
    /// The store's error if the object exists, or may exist, but cannot be read.
    pub fn get_if_present(&self, name: &str) -> Result<Option<Vec<u8>>, StoreError> {
        match self.get(name) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(undone) if undone.is_missing => Ok(None),
            Err(undone) => Err(undone),
        }
    }

    /// Name and size, bytes, of all objects directly within a folder.
    pub fn list(&self, folder: &str) -> Result<Vec<(String, u64)>, StoreError> {
        let place = self.object_path(folder);
        let listed = self.retry_policy.retry(|| -> Result<_, StoreError> {
            Ok(self.runtime.block_on(self.inner.list_with_delimiter(Some(&place)))?)
        })?;
        let name = |place: &Place| place.filename().map(|name| format!("{folder}/{name}"));
        Ok(listed.objects.iter().filter_map(|object| Some((name(&object.location)?, object.size))).collect())
    }

    /// Removes an object; a missing one counts as removed.
    ///
    /// # Errors
    /// The store's error if the object cannot be removed.
    pub fn remove(&self, name: &str) -> Result<(), StoreError> {
        let place = self.object_path(name);
        self.retry_policy.retry(|| match self.runtime.block_on(self.inner.delete(&place)) {
            Err(object_store::Error::NotFound { .. }) => Ok(()),
            result => Ok(result?),
        })
    }

    /// Removes incomplete files that a killed program left directly within a folder, "" for the store's own. Only stores in a folder of this
    /// computer have such files, named `NAME#1`; in other stores an object is complete or absent.
    pub fn remove_partial_uploads(&self, folder: &str) {
        let is_within = folder.is_empty() || folder.split('/').all(is_plain_name);
        let own = self.folder.as_ref().filter(|_| is_within).map(|base| base.join(folder));
        let entries = own.and_then(|own| std::fs::read_dir(own).ok()).into_iter().flatten().flatten();
        for entry in entries.filter(|entry| entry.file_name().to_string_lossy().contains('#')) {
            // A file that cannot be removed is tried again by the next call.
            let _ = std::fs::remove_file(entry.path());
        }
    }

    /// Removes all objects directly within a folder; returns their number.
    pub fn remove_folder(&self, folder: &str) -> Result<usize, StoreError> {
        self.remove_partial_uploads(folder);
        let names = self.list(folder)?;
        for (name, _) in &names {
            self.remove(name)?;
        }
        Ok(names.len())
    }

    /// Reads a file of a bundle, and checks the digests of its parts and its own.
    ///
    /// # Errors
    /// A message, and true if another attempt may succeed; false if the bytes differ from those that were stored.
    pub fn read_bundle_file(&self, manifest: &Manifest, name: &str) -> Result<Vec<u8>, (String, bool)> {
        let file = manifest.file(name).ok_or((format!("{name}: the bundle does not contain this file"), false))?;
        let mut is_transient = false;
        let bytes = manifest.extract(file, |index| {
            self.get(&manifest.part_name(index)).map_err(|undone| {
                is_transient = true;
                undone.why
            })
        });
        bytes.map_err(|why| (why, is_transient))
    }
}
