//! What a process takes of the machine, as the system keeps account of it.

use serde::Serialize;

use bus::clock;

/// Ticks of a second in /proc, on every architecture that Linux has today.
const TICKS_HZ: f64 = 100.0;

/// Processor time and memory of a process over its lives.
#[derive(Clone, Copy, Debug, Default)]
pub struct Usage {
    last: Option<(u32, u64, f64)>,
    processor_s: f64,
    watched_s: f64,
    resident_max_mb: f64,
}

/// What a process took.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProcessUsage {
    /// Its role.
    pub role: &'static str,
    /// Processor time per time; 1 is a whole core.
    pub processor_share: f64,
    /// Most memory of its own and shared that it held at once [MB].
    pub resident_max_mb: f64,
    /// How often it had to be restarted.
    pub n_restarts: usize,
}

impl Usage {
    /// Looks at a process. Between two looks at the same one it took what is the difference.
    pub fn look(&mut self, process: u32, now_ns: u64) {
        let Some((processor_s, resident_mb)) = read(process) else { return };
        if let Some((_, then_ns, before_s)) = self.last.filter(|(last, _, _)| *last == process) {
            self.processor_s += processor_s - before_s;
            self.watched_s += clock::age_s(now_ns, then_ns);
        }
        self.last = Some((process, now_ns, processor_s));
        self.resident_max_mb = self.resident_max_mb.max(resident_mb);
    }

    /// What was seen.
    pub fn report(&self, role: &'static str, n_restarts: usize) -> ProcessUsage {
        let processor_share = if self.watched_s > 0.0 { self.processor_s / self.watched_s } else { 0.0 };
        ProcessUsage { role, processor_share, resident_max_mb: self.resident_max_mb, n_restarts }
    }
}

impl std::fmt::Display for ProcessUsage {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { role, processor_share, resident_max_mb, n_restarts } = self;
        write!(formatter, "{role:9} {:5.1} % of a core, {resident_max_mb:.0} MB", 100.0 * processor_share)?;
        if *n_restarts > 0 {
            write!(formatter, ", {n_restarts} restarts")?;
        }
        Ok(())
    }
}

/// Processor time [s] and resident memory [MB]; `None` for a process that is gone.
fn read(process: u32) -> Option<(f64, f64)> {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    Some((processor_s(&stat)?, resident_mb(&status)?))
}

/// User and system time, fields 14 and 15; the name in field 2 may hold anything, brackets too.
fn processor_s(stat: &str) -> Option<f64> {
    let (_, fields) = stat.rsplit_once(')')?;
    let mut times = fields.split_whitespace().skip(11).map(str::parse::<u64>);
    let (user, system) = (times.next()?.ok()?, times.next()?.ok()?);
    Some((user + system) as f64 / TICKS_HZ)
}

fn resident_mb(status: &str) -> Option<f64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kilobytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024e-6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_system_is_read_as_it_writes() {
        let stat = "71 (a) b) (c) R 1 2 3 4 5 6 7 8 9 10 250 50 0 0 20 0 1 0";
        assert_eq!(processor_s(stat), Some(3.0));
        assert_eq!(processor_s("71 (a) R 1"), None);
        assert_eq!(resident_mb("VmPeak:\t 9 kB\nVmRSS:\t    2000 kB\n"), Some(2.048));
        assert_eq!(resident_mb("VmPeak:\t 9 kB\n"), None);
    }

    #[test]
    fn a_process_that_works_takes_time_and_one_that_is_gone_takes_none() {
        let mut usage = Usage::default();
        let began_ns = clock::now_ns();
        usage.look(std::process::id(), began_ns);
        let mut n: u64 = 1;
        while clock::now_ns() - began_ns < 100_000_000 {
            n = std::hint::black_box(n.wrapping_mul(3));
        }
        usage.look(std::process::id(), clock::now_ns());
        let seen = usage.report("control", 2);
        assert!(seen.processor_share > 0.0 && seen.resident_max_mb > 1.0, "{seen:?}");
        usage.look(u32::MAX, clock::now_ns());
        assert_eq!(usage.report("control", 2), seen);
    }
}
