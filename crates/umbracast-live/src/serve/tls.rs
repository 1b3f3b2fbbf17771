//! The page over TLS, where this program was built with it.

use std::path::Path;

use tokio::io::{AsyncRead, AsyncWrite};
use umbracast::Error;

#[cfg(feature = "tls")]
pub use with::Tls;
#[cfg(not(feature = "tls"))]
pub use without::Tls;

#[cfg(feature = "tls")]
mod with {
    use std::sync::Arc;

    use tokio_rustls::TlsAcceptor;
    use tokio_rustls::rustls::ServerConfig;
    use tokio_rustls::rustls::crypto::ring;
    use tokio_rustls::rustls::pki_types::pem::PemObject;
    use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
    use tokio_rustls::server::TlsStream;

    use super::*;

    /// Who we are, for every client.
    #[derive(Clone)]
    pub struct Tls(TlsAcceptor);

    impl Tls {
        /// Reads a certificate, its issuers behind it, and its key.
        ///
        /// # Errors
        /// Files that are not there or not what they should be; a key of another certificate.
        pub fn open(cert: &Path, key: &Path) -> Result<Self, Error> {
            let certs: Vec<CertificateDer<'static>> =
                CertificateDer::pem_file_iter(cert).and_then(Iterator::collect).map_err(|e| {
                    Error::new(format!("expected a certificate, found {e}")).within(cert.display())
                })?;
            let secret = PrivateKeyDer::from_pem_file(key)
                .map_err(|e| Error::new(format!("expected a key, found {e}")).within(key.display()))?;
            let config = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
                .with_safe_default_protocol_versions()
                .and_then(|builder| builder.with_no_client_auth().with_single_cert(certs, secret))
                .map_err(|e| Error::new(e.to_string()).within(cert.display()))?;
            Ok(Self(TlsAcceptor::from(Arc::new(config))))
        }

        /// Agrees with a client; `None` where they do not.
        pub async fn accept<S: AsyncRead + AsyncWrite + Unpin>(&self, stream: S) -> Option<TlsStream<S>> {
            self.0.accept(stream).await.ok()
        }
    }
}

#[cfg(not(feature = "tls"))]
mod without {
    use super::*;

    /// Nobody: it is never made.
    #[derive(Clone)]
    pub enum Tls {}

    impl Tls {
        /// Says that there is none.
        ///
        /// # Errors
        /// Always.
        pub fn open(cert: &Path, _key: &Path) -> Result<Self, Error> {
            let expected = "expected a program built with the feature `tls` (cargo build --features tls), found one without";
            Err(Error::new(expected).within(cert.display()))
        }

        /// Never called.
        pub async fn accept<S: AsyncRead + AsyncWrite + Unpin>(&self, _stream: S) -> Option<S> {
            match *self {}
        }
    }
}

#[cfg(all(test, feature = "tls"))]
mod tests {
    use std::io::{Read, Write};
    use std::net::{SocketAddr, TcpStream};
    use std::path::PathBuf;
    use std::sync::Arc;

    use tokio_rustls::rustls::pki_types::CertificateDer;
    use tokio_rustls::rustls::pki_types::pem::PemObject;
    use tokio_rustls::rustls::{ClientConfig, ClientConnection, RootCertStore, StreamOwned, crypto::ring};
    use umbracast::Config;

    use super::super::{Door, Watched, start};
    use crate::clock::HostClock;

    fn file(name: &str) -> PathBuf {
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("testdata").join(name)
    }

    fn door(cert: &str, key: &str) -> Door {
        let address = SocketAddr::from(([127, 0, 0, 1], 0));
        Door { address, token: None, tls: Some((file(cert), file(key))) }
    }

    fn watched() -> Watched {
        let site = Config::default().site;
        Watched { site, counters: Arc::default(), clock: HostClock::start(), title: "a test".to_owned() }
    }

    #[test]
    fn a_client_that_knows_the_certificate_gets_the_page_and_one_without_tls_gets_nothing() {
        let server = start(door("tls_cert.pem", "tls_key.pem"), watched()).unwrap();
        let mut roots = RootCertStore::empty();
        roots.add(CertificateDer::from_pem_file(file("tls_cert.pem")).unwrap()).unwrap();
        let config = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
            .with_safe_default_protocol_versions()
            .unwrap()
            .with_root_certificates(roots)
            .with_no_client_auth();
        let ask = "GET /api/site HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n";
        let client = ClientConnection::new(Arc::new(config), "127.0.0.1".try_into().unwrap()).unwrap();
        let mut tls = StreamOwned::new(client, TcpStream::connect(server.address()).unwrap());
        tls.write_all(ask.as_bytes()).unwrap();
        let mut answer = String::new();
        tls.read_to_string(&mut answer).unwrap();
        assert!(answer.starts_with("HTTP/1.1 200") && answer.contains("a test"), "{answer}");
        let mut plain = TcpStream::connect(server.address()).unwrap();
        plain.write_all(ask.as_bytes()).unwrap();
        let mut answer = Vec::new();
        let _ = plain.read_to_end(&mut answer); // Closed or reset: both are right.
        assert!(!answer.starts_with(b"HTTP"), "{answer:?}");
        server.stop();
    }

    #[test]
    fn files_that_are_something_else_are_named() {
        for (cert, key, named) in
            [("tls_key.pem", "tls_key.pem", "tls_key.pem"), ("tls_cert.pem", "tls_cert.pem", "tls_cert.pem")]
        {
            let message = start(door(cert, key), watched()).err().unwrap().to_string();
            assert!(message.contains(named), "{message}");
        }
    }
}

#[cfg(all(test, not(feature = "tls")))]
mod tests {
    use super::*;

    #[test]
    fn without_the_feature_it_says_which_one() {
        let message = Tls::open(Path::new("a.pem"), Path::new("b.pem")).err().unwrap().to_string();
        assert!(message.contains("--features tls"), "{message}");
    }
}
