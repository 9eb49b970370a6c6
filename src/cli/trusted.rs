//! Whom a program that speaks TLS trusts.

use ureq::tls::{Certificate, PemItem, RootCerts, TlsConfig, parse_pem};

/// `roots` are certificates in PEM to trust in place of the usual; a file without any is refused.
pub fn tls(roots: Option<&[u8]>) -> Result<TlsConfig, String> {
    let Some(pem) = roots else { return Ok(TlsConfig::default()) };
    let certificates: Vec<Certificate<'static>> = parse_pem(pem)
        .filter_map(|item| match item {
            Ok(PemItem::Certificate(certificate)) => Some(certificate),
            _ => None,
        })
        .collect();
    if certificates.is_empty() {
        return Err("the file of certificates holds none in PEM".into());
    }
    Ok(TlsConfig::builder().root_certs(RootCerts::from(certificates)).build())
}
