//! Orders in whatever sequence: what must never happen, and what each of them does.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use proptest::prelude::*;

use super::*;

const AGE_MAX_NS: u64 = 1000;
const STOPPED: Instruction<'_> = Instruction::Stand(Decision::Stop(StopReason::EmergencyStop));

fn hold(reason: HoldReason) -> Instruction<'static> {
    Instruction::Stand(Decision::Hold(reason))
}

fn route() -> Route {
    Route::goals(vec![[10.0, 0.0], [10.0, 10.0], [0.0, 10.0]], 1.0).unwrap()
}

fn at(x_m: f64, y_m: f64, speed_mps: f64) -> Odometry {
    Odometry { position_m: [x_m, y_m, 0.0], velocity_mps: [speed_mps, 0.0], ..Odometry::default() }
}

/// Somebody who speaks in time.
struct Operator {
    mission: Mission,
    now_ns: u64,
}

impl Operator {
    fn new() -> Self {
        Self { mission: Mission::new(AGE_MAX_NS), now_ns: 5000 }
    }

    fn says(&mut self, order: Order) -> Result<(), OrderRefusal> {
        self.now_ns += 10;
        let said = Said { at_ns: self.now_ns, sender_ns: self.now_ns, sequence: 1 };
        self.mission.order(order, said, self.now_ns)
    }

    fn drives(&self) -> bool {
        matches!(self.mission.instruction(), Instruction::Drive(_))
    }
}

#[test]
fn a_list_of_goals_is_driven_in_its_order_and_over_where_the_vehicle_stands_at_the_last() {
    let mut operator = Operator::new();
    assert_eq!(operator.mission.instruction(), hold(HoldReason::NoMission));
    operator.says(Order::Drive(route())).unwrap();
    let mission = &mut operator.mission;
    let goal = |mission: &Mission| mission.target().unwrap().end().goal_m;
    assert_eq!((goal(mission), mission.progress()), ([10.0, 0.0], (0, 3)));
    assert!(!mission.advance(&at(0.0, 10.0, 0.0)), "the last one is not its turn");
    assert!(mission.advance(&at(9.5, 0.0, 1.0)), "passed without standing");
    assert_eq!((goal(mission), mission.progress()), ([10.0, 10.0], (1, 3)));
    assert!(mission.advance(&at(10.0, 10.0, 1.0)));
    assert!(!mission.advance(&at(0.5, 10.0, 1.0)), "there, and still rolling");
    assert!(!mission.advance(&at(f64::NAN, 10.0, 0.0)), "nobody knows where");
    assert!(matches!(mission.instruction(), Instruction::Drive(_)));
    assert!(mission.advance(&at(0.4, 10.0, 0.0)));
    assert_eq!((mission.stage(), mission.instruction()), (Stage::Reached, hold(HoldReason::NoMission)));
    assert!(!mission.advance(&at(50.0, 10.0, 0.0)), "what is over stays over");
    operator.says(Order::Drive(route())).unwrap();
    assert_eq!((operator.mission.number(), operator.drives()), (2, true), "the next one");
}

#[test]
fn whoever_pauses_goes_on_where_it_was() {
    let mut operator = Operator::new();
    assert_eq!(operator.says(Order::Pause), Err(OrderRefusal::NoMission));
    assert_eq!(operator.says(Order::Resume), Err(OrderRefusal::NoMission));
    operator.says(Order::Drive(route())).unwrap();
    operator.mission.advance(&at(9.5, 0.0, 1.0));
    operator.says(Order::Pause).unwrap();
    assert_eq!(operator.mission.instruction(), hold(HoldReason::Paused));
    operator.says(Order::Resume).unwrap();
    assert_eq!((operator.drives(), operator.mission.progress()), (true, (1, 3)));
    operator.says(Order::Pause).unwrap();
    operator.says(Order::Drive(route())).unwrap();
    assert_eq!(
        (operator.drives(), operator.mission.progress()),
        (true, (0, 3)),
        "a new one is meant to be driven"
    );
    operator.says(Order::Cancel).unwrap();
    assert_eq!(operator.mission.instruction(), hold(HoldReason::NoMission));
    assert_eq!(
        operator.says(Order::Resume),
        Err(OrderRefusal::NoMission),
        "what is over is not taken up again"
    );
}

