//! A connection to the database, which is opened again after an interruption.

use super::records::{describe_db_error, is_transient};
use super::retry::{RetryPolicy, Transient};
use postgres::{Client, Config, Error};
use tokio_postgres_rustls::MakeRustlsConnect;

/// Error of a query.
#[derive(Debug)]
pub enum DbError {
    /// The database is unreachable, or temporarily unable to answer.
    Unavailable(String),
    /// The database denies access, or rejects the query.
    Rejected(Error),
}

impl Transient for DbError {
    fn is_transient(&self) -> bool {
        matches!(self, DbError::Unavailable(_))
    }
}

impl From<Error> for DbError {
    fn from(error: Error) -> DbError {
        match is_transient(&error) {
            true => DbError::Unavailable(describe_db_error(&error)),
            false => DbError::Rejected(error),
        }
    }
}

/// Address of the database, with the settings of its connection.
pub struct DbConnection {
    config: Config,
    /// TLS for a connection to another computer; `None` for a local address that does not require it.
    tls: Option<MakeRustlsConnect>,
    retry_policy: RetryPolicy,
    client: Option<Client>,
}

impl DbConnection {
    /// A connection that is opened by its first query. Without `tls` nothing is encrypted: for a local address.
    pub fn new(config: Config, tls: Option<MakeRustlsConnect>, retry_policy: RetryPolicy) -> DbConnection {
        DbConnection { config, tls, retry_policy, client: None }
    }

    /// Opens the connection, for statements that must not run twice.
    ///
    /// # Errors
    /// As [`DbConnection::query_with_retry`].
    pub fn into_client(mut self) -> Result<Client, DbError> {
        let retry_policy = self.retry_policy;
        retry_policy.retry(|| self.connect().map(|_| ()))?;
        self.client.ok_or_else(|| DbError::Unavailable("the connection was closed".to_string()))
    }

    /// Runs a query that may safely run twice: it is repeated if its answer is lost.
    ///
    /// # Errors
    /// [`DbError::Unavailable`] if the database is still unreachable when the retries end; [`DbError::Rejected`] if it
    /// denies access or rejects the query.
    pub fn query_with_retry<T>(
        &mut self,
        mut query: impl FnMut(&mut Client) -> Result<T, Error>,
    ) -> Result<T, DbError> {
        let retry_policy = self.retry_policy;
        retry_policy.retry(|| {
            let result = self.connect().and_then(|client| query(client).map_err(DbError::from));
            if result.as_ref().is_err_and(Transient::is_transient) {
                self.client = None;
            }
            result
        })
    }

    /// Runs a query once, without retries.
    ///
    /// # Errors
    /// As [`DbConnection::query_with_retry`], after one attempt.
    pub fn query_once<T>(&mut self, query: impl FnMut(&mut Client) -> Result<T, Error>) -> Result<T, DbError> {
        let retry_policy = std::mem::replace(&mut self.retry_policy, RetryPolicy(std::time::Duration::ZERO));
        let result = self.query_with_retry(query);
        self.retry_policy = retry_policy;
        result
    }

    /// Another connection to the same database, not yet open.
    pub fn new_connection(&self) -> DbConnection {
        DbConnection {
            config: self.config.clone(),
            tls: self.tls.clone(),
            retry_policy: self.retry_policy,
            client: None,
        }
    }

    fn connect(&mut self) -> Result<&mut Client, DbError> {
        let client = match self.client.take().filter(|client| !client.is_closed()) {
            Some(client) => client,
            None => match &self.tls {
                Some(tls) => self.config.connect(tls.clone())?,
                None => self.config.connect(postgres::NoTls)?,
            },
        };
        Ok(self.client.insert(client))
    }
}
