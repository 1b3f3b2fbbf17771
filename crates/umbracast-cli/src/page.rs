//! The page of `live`, `view` and `plan`, if the build has it.

use std::sync::Arc;

use umbracast::{Error, Site};
use umbracast_live::heard::{Ear, Objects};
use umbracast_live::recording::Recording;
use umbracast_live::run::Counters;
use umbracast_live::whole::Whole;
use umbracast_live::{HostClock, Published};

use crate::args::PageArgs;

/// What the page is about.
#[cfg_attr(not(feature = "serve"), expect(dead_code, reason = "nobody looks"))]
pub struct Shown<'a> {
    /// Where everything stands.
    pub site: &'a Site,
    /// What is counted.
    pub counters: Arc<Counters>,
    /// The clock of the run.
    pub clock: HostClock,
    /// What it is called.
    pub title: String,
    /// Where whole frames are left while somebody looks at them.
    pub whole: Arc<Whole>,
    /// The frames of a recording, where one is looked at.
    pub recording: Option<Arc<Recording>>,
    /// Who takes what access points heard of devices, where somebody does.
    pub ear: Option<Ear>,
    /// Who takes lists of objects of another perception, by source.
    pub objects: Option<Objects>,
}

impl<'a> Shown<'a> {
    /// A hall that is watched as it is.
    pub fn live(site: &'a Site, counters: &Arc<Counters>, clock: HostClock, title: &str) -> Self {
        let (counters, title) = (counters.clone(), title.to_owned());
        Self {
            site,
            counters,
            clock,
            title,
            whole: Arc::default(),
            recording: None,
            ear: None,
            objects: None,
        }
    }
}

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
    pub fn open(args: &PageArgs, shown: Shown) -> Result<Self, Error> {
        if args.no_serve {
            return Ok(Self::default());
        }
        let mut watched =
            umbracast_live::serve::Watched::new(shown.site.clone(), shown.counters, shown.clock, shown.title);
        watched.whole = shown.whole;
        watched.recording = shown.recording;
        watched.ear = shown.ear;
        watched.objects = shown.objects;
        Self::serve(args, watched)
    }

    /// Serves the page of `plan`, with who answers it.
    ///
    /// # Errors
    /// As [`Page::open`].
    #[cfg(feature = "serve")]
    pub fn plan(
        args: &PageArgs,
        site: Site,
        title: &str,
        answers: impl Fn(&str, &[u8]) -> Result<String, Error> + Send + Sync + 'static,
    ) -> Result<Self, Error> {
        let clock = HostClock::start();
        let mut watched = umbracast_live::serve::Watched::new(site, Arc::default(), clock, title);
        watched.planner = Some(umbracast_live::serve::Planner::new(answers));
        Self::serve(args, watched)
    }

    #[cfg(feature = "serve")]
    fn serve(args: &PageArgs, watched: umbracast_live::serve::Watched) -> Result<Self, Error> {
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
    pub fn open(args: &PageArgs, _shown: Shown) -> Result<Self, Error> {
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
