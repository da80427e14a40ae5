//! Whether this machine can run the processes in time.

use std::path::Path;

use bicycle::lanes::{Instructions, Isa};
use bus::channel::free_shared_memory_bytes;
use bus::clock::{self, SECOND_NS};
use bus::status::Role;

use super::{Finding, Verdict, median};
use crate::realtime;

/// Shared memory that a run with one reader more takes [MB].
const SHARED_MEMORY_MB: f64 = 256.0;
/// Room on the disk below which recordings soon end [GB].
const DISK_GB: f64 = 2.0;
/// Naps that are taken, and how long each is [ns].
const N_NAPS: usize = 200;
const NAP_NS: u64 = SECOND_NS / 500;
/// How late a process may wake at the most: a tenth of a control cycle, and one of them [s].
const FINE_LATENESS_S: f64 = 0.01;
const BEARABLE_LATENESS_S: f64 = 0.1;
/// By how much the time of day may leave the monotonic clock in a second: what keeps a clock right slews it by at most
/// 500 parts in a million [-].
const SLEW_PER_S: f64 = 5e-4;
/// What two looks at both clocks one after the other may differ by [s].
const LOOK_S: f64 = 1e-3;

/// What this machine has and allows; recordings would go to this folder.
pub fn machine(recordings: &Path) -> Vec<Finding> {
    let mut findings = vec![processor()];
    findings.extend(rights());
    findings.extend([punctuality(), shared_memory(), disk(recordings)]);
    findings
}

fn processor() -> Finding {
    let n_cores = std::thread::available_parallelism().map_or(1, usize::from);
    let isa = Instructions::widest().isa();
    let found = format!("{n_cores} cores, {isa:?}");
    match (n_cores, isa) {
        (1, _) => {
            let found = format!("{found}; control has no core of its own, and waits for the maps");
            Finding::new("processor", Verdict::Doubtful, found)
        }
        (_, Isa::Portable) => {
            let found = format!("{found}; without AVX2 or NEON a cycle takes several times as long");
            Finding::new("processor", Verdict::Doubtful, found)
        }
        _ => Finding::new("processor", Verdict::Fine, found),
    }
}

/// What `--realtime` would be granted. In a thread that ends with the question.
fn rights() -> Vec<Finding> {
    let asked = std::thread::spawn(|| realtime::granted(Role::Control)).join();
    let whats = ["own core", "priority", "locked memory"];
    let granted =
        asked.unwrap_or_else(|_| std::array::from_fn(|_| Err("the question itself failed".to_owned())));
    let finding = |(what, granted)| match granted {
        Ok(found) => Finding::new(what, Verdict::Fine, found),
        Err(found) => Finding::new(what, Verdict::Doubtful, format!("{found}; --realtime goes without it")),
    };
    whats.into_iter().zip(granted).map(finding).collect()
}

fn punctuality() -> Finding {
    let nap = |_| {
        let deadline_ns = clock::now_ns() + NAP_NS;
        clock::age_s(clock::sleep_until(deadline_ns), deadline_ns)
    };
    let late_s: Vec<f64> = (0..N_NAPS).map(nap).collect();
    let most_s = late_s.iter().copied().fold(0.0, f64::max);
    let found = format!(
        "wakes {:.2} ms late at the median of {N_NAPS} and {:.1} ms at the most",
        1e3 * median(late_s).unwrap_or(0.0),
        1e3 * most_s
    );
    let cause = "the machine is busy, saves power, or shares its processor with others";
    match most_s {
        late_s if late_s <= FINE_LATENESS_S => Finding::new("punctuality", Verdict::Fine, found),
        late_s if late_s <= BEARABLE_LATENESS_S => {
            Finding::new("punctuality", Verdict::Doubtful, format!("{found}; {cause}"))
        }
        _ => Finding::new("punctuality", Verdict::Wrong, format!("{found}; {cause}")),
    }
}

fn shared_memory() -> Finding {
    let what = "shared memory";
    let Some(free_bytes) = free_shared_memory_bytes() else {
        return Finding::new(what, Verdict::Unknown, "the system does not say how much is free".to_owned());
    };
    let found = format!("{:.0} MB free", 1e-6 * free_bytes);
    if 1e-6 * free_bytes < SHARED_MEMORY_MB {
        let found =
            format!("{found}; a run takes up to {SHARED_MEMORY_MB} MB, in a container --shm-size 256m");
        return Finding::new(what, Verdict::Wrong, found);
    }
    Finding::new(what, Verdict::Fine, found)
}

fn disk(recordings: &Path) -> Finding {
    let what = "disk";
    let place = recordings.display();
    let free_gb = match rustix::fs::statvfs(recordings) {
        Ok(space) => 1e-9 * space.f_bavail as f64 * space.f_frsize as f64,
        Err(error) => return Finding::new(what, Verdict::Wrong, format!("{place}: {error}")),
    };
    let found = format!("{free_gb:.1} GB free in {place}");
    if free_gb < DISK_GB {
        return Finding::new(what, Verdict::Doubtful, format!("{found}; recordings end when it is full"));
    }
    Finding::new(what, Verdict::Fine, found)
}

/// Whether the time of day was set meanwhile: decisions do not go by it, recordings and other machines do.
pub(super) fn time_of_day(monotonic_s: f64, utc_s: f64) -> Finding {
    let apart_s = (utc_s - monotonic_s).abs();
    let found = format!("{:.1} ms from the monotonic clock in {monotonic_s:.1} s", 1e3 * apart_s);
    if apart_s > LOOK_S + SLEW_PER_S * monotonic_s {
        let found = format!("{found}; it was set: stamps by it jump, and a robot whose stamps are UTC stops");
        return Finding::new("time of day", Verdict::Doubtful, found);
    }
    Finding::new("time of day", Verdict::Fine, found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_of_day_may_drift_but_not_jump() {
        assert_eq!(time_of_day(5.0, 5.002).verdict, Verdict::Fine);
        assert_eq!(time_of_day(5.0, 5.1).verdict, Verdict::Doubtful);
        // Set back, it has not passed at all.
        assert_eq!(time_of_day(5.0, 0.0).verdict, Verdict::Doubtful);
    }

    #[test]
    fn everything_of_the_machine_is_told_once() {
        let findings = machine(Path::new("/"));
        let whats: Vec<&str> = findings.iter().map(|finding| finding.what.as_str()).collect();
        let expected =
            ["processor", "own core", "priority", "locked memory", "punctuality", "shared memory", "disk"];
        assert_eq!(whats, expected);
        let nowhere = disk(Path::new("/no/such/folder"));
        assert_eq!(nowhere.verdict, Verdict::Wrong);
        assert!(nowhere.found.contains("/no/such/folder: No such file"), "{nowhere:?}");
    }
}
