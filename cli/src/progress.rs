//! What a person at a terminal sees while a drive runs; silence for everyone else.

use std::io::IsTerminal;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// A bar that counts to `n` on standard error; draws nothing where that is not a terminal. `beside` is what stands
/// right of it, in the template's words of `indicatif`.
pub(crate) fn bar(n: u64, beside: &str) -> ProgressBar {
    let bar = if std::io::stderr().is_terminal() { ProgressBar::new(n) } else { ProgressBar::hidden() };
    // The templates are constants but for a word: were one wrong, the plain bar would do.
    if let Ok(style) = ProgressStyle::with_template(&format!("  {{bar:28.green/black.bright}} {beside}")) {
        bar.set_style(style.progress_chars("━╸━"));
    }
    bar
}

/// How far a drive has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveProgress {
    /// Straight line from the vehicle to the goal [m].
    pub distance_to_goal_m: f64,
    /// Time since the start, in the simulation [s].
    pub simulated_s: f64,
    /// Speed of the vehicle [m/s].
    pub speed_mps: f64,
    /// What the last control cycle took [ms].
    pub control_ms: f64,
}

/// Bar of one drive on standard error; draws nothing where that is not a terminal.
#[derive(Debug)]
pub struct ProgressLine {
    bar: ProgressBar,
    start_distance_m: f64,
}

impl ProgressLine {
    /// A bar that is full at the goal; `start_distance_m` from the goal it is empty.
    pub fn new(start_distance_m: f64) -> Self {
        let bar = bar(centimetres(start_distance_m), "{msg}");
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { bar, start_distance_m }
    }

    /// Shows the state after a cycle. Cheap: the terminal is redrawn at most a few times a second.
    pub fn update(&self, progress: &DriveProgress) {
        if self.bar.is_hidden() {
            return;
        }
        self.bar.set_position(centimetres(self.start_distance_m - progress.distance_to_goal_m));
        self.bar.set_message(message(progress));
    }

    /// Takes the bar away, so that the summary stands alone.
    pub fn finish(self) {
        self.bar.finish_and_clear();
    }
}

/// A bar counts whole numbers.
fn centimetres(distance_m: f64) -> u64 {
    (distance_m.max(0.0) * 100.0) as u64
}

fn message(progress: &DriveProgress) -> String {
    format!(
        "{:5.1} m to go   {:5.1} s   {:4.2} m/s   control {:5.2} ms",
        progress.distance_to_goal_m, progress.simulated_s, progress.speed_mps, progress.control_ms
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn message_says_all_four_numbers() {
        let progress =
            DriveProgress { distance_to_goal_m: 12.34, simulated_s: 8.0, speed_mps: 0.956, control_ms: 1.5 };
        assert_eq!(message(&progress), " 12.3 m to go     8.0 s   0.96 m/s   control  1.50 ms");
    }

    #[test]
    fn distance_beyond_the_start_leaves_the_bar_empty() {
        assert_eq!(centimetres(-3.0), 0);
        assert_eq!(centimetres(40.0), 4000);
    }
}