#[test]
fn an_emergency_stop_ends_by_a_reset_and_a_reset_moves_nothing() {
    let mut operator = Operator::new();
    operator.says(Order::Drive(route())).unwrap();
    operator.says(Order::EmergencyStop).unwrap();
    for order in [Order::Drive(route()), Order::Resume, Order::Pause, Order::TakeOver] {
        assert_eq!(operator.says(order), Err(OrderRefusal::EmergencyStop));
        assert_eq!(operator.mission.instruction(), STOPPED);
    }
    operator.says(Order::Reset).unwrap();
    assert_eq!(operator.mission.instruction(), hold(HoldReason::Paused));
    assert_eq!(operator.says(Order::Reset), Err(OrderRefusal::NoEmergencyStop));
    operator.says(Order::Resume).unwrap();
    assert!(operator.drives());
    operator.says(Order::EmergencyStop).unwrap();
    operator.says(Order::Cancel).unwrap();
    assert_eq!(operator.mission.instruction(), STOPPED, "what is cancelled meanwhile changes nothing");
    operator.says(Order::Reset).unwrap();
    assert_eq!(operator.mission.instruction(), hold(HoldReason::NoMission));
}

#[test]
fn whoever_does_not_know_what_was_ordered_before_begins_with_the_stop_latched() {
    let mut operator = Operator { mission: Mission::new(AGE_MAX_NS).latched(), ..Operator::new() };
    assert_eq!(operator.mission.instruction(), STOPPED);
    assert_eq!(operator.says(Order::Drive(route())), Err(OrderRefusal::EmergencyStop));
    operator.says(Order::Reset).unwrap();
    operator.says(Order::Drive(route())).unwrap();
    assert!(operator.drives());
}

#[test]
fn an_operator_has_the_wheel_until_it_is_given_back_or_there_is_an_emergency() {
    let mut operator = Operator::new();
    operator.says(Order::Drive(route())).unwrap();
    operator.says(Order::TakeOver).unwrap();
    assert_eq!(operator.mission.instruction(), hold(HoldReason::Manual));
    assert_eq!(operator.says(Order::Drive(route())), Err(OrderRefusal::Manual));
    operator.mission.advance(&at(10.0, 0.5, 2.0));
    operator.says(Order::Resume).unwrap();
    assert_eq!((operator.drives(), operator.mission.progress()), (true, (1, 3)), "whoever drove there");
    operator.says(Order::TakeOver).unwrap();
    operator.says(Order::EmergencyStop).unwrap();
    operator.says(Order::Reset).unwrap();
    assert_eq!(operator.mission.instruction(), hold(HoldReason::Paused), "nobody has the wheel");
}

#[test]
fn an_emergency_stop_counts_however_late_it_comes_but_not_beyond_a_reset() {
    let mut mission = Mission::new(AGE_MAX_NS);
    let said = |at_ns: u64, sender_ns: u64| Said { at_ns, sender_ns, sequence: 1 };
    mission.order(Order::Drive(route()), said(9000, 1), 9000).unwrap();
    mission.order(Order::EmergencyStop, said(100, 2), 9100).unwrap();
    assert_eq!(mission.instruction(), STOPPED, "said before the drive, and heard after it");
    // A reset of before the stop was heard, but after it was said, is one that was meant.
    mission.order(Order::Reset, said(9050, 3), 9100).unwrap();
    assert_eq!(mission.order(Order::EmergencyStop, said(100, 2), 9200), Err(OrderRefusal::OutOfOrder));
    assert!(!mission.is_latched());
    // A clock that is ahead must not keep out the reset.
    mission.order(Order::EmergencyStop, said(u64::MAX, 4), 9300).unwrap();
    mission.order(Order::Reset, said(9400, 5), 9400).unwrap();
    assert_eq!(mission.instruction(), hold(HoldReason::Paused));
}

#[test]
fn what_is_heard_twice_counts_once() {
    let mut mission = Mission::new(AGE_MAX_NS);
    let said = Said { at_ns: 5000, sender_ns: 1, sequence: 7 };
    mission.order(Order::Drive(route()), said, 5000).unwrap();
    mission.advance(&at(10.0, 0.0, 1.0));
    for sequence in [6, 7] {
        let again = Said { sequence, ..said };
        assert_eq!(mission.order(Order::Drive(route()), again, 5000), Err(OrderRefusal::OutOfOrder));
    }
    assert_eq!((mission.progress(), mission.refused()[&OrderRefusal::OutOfOrder]), ((1, 3), 2));
}

