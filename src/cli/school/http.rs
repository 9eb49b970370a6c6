//! What stores of objects are asked, over HTTP: one request, one answer, by the same client as everything else here.

use crate::cli::trusted;
use async_trait::async_trait;
use http_body_util::BodyExt;
use object_store::ClientOptions;
use object_store::client::{
    HttpClient, HttpConnector, HttpError, HttpErrorKind, HttpRequest, HttpResponse, HttpResponseBody, HttpService,
};
use std::io;
use std::time::Duration;
use ureq::{Agent, http};

/// For one request with its answer: a part of 8 MiB over a bad line.
const TIMEOUT: Duration = Duration::from_secs(180);

/// Bytes of an answer: more than a part has.
const ANSWER_MAX: u64 = 256 << 20;

/// Hosts that give machines in a cloud their credentials, over plain HTTP on a link of their own.
const METADATA: [&str; 4] = ["169.254.169.254", "169.254.170.2", "169.254.170.23", "metadata.google.internal"];

#[derive(Clone, Debug)]
pub struct Client {
    near: Agent,
    far: Agent,
}

impl Client {
    /// `roots` are certificates in PEM to trust in place of the usual.
    pub fn new(roots: Option<&[u8]>) -> Result<Client, String> {
        let tls = trusted::tls(roots)?;
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
        // What is near is not asked for through a proxy.
        Ok(Client { near: agent(None), far: agent(ureq::Proxy::try_from_env()) })
    }
}

impl HttpConnector for Client {
    fn connect(&self, _: &ClientOptions) -> object_store::Result<HttpClient> {
        Ok(HttpClient::new(self.clone()))
    }
}

#[async_trait]
impl HttpService for Client {
    async fn call(&self, request: HttpRequest) -> Result<HttpResponse, HttpError> {
        let (head, body) = request.into_parts();
        let host = head.uri.host().unwrap_or_default().trim_matches(['[', ']']).to_string();
        let is_near = host == "localhost" || host.parse::<std::net::IpAddr>().is_ok_and(|ip| ip.is_loopback());
        let is_plain = head.uri.scheme_str() != Some("https");
        if is_plain && !is_near && !METADATA.contains(&host.as_str()) {
            let why = format!("plain-http: what goes to {host} could be read on the way; use https");
            return Err(HttpError::new(HttpErrorKind::Unknown, io::Error::other(why)));
        }
        let agent = if is_plain { self.near.clone() } else { self.far.clone() };
        let body = body.collect().await?.to_bytes();
        let asked = tokio::task::spawn_blocking(move || ask(&agent, head, &body));
        match asked.await {
            Ok(Ok(answer)) => Ok(answer),
            Ok(Err(error)) => Err(HttpError::new(kind(&error), error)),
            Err(error) => Err(HttpError::new(HttpErrorKind::Unknown, error)),
        }
    }
}

fn ask(agent: &Agent, head: http::request::Parts, body: &[u8]) -> Result<HttpResponse, ureq::Error> {
    let takes_body = head.method == http::Method::PUT || head.method == http::Method::POST;
    let answer = match takes_body {
        true => agent.run(http::Request::from_parts(head, body))?,
        false => agent.run(http::Request::from_parts(head, ()))?,
    };
    let (head, mut body) = answer.into_parts();
    let bytes = body.with_config().limit(ANSWER_MAX).read_to_vec()?;
    Ok(HttpResponse::from_parts(head, HttpResponseBody::from(bytes)))
}

/// What of it may pass.
fn kind(error: &ureq::Error) -> HttpErrorKind {
    match error {
        ureq::Error::Timeout(_) => HttpErrorKind::Timeout,
        ureq::Error::ConnectionFailed | ureq::Error::HostNotFound => HttpErrorKind::Connect,
        ureq::Error::Io(error) if error.kind() == io::ErrorKind::ConnectionRefused => HttpErrorKind::Connect,
        ureq::Error::Io(_) => HttpErrorKind::Interrupted,
        _ => HttpErrorKind::Unknown,
    }
}
