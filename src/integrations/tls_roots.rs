//! Certificate authorities that TLS connections trust.

use ureq::tls::{Certificate, PemItem, RootCerts, TlsConfig, parse_pem};

/// TLS configuration. `roots` are certificates in PEM that replace the public authorities.
///
/// # Errors
/// A message if `roots` contains no certificate.
pub fn tls_config(roots: Option<&[u8]>) -> Result<TlsConfig, String> {
    let Some(pem) = roots else { return Ok(TlsConfig::default()) };
    let certificates: Vec<Certificate<'static>> = parse_pem(pem)
        .filter_map(|item| match item {
            Ok(PemItem::Certificate(certificate)) => Some(certificate),
            _ => None,
        })
        .collect();
    if certificates.is_empty() {
        return Err("the file of certificates contains no PEM certificate".into());
    }
    Ok(TlsConfig::builder().root_certs(RootCerts::from(certificates)).build())
}
