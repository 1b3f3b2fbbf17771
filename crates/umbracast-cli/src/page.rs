//! The page of `live` and `view`, if the build has it.

use std::sync::Arc;

use umbracast::{Error, Site};
use umbracast_live::run::Counters;
use umbracast_live::{HostClock, Published};

use crate::args::PageArgs;

/// What gives frames to the page; to nobody where there is none.
#[derive(Default)]
pub struct Page {
    #[cfg(feature = "serve")]
    server: Option<umbracast_live::serve::Server>,
}

impl Page {
    /// Begins to serve, unless asked not to.
    ///
    /// # Errors
    /// An address that is taken, or that needs a token; a host that is no name.
    #[cfg(feature = "serve")]
    pub fn open(
        args: &PageArgs,
        site: &Site,
        counters: &Arc<Counters>,
        clock: HostClock,
        title: &str,
    ) -> Result<Self, Error> {
        if args.no_serve {
            return Ok(Self::default());
        }
        let watched = umbracast_live::serve::Watched {
            site: site.clone(),
            counters: counters.clone(),
            clock,
            title: title.to_owned(),
        };
        let token = std::env::var("UMBRACAST_TOKEN").ok().filter(|token| !token.is_empty());
        let tls = args.tls_cert.clone().zip(args.tls_key.clone());
        let scheme = if tls.is_some() { "https" } else { "http" };
        let door = umbracast_live::serve::Door { address: args.serve, hosts: args.hosts.clone(), token, tls };
        let server = umbracast_live::serve::start(door, watched)?;
        crate::say::line(format_args!("page: {scheme}://{}/", server.address()));
        Ok(Self { server: Some(server) })
    }

    /// Says that there is none.
    ///
    /// # Errors
    /// None.
    #[cfg(not(feature = "serve"))]
    pub fn open(
        args: &PageArgs,
        _site: &Site,
        _counters: &Arc<Counters>,
        _clock: HostClock,
        _title: &str,
    ) -> Result<Self, Error> {
        if !args.no_serve {
            crate::say::note("no page: this program was built without the feature `serve`");
        }
        Ok(Self::default())
    }

    /// For the thread that makes frames.
    pub fn listener(&self) -> umbracast_live::run::Listener {
        #[cfg(feature = "serve")]
        if let Some(server) = &self.server {
            let publisher = server.publisher();
            return Box::new(move |published: &Arc<Published>| publisher.publish(published));
        }
        Box::new(|_: &Arc<Published>| {})
    }

    /// Shows another site from now on.
    #[cfg_attr(not(feature = "serve"), expect(unused_variables, reason = "nobody looks"))]
    pub fn take_over(&self, site: &Site) {
        #[cfg(feature = "serve")]
        if let Some(server) = &self.server {
            server.take_over(site);
        }
    }

    /// Closes it.
    pub fn close(self) {
        #[cfg(feature = "serve")]
        if let Some(server) = self.server {
            server.stop();
        }
    }
}
