//! Recordings, captures and clouds as frames, one after the other.

use std::path::PathBuf;
use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread;

use pyo3::prelude::*;
use umbracast::{Error, Health};
use umbracast_io::input::{self, Given, Input, Inputs};

use crate::frame::Frame;
use crate::site::Site;
use crate::told::{refused, warn, wrong};

/// Frames read ahead of who asks for them.
const AHEAD: usize = 4;

/// One scene's input: an MCAP recording, captures, or clouds. To iterate over it reads it from the start.
#[pyclass(frozen, module = "umbracast")]
pub struct Recording {
    input: Input,
    empty: Option<Input>,
    site: Site,
}

/// Opens the input of one scene: an MCAP recording, a capture of all sensors or one for each (pcap), or a folder or list of clouds
/// (PCD). A recording brings its site with it; captures and clouds need one.
#[pyfunction]
#[pyo3(signature = (path, site=None))]
pub fn read(path: &Bound<PyAny>, site: Option<&Bound<PyAny>>) -> PyResult<Recording> {
    let paths: Vec<PathBuf> = match path.extract::<PathBuf>() {
        Ok(path) => vec![path],
        Err(_) => path.extract()?,
    };
    if let Some(path) = paths.iter().find(|path| !path.exists()) {
        return Err(refused(Error::new("no such file or folder").within(path.display())));
    }
    let given = Given::of(&paths).map_err(refused)?;
    let site = match site {
        Some(site) => Site::given(Some(site))?,
        None => match given.site().map_err(refused)? {
            Some(site) => Site::recorded(site),
            None => Site::given(None)?,
        },
    };
    let Inputs { scenes: mut inputs, empty } = given.of_site(site.site(), &[]).map_err(refused)?;
    match (inputs.pop(), inputs.len()) {
        (Some(input), 0) => Ok(Recording { input, empty, site }),
        (None, _) => Err(wrong("expected a recording, found no file")),
        (Some(_), more) => {
            Err(wrong(format!("expected one scene, found {}: {} and others", more + 1, inputs[0])))
        }
    }
}

impl Recording {
    /// Gives every frame to `take`; what was lost at the end of a damaged file.
    pub fn each(
        &self,
        health: &mut Health,
        mut take: impl FnMut(&umbracast::Frame),
    ) -> Result<Option<String>, Error> {
        self.input.frames(self.site.site(), health, |frame| {
            take(frame);
            Ok(())
        })
    }

    /// The site.
    pub fn hall(&self) -> &Site {
        &self.site
    }

    /// The frames without people that lie beside the recording, and what was lost of them.
    pub fn empty_beside(&self) -> Result<(Vec<umbracast::Frame>, Option<String>), Error> {
        let Some(empty) = &self.empty else { return Ok((Vec::new(), None)) };
        let site = self.site.site();
        let all: Vec<usize> = (0..site.sensors.len()).collect();
        empty.empty_frames(site, &all, &mut Health::default())
    }
}

#[pymethods]
impl Recording {
    fn __iter__(&self) -> Frames {
        let (send, come) = sync_channel(AHEAD);
        let (input, site) = (self.input.clone(), self.site.site().clone());
        // It ends with the file, or when nobody takes its frames any more.
        thread::spawn(move || {
            let mut health = Health::default();
            let lost = input.frames(&site, &mut health, |frame| {
                let sent = send.send(Read::Frame(Arc::new(frame.clone())));
                sent.map_err(|_| Error::new("nobody takes the frames"))
            });
            let _ = send.send(Read::End(lost.map(|lost| (health, lost))));
        });
        Frames { come: Mutex::new(Some(come)), told: self.input.to_string() }
    }

    /// The hall that it was recorded in.
    #[getter]
    fn site(&self) -> Site {
        self.site.clone()
    }

    /// The scene's number in the file's name, `scene-0003.mcap`; 0 in others.
    #[getter]
    fn scene(&self) -> u32 {
        input::scene_number(&self.input).unwrap_or(0)
    }

    /// The frames of the hall without people, of `empty.mcap` beside the recording; an empty list where there is none.
    #[getter]
    fn empty(&self, py: Python) -> PyResult<Vec<Frame>> {
        let (frames, lost) = py.detach(|| self.empty_beside()).map_err(refused)?;
        lost.map_or(Ok(()), |lost| warn(py, &format!("data was lost: {lost}")))?;
        Ok(frames.into_iter().map(|frame| Frame(Arc::new(frame))).collect())
    }

    fn __repr__(&self) -> String {
        format!("Recording {} in {:?}", self.input, self.site.site().name)
    }
}

/// What the reading thread sends.
enum Read {
    Frame(Arc<umbracast::Frame>),
    End(Result<(Health, Option<String>), Error>),
}

/// The frames of a recording, read a few ahead by a thread of its own. What was skipped or lost is warned of at the end.
#[pyclass(frozen, module = "umbracast")]
pub struct Frames {
    come: Mutex<Option<Receiver<Read>>>,
    told: String,
}

#[pymethods]
impl Frames {
    fn __iter__(this: PyRef<Self>) -> PyRef<Self> {
        this
    }

    fn __next__(&self, py: Python) -> PyResult<Option<Frame>> {
        let next = py.detach(|| {
            let mut come = self.come.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
            let next = come.as_ref().map(Receiver::recv);
            if !matches!(next, Some(Ok(Read::Frame(_)))) {
                *come = None;
            }
            next
        });
        match next {
            None => Ok(None),
            Some(Ok(Read::Frame(frame))) => Ok(Some(Frame(frame))),
            Some(Ok(Read::End(Ok((health, lost))))) => {
                self.warn_of(py, &health, lost)?;
                Ok(None)
            }
            Some(Ok(Read::End(Err(error)))) => Err(refused(error)),
            Some(Err(_)) => Err(wrong(format!("{}: expected frames, found that reading stopped", self.told))),
        }
    }
}

impl Frames {
    fn warn_of(&self, py: Python, health: &Health, lost: Option<String>) -> PyResult<()> {
        if let Some(lost) = lost {
            return warn(py, &format!("data was lost: {lost}"));
        }
        // Points outside the range that the site gives its sensor are the site's choice.
        let skipped = Health { points_invalid: 0, ..*health };
        match skipped.is_clean() {
            true => Ok(()),
            false => warn(py, &format!("{}: data was skipped: {}", self.told, serde_json::json!(skipped))),
        }
    }
}
