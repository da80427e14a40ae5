//! What was measured and commanded since the last stretch was handed on.

use std::collections::VecDeque;

use bicycle::{Decision, DriveRow, Odometry};
use navigator::Jump;
use terrain::{GridMap, SurfaceCell};

use bus::message::drive_row;

/// Length of a stretch [s]: short enough for the ground behind the vehicle to be on the map still.
const STRETCH_S: f64 = 6.0;
/// Kept of a stretch as the beginning of the next one, where nothing is labelled [s].
const LEAD_S: f64 = 1.2;
/// Least time between two rows [ns].
const ROW_NS: u64 = 15_000_000;
/// Rows that are kept: without maps, the oldest are given up.
const ROWS_MAX: usize = 1024;
/// Commands that may still be younger than the newest odometry.
const COMMANDS_MAX: usize = 64;

/// A few seconds of a drive over ground that is known.
#[derive(Clone, Debug)]
pub struct Stretch {
    /// Odometry and command of every row, in time order; the time is that since the process began [s].
    pub rows: Vec<DriveRow>,
    /// The ground as it is known at the end.
    pub surface: GridMap<SurfaceCell>,
    /// All jumps of the localisation before it together.
    pub shift: Jump,
}

/// Collects rows; bounded, whatever comes in.
#[derive(Debug, Default)]
pub struct Notebook {
    rows: VecDeque<(u64, DriveRow)>,
    commands: VecDeque<(u64, [f64; 2])>,
    began_ns: Option<u64>,
}

impl Notebook {
    /// Notes what the vehicle is told from now on. While it holds or stops, a speed of zero is asked of it.
    pub fn note_command(&mut self, at_ns: u64, decision: &Decision) {
        let steering_rad = self.commands.back().map_or(0.0, |(_, [_, steering_rad])| *steering_rad);
        let command = match decision {
            Decision::Drive(command) => [command.speed_mps, command.steering_rad].map(f64::from),
            Decision::Hold(_) | Decision::Stop(_) => [0.0, steering_rad],
        };
        if self.commands.len() == COMMANDS_MAX {
            self.commands.pop_front();
        }
        self.commands.push_back((at_ns, command));
    }

    /// Notes how the vehicle moves. Odometry that is not finite, older than the last or from before any command says
    /// nothing.
    pub fn note_odometry(&mut self, odometry: &Odometry) {
        let at_ns = odometry.valid_at_ns;
        let is_due = self.rows.back().is_none_or(|(last_ns, _)| at_ns >= last_ns.saturating_add(ROW_NS));
        while self.commands.get(1).is_some_and(|(next_ns, _)| *next_ns <= at_ns) {
            self.commands.pop_front();
        }
        let Some((_, command)) = self.commands.front().filter(|(since_ns, _)| *since_ns <= at_ns) else {
            return;
        };
        if !is_due || !odometry.is_finite() {
            return;
        }
        let began_ns = *self.began_ns.get_or_insert(at_ns);
        let row = drive_row(at_ns.saturating_sub(began_ns) as f64 * 1e-9, odometry, *command);
        if self.rows.len() == ROWS_MAX {
            self.rows.pop_front();
        }
        self.rows.push_back((at_ns, row));
    }

    /// The localisation jumped: what was noted lies elsewhere on the map now, and is given up.
    pub fn break_off(&mut self) {
        self.rows.clear();
    }

    /// Rows that are kept.
    pub fn n_rows(&self) -> usize {
        self.rows.len()
    }

    /// Whether enough has been noted for a stretch.
    pub fn is_full(&self) -> bool {
        let times_s = self.rows.front().zip(self.rows.back());
        times_s.is_some_and(|((_, first), (_, last))| last.time_s - first.time_s >= STRETCH_S)
    }

    /// Hands on what was noted, with the ground below it.
    pub fn take(&mut self, surface: GridMap<SurfaceCell>, shift: Jump) -> Stretch {
        let rows: Vec<DriveRow> = self.rows.iter().map(|(_, row)| *row).collect();
        let lead_s = rows.last().map_or(0.0, |last| last.time_s - LEAD_S);
        self.rows.retain(|(_, row)| row.time_s >= lead_s);
        Stretch { rows, surface, shift }
    }
}

#[cfg(test)]
mod tests {
    use bicycle::{Column, Command, StopReason};
    use terrain::GridGeometry;

    use super::*;

    fn odometry(at_ns: u64) -> Odometry {
        Odometry {
            valid_at_ns: at_ns,
            position_m: [1.0; 3],
            attitude_rad: [0.0; 3],
            velocity_mps: [0.5, 0.0],
            yaw_rate_radps: 0.0,
            wheel_speed_mps: 0.5,
            steering_rad: 0.0,
        }
    }

    fn surface() -> GridMap<SurfaceCell> {
        let geometry = GridGeometry { resolution_m: 0.5, origin: [0, 0], n_rows: 2, n_cols: 2 };
        GridMap::filled(geometry, SurfaceCell::UNKNOWN)
    }

    #[test]
    fn rows_hold_the_command_of_their_time() {
        let mut notebook = Notebook::default();
        notebook.note_odometry(&odometry(5_000_000));
        assert_eq!(notebook.n_rows(), 0, "nothing was commanded yet");
        let drive = |speed_mps| Decision::Drive(Command { speed_mps, steering_rad: 0.1 });
        notebook.note_command(10_000_000, &drive(1.0));
        notebook.note_command(100_000_000, &drive(2.0));
        notebook.note_command(200_000_000, &Decision::Stop(StopReason::StaleScan));
        for at_ms in [20, 90, 110, 210] {
            notebook.note_odometry(&odometry(at_ms * 1_000_000));
        }
        let rows = notebook.take(surface(), Jump::NONE).rows;
        let speeds: Vec<f64> = rows.iter().map(|row| row.value(Column::CmdSpeed)).collect();
        assert_eq!(speeds, [1.0, 1.0, 2.0, 0.0]);
        assert!((rows[3].value(Column::CmdSteer) - 0.1).abs() < 1e-6, "the wheels stay as they are");
        assert!((rows[3].time_s - 0.19).abs() < 1e-12);
    }

    #[test]
    fn stretches_follow_one_another_and_nothing_grows() {
        let mut notebook = Notebook::default();
        notebook.note_command(0, &Decision::Stop(StopReason::StaleScan));
        let at = |k: u64| odometry(k * 20_000_000);
        (0..300).for_each(|k| notebook.note_odometry(&at(k)));
        assert!(!notebook.is_full());
        (300..=301).for_each(|k| notebook.note_odometry(&at(k)));
        assert!(notebook.is_full());
        assert_eq!(notebook.take(surface(), Jump::NONE).rows.len(), 302);
        assert!((60..=62).contains(&notebook.n_rows()), "{}", notebook.n_rows());
        // Without maps, with a flood, or with garbage.
        (302..9000).for_each(|k| notebook.note_odometry(&at(k)));
        (0..9000).for_each(|k| notebook.note_odometry(&odometry(9000 * 20_000_000 + k)));
        let broken = Odometry { yaw_rate_radps: f64::NAN, ..odometry(u64::MAX) };
        notebook.note_odometry(&broken);
        assert_eq!(notebook.n_rows(), ROWS_MAX);
        notebook.break_off();
        assert!(notebook.n_rows() == 0 && !notebook.is_full());
    }
}
