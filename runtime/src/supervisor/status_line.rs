//! How one process is doing, in a line.

use bus::message::StatusRecord;
use bus::status::Role;

/// How one process is doing.
#[derive(Clone, Copy, Debug)]
pub struct StatusLine {
    /// Its role.
    pub role: Role,
    /// Its process, while it runs.
    pub process: Option<u32>,
    /// How often it had to be restarted.
    pub n_restarts: usize,
    /// Age of its last status [s], and that.
    pub status: Option<(f64, StatusRecord)>,
}

impl std::fmt::Display for StatusLine {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let inputs: &[&str] = match self.role {
            Role::Plant => &["command"],
            Role::Mapping => &["odometry", "scan"],
            Role::Learning => &["surface"],
            Role::Control => &["odometry", "learned map", "physics map", "mission"],
            Role::Recorder => &[],
            Role::Mission => &["odometry"],
            Role::Ros => &["command", "odometry", "scan"],
        };
        write!(formatter, "{:9}", self.role.name())?;
        let Some((age_s, status)) = self.status.filter(|_| self.process.is_some()) else {
            return write!(formatter, " not heard of yet, restarts {}", self.n_restarts);
        };
        if age_s > 2.0 {
            return write!(formatter, " silent for {age_s:.1} s, restarts {}", self.n_restarts);
        }
        let [median_ms, largest_ms] = status.lateness_s.map(|lateness_s| 1e3 * lateness_s);
        write!(formatter, " {:5.1} Hz  late {median_ms:.1}, {largest_ms:.1} ms", status.rate_hz)?;
        for (name, age_s) in inputs.iter().zip(status.age_s).filter(|(_, age_s)| *age_s >= 0.0) {
            write!(formatter, "  {name} {:.0} ms", 1e3 * age_s)?;
        }
        write!(
            formatter,
            "  missed {}  lost {}  refused {}  failed {}  restarts {}",
            status.n_missed, status.n_lost, status.n_refused, status.n_failed, self.n_restarts
        )?;
        match self.role {
            Role::Control => write!(formatter, "  futures {:.0}", status.figure),
            Role::Recorder if status.figure < 0.0 => write!(formatter, "  no recording"),
            Role::Recorder => write!(formatter, "  {:.1} MB", 1e-6 * status.figure),
            _ => Ok(()),
        }
    }
}