#[test]
fn the_share_of_outcomes_is_as_said_last() {
    let mut operator = Operator::new();
    assert_eq!(operator.mission.level(), None);
    operator.says(Order::EmergencyStop).unwrap();
    let level = CvarLevel::new(0.25).unwrap();
    operator.says(Order::Tolerate(level)).unwrap();
    assert_eq!(operator.mission.level(), Some(level));
}

/// What happens to a mission.
#[derive(Clone, Debug)]
enum Event {
    /// An order of one of three senders, heard so long after it was said; negative: it claims to come from the future.
    Order(Order, u64, i64),
    /// The vehicle is here.
    Odometry(f64, f64, f64),
}

fn orders() -> impl Strategy<Value = Order> {
    prop_oneof![
        3 => Just(Order::Drive(route())),
        2 => Just(Order::Pause),
        2 => Just(Order::Resume),
        1 => Just(Order::Cancel),
        1 => Just(Order::TakeOver),
        2 => Just(Order::EmergencyStop),
        2 => Just(Order::Reset),
    ]
}

fn events() -> impl Strategy<Value = Vec<(Event, u64)>> {
    let delay_ns = prop_oneof![4 => Just(0), 2 => 0..300_i64, 1 => 900..1200_i64, 1 => -50..0_i64];
    let order =
        (orders(), 0..3_u64, delay_ns).prop_map(|(order, sender, delay)| Event::Order(order, sender, delay));
    let odometry = (0.0..11.0, 0.0..11.0, prop_oneof![Just(0.0), Just(1.0)])
        .prop_map(|(x_m, y_m, speed_mps)| Event::Odometry(x_m, y_m, speed_mps));
    prop::collection::vec((prop_oneof![3 => order, 1 => odometry], 0..200_u64), 1..60)
}

/// What must hold whatever is said, told from what was taken and from nothing inside of the mission.
#[derive(Default)]
struct Watch {
    is_stopped: bool,
    /// Taken to drive, and neither paused, nor over, nor in another's hands since.
    may_drive: bool,
    latest_ns: u64,
    n_refused: u64,
}

impl Watch {
    fn note(&mut self, order: &Order, said: Said, now_ns: u64) {
        self.latest_ns = self.latest_ns.max(said.at_ns.min(now_ns));
        match order {
            Order::EmergencyStop => (self.is_stopped, self.may_drive) = (true, false),
            Order::Reset => self.is_stopped = false,
            Order::Drive(_) | Order::Resume => self.may_drive = true,
            Order::Pause | Order::Cancel | Order::TakeOver => self.may_drive = false,
            Order::Tolerate(_) => {}
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn nothing_moves_that_must_not_and_what_comes_late_or_out_of_order_is_counted(events in events()) {
        let (mut mission, mut watch) = (Mission::new(AGE_MAX_NS), Watch::default());
        let (mut now_ns, mut sequence) = (10_000_u64, 0);
        for (event, step_ns) in events {
            now_ns += step_ns;
            match event {
                Event::Odometry(x_m, y_m, speed_mps) => {
                    mission.advance(&at(x_m, y_m, speed_mps));
                    watch.may_drive &= mission.stage() != Stage::Reached;
                }
                Event::Order(order, sender_ns, delay_ns) => {
                    sequence += 1;
                    let said = Said { at_ns: now_ns.saturating_add_signed(-delay_ns), sender_ns, sequence };
                    let before = mission.clone();
                    match mission.order(order.clone(), said, now_ns) {
                        Ok(()) => {
                            if order != Order::EmergencyStop {
                                prop_assert!(said.at_ns <= now_ns, "of the future");
                                prop_assert!(said.at_ns + AGE_MAX_NS >= now_ns, "stale");
                                prop_assert!(said.at_ns >= watch.latest_ns, "out of order");
                            }
                            watch.note(&order, said, now_ns);
                        }
                        Err(refusal) => {
                            watch.n_refused += 1;
                            prop_assert_eq!(mission.refused()[&refusal], before.refused().get(&refusal).unwrap_or(&0) + 1);
                            prop_assert_eq!(mission.instruction(), before.instruction(), "what is refused changes nothing");
                        }
                    }
                }
            }
            prop_assert_eq!(mission.refused().values().sum::<u64>(), watch.n_refused);
            prop_assert_eq!(mission.instruction() == STOPPED, watch.is_stopped);
            if matches!(mission.instruction(), Instruction::Drive(_)) {
                prop_assert!(watch.may_drive, "{:?}", mission);
            }
        }
    }
}
