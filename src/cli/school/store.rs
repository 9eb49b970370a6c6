//! The store of bundles: a folder, S3, Azure or Google, named by a URL.

use super::http::Client;
use super::patience::{Passing, Patience};
use crate::cli::Failure;
use crate::report::harmless;
use crate::school::Manifest;
use crate::school::records::is_name;
use clap::Args;
use hyper::body::Bytes;
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
use url::Url;

/// Where it is looked for if the command line does not say.
const ADDRESS: &str = "TYPODONT_STORE";
const CERTIFICATES: &str = "TYPODONT_STORE_CERTIFICATES";

/// Letters of a store's own words that are told.
const WORDS_MAX: usize = 400;

#[derive(Args, Clone)]
pub struct Named {
    /// The store of bundles: file:///folder, s3://bucket/folder, az://container/folder or gs://bucket/folder. Without it
    /// TYPODONT_STORE says so. Keys come from the environment, under the names that these services' own tools use
    #[arg(long, value_name = "URL")]
    pub store: Option<String>,
}

impl Named {
    pub fn is_named(&self) -> bool {
        self.store.is_some() || std::env::var_os(ADDRESS).is_some()
    }

    pub fn open(&self, patience: Patience) -> Result<Store, Failure> {
        let address = match &self.store {
            Some(address) => address.clone(),
            None => std::env::var(ADDRESS).map_err(|_| {
                Failure::misuse(format!("no-store: give --store, or its address in the environment's {ADDRESS}"))
            })?,
        };
        Store::open(&address, patience).map_err(|e| Failure::misuse(format!("--store: {e}")))
    }
}

/// Why the store did not do it.
#[derive(Debug)]
pub struct Undone {
    pub why: String,
    passing: bool,
    /// There is no such object.
    is_missing: bool,
}

impl Passing for Undone {
    fn is_passing(&self) -> bool {
        self.passing
    }
}

impl From<object_store::Error> for Undone {
    fn from(error: object_store::Error) -> Undone {
        use object_store::Error as E;
        let is_missing = matches!(error, E::NotFound { .. });
        let for_good = matches!(
            error,
            E::PermissionDenied { .. } | E::Unauthenticated { .. } | E::InvalidPath { .. } | E::NotSupported { .. }
        );
        let why = harmless(&error.to_string(), WORDS_MAX);
        let plain = why.contains("plain-http:");
        Undone { passing: !is_missing && !for_good && !plain, why, is_missing }
    }
}

impl From<Undone> for Failure {
    fn from(undone: Undone) -> Failure {
        Failure::wrong(format!("--store: no-answer: {}", undone.why))
    }
}

/// A store, tried again for as long as patience lasts.
pub struct Store {
    runtime: Runtime,
    inner: Arc<dyn ObjectStore>,
    /// What stands before every name.
    base: Place,
    patience: Patience,
    /// Where it lies, if it is a folder of this machine.
    folder: Option<PathBuf>,
}

