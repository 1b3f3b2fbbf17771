//! What access points heard, on its way from whoever tells it to the pipeline.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use umbracast::radio::Report;
use umbracast_io::reports::Came;

/// Reports that wait for a frame at most. What comes beyond is lost, and counted.
const WAITING: usize = 1 << 17;

/// Takes reports from any thread, and waits for nobody.
pub type Ear = Arc<dyn Fn(&[Came]) + Send + Sync>;

/// Takes a list of objects of another perception, as `umbracast_io::objects` reads them: its source's name, and the bytes. Waits for
/// nobody.
pub type Objects = Box<dyn Fn(&str, &[u8]) + Send + Sync>;

/// Reports that wait for the next frame. Whoever hears pushes from any thread and waits for nobody.
#[derive(Debug, Default)]
pub struct Inbox {
    waiting: Mutex<Vec<Came>>,
    taken: AtomicU64,
    lost: AtomicU64,
}

impl Inbox {
    /// For the next frame.
    pub fn push(&self, reports: &[Came]) {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        let room = WAITING.saturating_sub(waiting.len()).min(reports.len());
        waiting.extend_from_slice(&reports[..room]);
        self.taken.fetch_add(room as u64, Ordering::Relaxed);
        self.lost.fetch_add((reports.len() - room) as u64, Ordering::Relaxed);
    }

    /// What waits for a frame that closed at `closed_ns`, time of the host. Where nobody said when a report was heard, it was heard
    /// as long before the frame's end as it came before the frame closed.
    pub fn take(&self, frame_ns: i64, closed_ns: i64) -> Vec<Report> {
        let waiting = std::mem::take(&mut *self.waiting.lock().unwrap_or_else(PoisonError::into_inner));
        let of_hall = |Came { report, is_timed }: Came| match is_timed {
            true => report,
            false => Report {
                time_ns: frame_ns.saturating_add(report.time_ns.saturating_sub(closed_ns)),
                ..report
            },
        };
        waiting.into_iter().map(of_hall).collect()
    }

    /// How many reports came and were taken since the start.
    pub fn taken(&self) -> u64 {
        self.taken.load(Ordering::Relaxed)
    }

    /// Counts what came and could not be understood.
    pub fn refuse(&self) {
        self.lost.fetch_add(1, Ordering::Relaxed);
    }

    /// How many came while too many waited, or were no reports.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn came(time_ns: i64, is_timed: bool) -> Came {
        Came {
            report: Report { time_ns, access_point: 0, device: 1, power_dbm: -60.0, serves: false },
            is_timed,
        }
    }

    #[test]
    fn what_waits_is_bounded_and_what_is_lost_is_counted() {
        let (heard, reports) = (Inbox::default(), vec![came(0, true); WAITING - 1]);
        heard.push(&reports);
        heard.push(&reports[..3]);
        assert_eq!((heard.taken(), heard.lost(), heard.take(0, 0).len()), (WAITING as u64, 2, WAITING));
        assert!(heard.take(0, 0).is_empty());
    }

    /// Reports without a time had the host's, which is another hour than that of sensors with clocks of their own.
    #[test]
    fn a_report_without_a_time_is_put_into_the_time_of_the_sensors() {
        let heard = Inbox::default();
        heard.push(&[came(5_000_030, false), came(70, true)]);
        let times: Vec<i64> = heard.take(100, 5_000_040).iter().map(|report| report.time_ns).collect();
        assert_eq!(times, [90, 70]);
    }
}
