#[cfg(feature = "tls")]
mod with {
    use std::io::{Read, Write};
    use std::net::{SocketAddr, TcpStream};
    use std::path::PathBuf;
    use std::sync::Arc;

    use tokio_rustls::rustls::pki_types::CertificateDer;
    use tokio_rustls::rustls::pki_types::pem::PemObject;
    use tokio_rustls::rustls::{ClientConfig, ClientConnection, RootCertStore, StreamOwned, crypto::ring};
    use umbracast::Config;

    use super::super::super::{Door, Watched, start};
    use crate::clock::HostClock;

    fn file(name: &str) -> PathBuf {
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("testdata").join(name)
    }

    fn door(cert: &str, key: &str) -> Door {
        let door = Door::at(SocketAddr::from(([127, 0, 0, 1], 0)));
        Door { tls: Some((file(cert), file(key))), ..door }
    }

    fn watched() -> Watched {
        let site = Config::default().site;
        Watched::new(site, Arc::default(), HostClock::start(), "a test")
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

#[cfg(not(feature = "tls"))]
mod without {
    use super::super::*;

    #[test]
    fn without_the_feature_it_says_which_one() {
        let message = Tls::open(Path::new("a.pem"), Path::new("b.pem")).err().unwrap().to_string();
        assert!(message.contains("--features tls"), "{message}");
    }
}
