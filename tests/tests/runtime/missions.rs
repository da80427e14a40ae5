//! Missions that end, missions that are lost, and orders while they are under way: the vehicle stops, says why, and goes on.

use std::collections::BTreeMap;

use bicycle::{Decision, HoldReason, StopReason};
use bus::channel::{Bus, MISSION, RISK};
use bus::message::DecisionRecord;
use bus::status::Role;
use navigator::{Belief, Order, OrderRefusal, Route};
use runtime::operator::{self, OperatorError};
use runtime::replay::{self, Knowledge};

use crate::driver::{Driver, Misbehaviour, MissionFate};
use crate::fixture::{ALPHA, Run, ages, eventually, task};
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

/// Somebody who directs a run, and sees what becomes of it.
struct Directed {
    run: Run,
    bus: Bus,
    witness: Witness,
    table: Vec<(&'static str, [f64; 2])>,
}

impl Directed {
    fn start() -> Self {
        let mut run = Run::new();
        let (bus, mut witness) = (Bus::join(&run.name).unwrap(), Witness::new(&run));
        run.start(Role::Recorder);
        witness.until("a file", |_| !run.recordings().is_empty());
        run.start_all(&[Role::Mission, Role::Plant, Role::Mapping, Role::Learning, Role::Control]);
        witness.until_driving("all processes up");
        Self { run, bus, witness, table: Vec::new() }
    }

    fn tell(&self, order: Order) {
        operator::tell(&self.bus, &order).unwrap();
    }

    fn assert_refused(&self, order: Order, expected: OrderRefusal) {
        let told = operator::tell(&self.bus, &order);
        assert!(matches!(&told, Err(OperatorError::Refused(refusal)) if *refusal == expected), "{told:?}");
    }

    /// An order after which the vehicle stands, for as long as nothing else is said.
    fn stands(&mut self, order: Order, name: &'static str, decision: Decision) {
        self.witness.decided.clear();
        self.tell(order);
        let decided_ms = self.witness.until_decided(name, decision);
        let stands_ms = self.witness.until_standing(name);
        self.table.push((name, [decided_ms, decided_ms + stands_ms]));
        let n_before = self.witness.decided.len();
        self.witness.until(name, |witness| witness.decided.len() >= n_before + 15);
        // On a machine under load other reasons to stand come and go; what never comes is to drive.
        let drives = |record: &DecisionRecord| matches!(record.command.decision(), Some(Decision::Drive(_)));
        assert!(!self.witness.decided[n_before..].iter().any(drives), "{name}: it drives");
    }

    fn drives(&mut self, order: Order, why: &str) {
        self.tell(order);
        self.witness.until_driving(why);
    }
}

fn to(goals_m: &[[f64; 2]]) -> Order {
    Order::Drive(Route::goals(goals_m.to_vec(), 1.0).unwrap())
}

#[test]
fn orders_are_followed_in_a_control_cycle_and_every_decision_is_made_again() {
    let mut directed = Directed::start();
    let goal_m = task().goal_m;
    directed.stands(Order::Pause, "pause", Decision::Hold(HoldReason::Paused));
    directed.drives(Order::Resume, "resumed");
    let stopped = Decision::Stop(StopReason::EmergencyStop);
    directed.stands(Order::EmergencyStop, "emergency stop", stopped);
    for order in [to(&[goal_m]), Order::Resume, Order::TakeOver] {
        directed.assert_refused(order, OrderRefusal::EmergencyStop);
    }
    directed.stands(Order::Reset, "reset", Decision::Hold(HoldReason::Paused));
    directed.drives(Order::Resume, "resumed after the reset");
    directed.stands(Order::TakeOver, "take over", Decision::Hold(HoldReason::Manual));
    directed.drives(Order::Resume, "given back");
    directed.stands(Order::Cancel, "cancel", Decision::Hold(HoldReason::NoMission));
    directed.assert_refused(Order::Resume, OrderRefusal::NoMission);
    directed.drives(to(&[goal_m]), "a new mission");
    let [x_m, y_m, _] = directed.witness.last.unwrap().position_m;
    let path = Route::path(vec![[x_m, y_m], goal_m], 0.6, 1.0).unwrap();
    directed.drives(Order::Drive(path), "a path");
    for (name, [decided_ms, stands_ms]) in &directed.table {
        println!("{name:36} {decided_ms:7.0} ms, stands after {stands_ms:7.0} ms");
    }
    directed.run.end();
    let records = replay::read(&directed.run.recordings()).unwrap();
    let report =
        replay::replay(&records, &Knowledge { belief: Belief::Physics, checkpoint: 0, corrector: None })
            .unwrap();
    assert_eq!((report.first_difference, report.missing), (None, vec![]));
    assert!(report.n_identical == report.n_decisions && report.n_decisions > 100, "{}", report.n_decisions);
}

#[test]
fn the_share_of_outcomes_changes_while_driving_and_maps_say_for_which_they_were_judged() {
    let mut directed = Directed::start();
    let mut maps = directed.bus.inlet(&RISK).unwrap();
    let mut judged_for = || {
        let (_, header) = eventually(30.0, || maps.newest().map(|map| *map.header())).unwrap();
        header.alpha
    };
    assert_eq!(judged_for(), ALPHA);
    directed.drives(Order::Tolerate(traversability::CvarLevel::new(0.1).unwrap()), "for the worst tenth");
    eventually(30.0, || (judged_for() == 0.1).then_some(())).expect("maps for the worst tenth");
    directed.witness.decided.clear();
    directed.witness.until("ten decisions on them", |witness| witness.decided.len() >= 10);
    directed.run.end();
    let records = replay::read(&directed.run.recordings()).unwrap();
    let report =
        replay::replay(&records, &Knowledge { belief: Belief::Physics, checkpoint: 0, corrector: None })
            .unwrap();
    assert_eq!((report.first_difference, report.missing), (None, vec![]));
    assert_eq!(report.n_identical, report.n_decisions);
    let levels: std::collections::BTreeSet<_> =
        records.risks[0].values().map(|map| map.alpha.to_bits()).collect();
    assert_eq!(levels, [ALPHA, 0.1].map(f64::to_bits).into());
}

/// Nobody knows any more what was ordered: the vehicle stops as it does when a mission is lost.
#[test]
fn the_death_of_the_mission_stops_the_vehicle() {
    let mut directed = Directed::start();
    directed.run.kill(Role::Mission);
    let witness = &mut directed.witness;
    let decided_ms = witness.until_decided("mission killed", Decision::Stop(StopReason::StaleMission));
    let stands_ms = witness.until_standing("mission killed");
    println!(
        "mission killed: stop is decided      {decided_ms:7.0} ms, stands after {:7.0} ms",
        decided_ms + stands_ms
    );
    directed.run.start(Role::Mission);
    witness.until_driving("there is a mission again");
    directed.run.end();
}
