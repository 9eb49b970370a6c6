//! Address of the bundle store, from the command line or the environment.

use crate::cli::CliError;
use clap::Args;
use typodont_school::retry::RetryPolicy;
use typodont_school::store::ObjectStoreHandle;

/// Environment variable with the store's address, if the command line does not give it.
const STORE_VARIABLE: &str = "TYPODONT_STORE";

#[derive(Args, Clone)]
pub struct StoreArguments {
    /// URL of the bundle store: file:///folder, s3://bucket/folder, az://container/folder or gs://bucket/folder; by default taken
    /// from TYPODONT_STORE. Keys are read from the environment variables that these services' own tools use
    #[arg(long, value_name = "URL")]
    pub store: Option<String>,
}

impl StoreArguments {
    pub fn is_configured(&self) -> bool {
        self.store.is_some() || std::env::var_os(STORE_VARIABLE).is_some()
    }

    pub fn open(&self, retry_policy: RetryPolicy) -> Result<ObjectStoreHandle, CliError> {
        let address = match &self.store {
            Some(address) => address.clone(),
            None => std::env::var(STORE_VARIABLE).map_err(|_| {
                CliError::misuse(format!("no-store: give --store, or set the environment variable {STORE_VARIABLE}"))
            })?,
        };
        ObjectStoreHandle::open(&address, retry_policy).map_err(|e| CliError::misuse(format!("--store: {e}")))
    }
}
