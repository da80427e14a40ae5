//! `surefoot bench gap`.

use bench::gap_closed_loop::{Gap, Ground, VEHICLES};
use clap::Args;

use super::values;

/// Which drives to do.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct BenchGapArguments {
    /// Vehicle around which the machine that drives is drawn
    #[arg(long, value_name = "VEHICLE", value_parser = vehicle, default_value = "pietra_full_size")]
    pub vehicle: &'static str,

    /// Where to drive, separated by commas
    #[arg(long, value_name = "GROUND,..", value_delimiter = ',', value_parser = ground,
          default_value = "course,rocks")]
    pub grounds: Vec<Ground>,

    /// What the plant does and its simulator does not, separated by commas
    #[arg(long, value_name = "GAP,..", value_delimiter = ',', value_parser = gap,
          default_value = "none,steer_delay,steer_lag,understeer,speed_lag,friction,slope_gravity")]
    pub gaps: Vec<Gap>,

    /// Drive with the seeds 1 to N, at most 1000; each has recorded drives and a diagnosis of its own
    #[arg(long, value_name = "N", value_parser = values::seed_count, default_value = "10",
          allow_hyphen_values = true)]
    pub seeds: u64,

    /// How maps and controller compute.
    #[command(flatten)]
    pub kernels: super::KernelArguments,

    /// Where the results go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

fn vehicle(word: &str) -> Result<&'static str, String> {
    let known = VEHICLES.into_iter().find(|vehicle| *vehicle == word);
    known.ok_or_else(|| format!("expected one of {}, found {word:?}", VEHICLES.join(", ")))
}

fn ground(word: &str) -> Result<Ground, String> {
    let known = Ground::ALL.into_iter().find(|ground| ground.name() == word);
    known.ok_or_else(|| format!("expected course or rocks, found {word:?}"))
}

fn gap(word: &str) -> Result<Gap, String> {
    let known = Gap::ALL.into_iter().find(|gap| gap.name() == word);
    known.ok_or_else(|| format!("expected one of {}, found {word:?}", Gap::ALL.map(Gap::name).join(", ")))
}

pub(super) const LONG_ABOUT: &str = "\
Shows what a diagnosis is worth to the controller. A plant departs from its simulator by its own parts: a waiting or \
slow servo, a yielding front axle, a slow motor, hard tyres, a load that pulls downhill. Its recorded drives are \
diagnosed, and it is driven with the kinematic bicycle, with the model calibrated on the simulator, with that model \
repaired by the diagnosis, and with the true effect: along a slalom at speed, and through the rock field of `surefoot \
drive`, three times as fast as there. The exit code is 0 once all drives are done, however they ended.";

const AFTER_HELP: &str = "\
Writes gap_closed_loop.png, and gap_closed_loop.json with
  calibrated  effects of the model that the simulator's drives calibrate
  diagnoses   of each gap and seed: verdict, what was found, the controller's model, the truth
  rows        of each ground, gap and belief: n, n_goal, wilson; time_s, across_rms_m, across_max_m, speed_rms_mps,
              plan_rms_m as value, low, high (95 %, bootstrap over the seeds); less_nominal: the same less the nominal
              model's, seed by seed
  drives      each drive

Example, about half an hour:
  surefoot bench gap
Example, half a minute:
  surefoot bench gap --vehicle sedan --grounds course --gaps none,steer_lag --seeds 2";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_files_and_others_are_refused() {
        for known in Gap::ALL {
            assert_eq!(gap(known.name()), Ok(known));
        }
        assert_eq!(ground("rocks"), Ok(Ground::Rocks));
        assert!(gap("lag").unwrap_err().contains("expected one of none, steer_delay"));
        assert_eq!(vehicle("sedan"), Ok("sedan"));
        assert!(
            vehicle("rc_car").unwrap_err().contains("expected one of pietra_full_size, sedan, buggy_fifth")
        );
        assert!(ground("moon").unwrap_err().contains("expected course or rocks"));
    }
}