impl Store {
    /// `Err` says what is wrong with the address.
    pub fn open(address: &str, patience: Patience) -> Result<Store, String> {
        let url = Url::parse(address).map_err(|e| format!("\"{}\" is no address: {e}", harmless(address, 100)))?;
        if url.password().is_some() || url.query().is_some() || url.fragment().is_some() {
            return Err("give it without a secret, query or fragment; keys come from the environment".into());
        }
        let roots = std::env::var_os(CERTIFICATES).map(PathBuf::from);
        let roots = roots.map(|path| crate::content::read_file(&path).map_err(|d| d.headline())).transpose()?;
        let client = Client::new(roots.as_deref())?;
        let wrong = |e: object_store::Error| harmless(&e.to_string(), WORDS_MAX);
        // Patience is ours; the crate's own covers what is short.
        let retry = RetryConfig { max_retries: 2, retry_timeout: Duration::from_secs(20), ..RetryConfig::default() };
        let mut base = Place::parse(url.path().trim_matches('/')).map_err(|e| e.to_string())?;
        let mut on_disk = None;
        let inner: Arc<dyn ObjectStore> = match url.scheme() {
            "file" => {
                let folder = url.to_file_path().map_err(|()| "a folder of another machine".to_string())?;
                std::fs::create_dir_all(&folder)
                    .map_err(|e| format!("unwritable-folder: {e}: {}", folder.display()))?;
                base = Place::default();
                on_disk = Some(folder.clone());
                let local = LocalFileSystem::new_with_prefix(folder).map_err(wrong)?;
                Arc::new(local.with_automatic_cleanup(true).with_fsync(true))
            }
            "s3" | "s3a" => {
                // Each part goes with its SHA-256, which the store compares before it keeps the part.
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
            other => return Err(format!("stores are named by file, s3, az or gs, not by {other}")),
        };
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_time()
            .max_blocking_threads(4)
            .build()
            .map_err(|e| e.to_string())?;
        Ok(Store { runtime, inner, base, patience, folder: on_disk })
    }

    /// A folder of this machine as a store, or one that is named by a URL.
    pub fn at(place: &str, patience: Patience) -> Result<Store, String> {
        if place.contains("://") {
            return Store::open(place, patience);
        }
        let folder = std::path::absolute(Path::new(place)).map_err(|e| e.to_string())?;
        let url = Url::from_file_path(&folder).map_err(|()| format!("{}: no folder", folder.display()))?;
        Store::open(url.as_str(), patience)
    }

    fn place(&self, name: &str) -> Place {
        name.split('/').fold(self.base.clone(), |place, part| place.join(part))
    }

    pub fn put(&self, name: &str, bytes: Vec<u8>) -> Result<(), Undone> {
        let (place, bytes) = (self.place(name), Bytes::from(bytes));
        self.patience.keep(|| {
            let put = self.inner.put(&place, PutPayload::from_bytes(bytes.clone()));
            Ok(self.runtime.block_on(put).map(|_| ())?)
        })
    }

    pub fn get(&self, name: &str) -> Result<Vec<u8>, Undone> {
        let place = self.place(name);
        self.patience.keep(|| {
            let bytes = self.runtime.block_on(async { self.inner.get(&place).await?.bytes().await });
            Ok(bytes?.to_vec())
        })
    }

    /// The same; `None` where there is none.
    pub fn find(&self, name: &str) -> Result<Option<Vec<u8>>, Undone> {
        match self.get(name) {
            Ok(bytes) => Ok(Some(bytes)),
            Err(undone) if undone.is_missing => Ok(None),
            Err(undone) => Err(undone),
        }
    }

    /// Name and size of everything right within a folder.
    pub fn list(&self, folder: &str) -> Result<Vec<(String, u64)>, Undone> {
        let place = self.place(folder);
        let listed = self.patience.keep(|| -> Result<_, Undone> {
            Ok(self.runtime.block_on(self.inner.list_with_delimiter(Some(&place)))?)
        })?;
        let name = |place: &Place| place.filename().map(|name| format!("{folder}/{name}"));
        Ok(listed.objects.iter().filter_map(|object| Some((name(&object.location)?, object.size))).collect())
    }

    /// Removes a file; one that is not there is removed.
    pub fn remove(&self, name: &str) -> Result<(), Undone> {
        let place = self.place(name);
        self.patience.keep(|| match self.runtime.block_on(self.inner.delete(&place)) {
            Err(object_store::Error::NotFound { .. }) => Ok(()),
            result => Ok(result?),
        })
    }

    /// Removes what a killed program left half written right within a folder. Only folders of this machine have such files, and call
    /// them `NAME#1`; elsewhere an object is whole or absent.
    pub fn settle(&self, folder: &str) {
        let is_within = folder.split('/').all(is_name);
        let own = self.folder.as_ref().filter(|_| is_within).map(|base| base.join(folder));
        let entries = own.and_then(|own| std::fs::read_dir(own).ok()).into_iter().flatten().flatten();
        for entry in entries.filter(|entry| entry.file_name().to_string_lossy().contains('#')) {
            // What cannot be removed is met again by whoever comes next.
            let _ = std::fs::remove_file(entry.path());
        }
    }

    /// Removes everything right within a folder; gives how much.
    pub fn clear(&self, folder: &str) -> Result<usize, Undone> {
        self.settle(folder);
        let names = self.list(folder)?;
        for (name, _) in &names {
            self.remove(name)?;
        }
        Ok(names.len())
    }

    /// A file of a bundle, checked by the digests of its parts and its own. The second of an error says whether trying again may
    /// help: not where the bytes are others than were stored.
    pub fn take(&self, manifest: &Manifest, name: &str) -> Result<Vec<u8>, (String, bool)> {
        let file = manifest.file(name).ok_or((format!("{name}: the bundle has none"), false))?;
        let mut passing = false;
        let bytes = manifest.take(file, |index| {
            self.get(&manifest.part_name(index)).map_err(|undone| {
                passing = true;
                undone.why
            })
        });
        bytes.map_err(|why| (why, passing))
    }
}
