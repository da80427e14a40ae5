//! Missions that end and missions that are lost: the vehicle stops, says why, and goes on with the next.

use std::collections::BTreeMap;

use bicycle::{Decision, HoldReason, StopReason};
use runtime::channel::{Bus, MISSION};
use runtime::status::Role;

use crate::driver::{Driver, Misbehaviour, MissionFate};
use crate::fixture::{Run, ages};
use crate::witness::Witness;

#[test]
fn a_mission_that_is_lost_or_over_stops_the_vehicle_until_there_is_one_again() {
    let mut run = Run::new();
    run.start_all(&[Role::Mapping, Role::Learning, Role::Control]);
    let driver = Driver::start(&run.name);
    let mut witness = Witness::new(&run);
    let bus = Bus::join(&run.name).unwrap();
    let mut missions = bus.inlet(&MISSION).unwrap();
    let mut said_at_ns = BTreeMap::new();
    witness.until_driving("all is well");
    let faults = [
        ("mission is lost", MissionFate::Lost, Decision::Stop(StopReason::StaleMission)),
        ("mission is over", MissionFate::Over, Decision::Hold(HoldReason::NoMission)),
    ];
    for (fault, mission, decision) in faults {
        driver.behave(Misbehaviour { mission, ..Misbehaviour::default() });
        witness.decided.clear();
        let took_ms = witness.until_decided(fault, decision);
        let stands_ms = witness.until_standing(fault);
        println!("{fault:36} {took_ms:7.0} ms, stands after {:7.0} ms", took_ms + stands_ms);
        // For as long as it lasts, and for no other reason in between.
        let n_before = witness.decided.len();
        witness.until(fault, |witness| witness.decided.len() >= n_before + 20);
        let after = witness.decided[n_before..].iter().map(|record| record.command.decision());
        assert!(after.clone().all(|after| after == Some(decision)), "{:?}", after.collect::<Vec<_>>());
        driver.behave(Misbehaviour::default());
        witness.until_driving("there is a mission again");
        // However late anything comes, nothing is driven for a mission of longer ago than its limit.
        missions.poll(|stamp, _| {
            said_at_ns.insert(stamp.sequence, stamp.valid_at_ns);
        });
        for record in &witness.decided {
            let drives = matches!(record.command.decision(), Some(Decision::Drive(_)));
            if let Some(said_at_ns) = said_at_ns.get(&record.mission.sequence).filter(|_| drives) {
                assert!(record.decided_at_ns.saturating_sub(*said_at_ns) <= ages().mission_ns, "{record:?}");
            }
        }
    }
}
