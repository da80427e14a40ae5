//! The process that is a node of ROS 2.

use std::sync::Arc;

use bus::ages::AgeLimits;
use bus::channel::{Bus, RunName};
use bus::message::MissionRecord;
use navigator::Route;
use ros::bridge::{self, BridgeError, BridgeSetup};
use ros::environment;
use ros::orders::Order;
use runtime::operator;
use tracing::warn;
use traversability::CvarLevel;

use super::{robot, roles};
use crate::UsageError;
use crate::arguments::UpArguments;
use crate::drive::scene::Machine;
use crate::interrupt;

/// A route is checked with any tolerance that would do: how near is near is left to the run.
const ANY_TOLERANCE_M: f64 = 1.0;

pub(super) fn run(arguments: &UpArguments, machine: &Machine, ages: AgeLimits) -> anyhow::Result<()> {
    let described = arguments.described.as_ref();
    let Some((robot, ros)) = described.and_then(|robot| Some((robot, robot.ros.as_ref()?))) else {
        return Err(
            UsageError("--role ros: expected --robot with a file that has a part [ros]".to_owned()).into()
        );
    };
    let variable = |name: &str| std::env::var(name).ok();
    let discovery = environment::discovery(variable, ros.domain_id).map_err(UsageError::from_input)?;
    let run = arguments.run.clone();
    let setup = BridgeSetup {
        ros,
        vehicle: &machine.vehicle,
        sensors: &robot.sensors,
        periods: robot::periods(arguments),
        ages,
        discovery,
        alpha: arguments.drive.alpha,
        method: machine.knowledge.method.name().to_owned(),
        director: Arc::new(move |order| direct(&run, order)),
    };
    let bus = roles::join(arguments)?;
    let bridged = bridge::run(&bus, setup, &interrupt::interrupted, &mut |line| {
        warn!("{line}");
    });
    match bridged {
        // A name or a label is no better the next time.
        Err(error @ (BridgeError::Labels(_) | BridgeError::Node(ros::NodeError::Name { .. }))) => {
            Err(UsageError::from_input(error).into())
        }
        bridged => Ok(bridged?),
    }
}

/// Says an order to the mission of the run.
fn direct(run: &RunName, order: &Order) -> Result<MissionRecord, String> {
    let order = navigators(order)?;
    let bus = Bus::visit(run).map_err(|error| error.to_string())?;
    operator::tell(&bus, &order).map_err(|error| error.to_string())
}

fn navigators(order: &Order) -> Result<navigator::Order, String> {
    let route = match order {
        Order::Pause => return Ok(navigator::Order::Pause),
        Order::Resume => return Ok(navigator::Order::Resume),
        Order::Cancel => return Ok(navigator::Order::Cancel),
        Order::EmergencyStop => return Ok(navigator::Order::EmergencyStop),
        Order::Reset => return Ok(navigator::Order::Reset),
        Order::Tolerate(alpha) => {
            let level = CvarLevel::new(*alpha).map_err(|error| error.to_string())?;
            return Ok(navigator::Order::Tolerate(level));
        }
        Order::Goals(goals_m) => Route::goals(goals_m.clone(), ANY_TOLERANCE_M),
        Order::Path { corners_m, speed_mps } => Route::path(corners_m.clone(), *speed_mps, ANY_TOLERANCE_M),
    };
    let route = route.map_err(|error| error.to_string())?;
    Ok(navigator::Order::Drive(route.without_tolerance()))
}
