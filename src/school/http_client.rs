//! HTTP client for object stores, based on the HTTP library used by the rest of the program.

use async_trait::async_trait;
use http_body_util::BodyExt;
use object_store::ClientOptions;
use object_store::client::{
    HttpClient, HttpConnector, HttpError, HttpErrorKind, HttpRequest, HttpResponse, HttpResponseBody, HttpService,
};
use std::io;
use std::time::Duration;
use typodont_integrations::{is_this_machine, tls_roots};
use ureq::{Agent, http};

/// Time limit of one request with its response: enough for a part of 8 MiB over a slow line.
const TIMEOUT: Duration = Duration::from_secs(180);

/// Maximum size of a response, bytes: more than a part has.
const RESPONSE_BYTES_MAX: u64 = 256 << 20;

/// Hosts that provide credentials to computers in a cloud, by plain HTTP on a separate link.
const CLOUD_METADATA_HOSTS: [&str; 4] =
    ["169.254.169.254", "169.254.170.2", "169.254.170.23", "metadata.google.internal"];

/// Client of an object store's HTTP interface.
#[derive(Clone, Debug)]
pub struct UreqHttpClient {
    direct: Agent,
    proxied: Agent,
}

impl UreqHttpClient {
    /// Creates a client. `roots` are certificates in PEM that replace the public authorities.
    ///
    /// # Errors
    ///
    /// A message if `roots` contains no certificate.
    pub fn new(roots: Option<&[u8]>) -> Result<UreqHttpClient, String> {
        let tls = tls_roots::tls_config(roots)?;
        let agent = |proxy| -> Agent {
            Agent::config_builder()
                .http_status_as_error(false)
                .timeout_global(Some(TIMEOUT))
                .max_redirects(0)
                .proxy(proxy)
                .tls_config(tls.clone())
                .user_agent(concat!("typodont/", env!("CARGO_PKG_VERSION")))
                .build()
                .into()
        };
        // Local addresses are requested without a proxy.
        Ok(UreqHttpClient { direct: agent(None), proxied: agent(ureq::Proxy::try_from_env()) })
    }
}

impl HttpConnector for UreqHttpClient {
    fn connect(&self, _: &ClientOptions) -> object_store::Result<HttpClient> {
        Ok(HttpClient::new(self.clone()))
    }
}

#[async_trait]
impl HttpService for UreqHttpClient {
    async fn call(&self, request: HttpRequest) -> Result<HttpResponse, HttpError> {
        let (head, body) = request.into_parts();
        let host = head.uri.host().unwrap_or_default().to_string();
        let is_plain = head.uri.scheme_str() != Some("https");
        if is_plain && !is_this_machine(&host) && !CLOUD_METADATA_HOSTS.contains(&host.as_str()) {
            let why = format!("plain-http: http would transmit data to {host} without encryption; use https");
            return Err(HttpError::new(HttpErrorKind::Unknown, io::Error::other(why)));
        }
        let agent = if is_plain { self.direct.clone() } else { self.proxied.clone() };
        let body = body.collect().await?.to_bytes();
        let response = tokio::task::spawn_blocking(move || send(&agent, head, &body));
        match response.await {
            Ok(Ok(answer)) => Ok(answer),
            Ok(Err(error)) => Err(HttpError::new(error_kind(&error), error)),
            Err(error) => Err(HttpError::new(HttpErrorKind::Unknown, error)),
        }
    }
}

fn send(agent: &Agent, head: http::request::Parts, body: &[u8]) -> Result<HttpResponse, ureq::Error> {
    let takes_body = head.method == http::Method::PUT || head.method == http::Method::POST;
    let answer = match takes_body {
        true => agent.run(http::Request::from_parts(head, body))?,
        false => agent.run(http::Request::from_parts(head, ()))?,
    };
    let (head, mut body) = answer.into_parts();
    let bytes = body.with_config().limit(RESPONSE_BYTES_MAX).read_to_vec()?;
    Ok(HttpResponse::from_parts(head, HttpResponseBody::from(bytes)))
}

/// Kind of an error, which decides on retries.
fn error_kind(error: &ureq::Error) -> HttpErrorKind {
    match error {
        ureq::Error::Timeout(_) => HttpErrorKind::Timeout,
        ureq::Error::ConnectionFailed | ureq::Error::HostNotFound => HttpErrorKind::Connect,
        ureq::Error::Io(error) if error.kind() == io::ErrorKind::ConnectionRefused => HttpErrorKind::Connect,
        ureq::Error::Io(_) => HttpErrorKind::Interrupted,
        _ => HttpErrorKind::Unknown,
    }
}
