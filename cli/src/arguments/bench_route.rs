//! `surefoot bench route`.

use clap::Args;

use super::values;

/// Which routes to plan and drive.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct BenchRouteArguments {
    /// The machine, a shipped name or a path
    #[arg(long, value_name = "NAME|FILE", default_value = "pietra_full_size")]
    pub vehicle: String,

    /// Starts and goals in each landscape
    #[arg(long, value_name = "N", value_parser = values::seed_count, default_value = "50",
          allow_hyphen_values = true)]
    pub tasks: u64,

    /// Of these, how many the controller (MPPI) drives, too, along our routes; 0 for none
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub mppi_tasks: u32,

    /// Drives that friction is found from for the turns and climbs
    #[arg(long, value_name = "N", default_value_t = 6)]
    pub grip_drives: u32,

    /// In place of all that, our routes beside those of a slow reference (table 7), on so many tasks in each landscape
    #[arg(long, value_name = "N", num_args = 0..=1, require_equals = true, default_missing_value = "10",
          value_parser = values::seed_count, conflicts_with_all = ["tasks", "mppi_tasks", "grip_drives"])]
    pub reference: Option<u64>,

    /// Of the landscapes and tasks; what is published comes from 1000, on which nothing was developed
    #[arg(long, value_name = "N", value_parser = values::seed, default_value = "1000",
          allow_hyphen_values = true)]
    pub seed: u64,

    /// How much of the machine to use; the numbers do not depend on it.
    #[command(flatten)]
    pub threads: super::ThreadArguments,

    /// Where the results go.
    #[command(flatten)]
    pub results: super::ResultArguments,
}

pub(super) const ABOUT: &str = "\
Plans routes with and without knowledge of friction and drives them on the plant: AnyNav's table 6.

A garden of 400 x 400 m and an island of 1,000 x 1,000 m have seven grounds, hills, trees and water. Every row plans on the same \
heights and obstacles with what it knows of friction; ours knows the published friction of each ground, from which the true one \
departs by up to a tenth and from place to place. A proportional-differential controller follows the planned line at the planned \
speeds, and on some tasks so does the controller that `surefoot drive` has.

  binary            the shortest way around obstacles and ice, at our planner's speeds
  URA*-like         by how likely a look from above calls ground drivable, heights unseen, at 6 m/s
  friction 0.2 ..   the same friction everywhere
  0.5 friction ..   every friction times a factor
  0.75 speed ..     our routes, every speed times a factor
  no steering cost  turns cost nothing in the search

Before that, turns of 20 m radius at shares of the speed that friction holds, and climbs, on level and sloping ground of each kind: \
on grounds as published, and on others whose friction a drive of two minutes showed (figure 12 and table 3).

With --reference, in place of the paper's human drivers (table 7), lines that are bent from several ways until nothing makes them \
faster, under the same limits: how much time our planner leaves, and how long either plans.";

const AFTER_HELP: &str = "\
A drive fails where there is no route, and where the vehicle rolls over, touches a tree, stands in water, does not move for 5 s, \
strays 15 m from the line or takes three times as long as planned and 30 s.

Writes route_table.png (bars), route_garden.png and route_island.png (the routes of a task), and route_table.json with
  rows         success, time, time over the expected, failures, by landscape and method
  comparisons  each row beside ours, task by task
  verdicts     the rules, which were fixed before the first drive
  drives       every drive
  grip         turns and climbs
With --reference, route_reference.json alone, with rows and pairs, and route_reference.png.

Examples:
  surefoot bench route
  surefoot bench route --tasks 5 --mppi-tasks 0 --seed 1
  surefoot bench route --reference";
