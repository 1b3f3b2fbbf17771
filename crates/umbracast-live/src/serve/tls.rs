//! The page over TLS, if the build has the feature.

use std::path::Path;

use tokio::io::{AsyncRead, AsyncWrite};
#[cfg(feature = "tls")]
use tokio_rustls::rustls::{
    self,
    pki_types::{CertificateDer, PrivateKeyDer, pem::PemObject},
};
use umbracast::Error;

/// Who we are, for every client.
#[cfg(feature = "tls")]
#[derive(Clone)]
pub struct Tls(tokio_rustls::TlsAcceptor);

#[cfg(feature = "tls")]
impl Tls {
    /// Reads a certificate, its issuers behind it, and its key.
    ///
    /// # Errors
    /// Files that are not there or not what they should be; a key of another certificate.
    pub fn open(cert: &Path, key: &Path) -> Result<Self, Error> {
        let certs: Vec<CertificateDer<'static>> = CertificateDer::pem_file_iter(cert)
            .and_then(Iterator::collect)
            .map_err(|e| Error::new(format!("expected a certificate, found {e}")).within(cert.display()))?;
        let secret = PrivateKeyDer::from_pem_file(key)
            .map_err(|e| Error::new(format!("expected a key, found {e}")).within(key.display()))?;
        let config =
            rustls::ServerConfig::builder_with_provider(rustls::crypto::ring::default_provider().into())
                .with_safe_default_protocol_versions()
                .and_then(|builder| builder.with_no_client_auth().with_single_cert(certs, secret))
                .map_err(|e| Error::new(e.to_string()).within(cert.display()))?;
        Ok(Self(std::sync::Arc::new(config).into()))
    }

    /// Agrees with a client; `None` where they do not.
    pub async fn accept<S: AsyncRead + AsyncWrite + Unpin>(
        &self,
        stream: S,
    ) -> Option<tokio_rustls::server::TlsStream<S>> {
        self.0.accept(stream).await.ok()
    }
}

/// Nobody: it is never made.
#[cfg(not(feature = "tls"))]
#[derive(Clone)]
pub enum Tls {}

#[cfg(not(feature = "tls"))]
impl Tls {
    /// Says that there is none.
    ///
    /// # Errors
    /// Always.
    pub fn open(cert: &Path, _key: &Path) -> Result<Self, Error> {
        let expected =
            "expected a program built with the feature `tls` (cargo build --features tls), found one without";
        Err(Error::new(expected).within(cert.display()))
    }

    /// Never called.
    pub async fn accept<S: AsyncRead + AsyncWrite + Unpin>(&self, _stream: S) -> Option<S> {
        match *self {}
    }
}

#[cfg(test)]
#[path = "tls_tests.rs"]
mod tests;
