//! Goals from their beginning to their end, by what the mission says.

use super::*;
use bus::message::mission::{DRIVE, NONE, PAUSED};

const SECOND: u64 = SECOND_NS;

/// Goals, orders that are given and answered at once, and the ends that are told, by numbers of those who asked.
#[derive(Default)]
struct Client {
    errands: Errands<u32>,
    n_orders: u64,
    now_ns: u64,
}

impl Client {
    fn order(&mut self) -> Ticket {
        self.n_orders += 1;
        Ticket(self.n_orders)
    }

    /// Says a goal that the mission has not answered yet.
    fn says(&mut self) -> (GoalId, Ticket) {
        let (id, ticket) = (GoalId::new_random(), self.order());
        self.errands.admit(id).unwrap();
        let accepted =
            Accepted { id, place_m: [1.0, 2.0], at_ns: self.now_ns, stamp_ns: self.now_ns as i64 + 1 };
        self.errands.begin(accepted, ticket);
        assert_eq!(self.errands.ask(id, ticket.0 as u32), None, "it is not over");
        (id, ticket)
    }

    fn is_answered(&mut self, ticket: Ticket, said: Result<MissionRecord, &str>) {
        self.errands.note_answer(ticket, &said.map_err(str::to_owned), self.now_ns);
    }

    /// Says a goal that becomes the mission of this number.
    fn drives(&mut self, number: u64) -> GoalId {
        let (id, ticket) = self.says();
        self.is_answered(ticket, Ok(driving(number)));
        self.errands.follow(&driving(number), self.now_ns);
        id
    }

    fn status(&mut self, id: GoalId) -> GoalStatusEnum {
        self.errands.has_news = true;
        let news = self.errands.news(self.now_ns).unwrap();
        news.into_iter().find(|(accepted, _)| accepted.id == id).unwrap().1
    }

    fn cancels(&mut self, id: GoalId) -> usize {
        self.errands.cancel(id, 0, self.now_ns, Ticket(self.n_orders)).unwrap().len()
    }

    /// Whether the mission is told to cancel now, if orders up to this one are answered.
    fn orders_cancel(&mut self, answered: Ticket) -> Option<Ticket> {
        let (before, now_ns) = (self.n_orders, self.now_ns);
        let Self { errands, n_orders, .. } = self;
        errands.cancel_due(now_ns, answered, || {
            *n_orders += 1;
            Some(Ticket(*n_orders))
        });
        (self.n_orders > before).then_some(Ticket(self.n_orders))
    }

    fn ends(&mut self) -> Vec<(u32, GoalStatusEnum, String)> {
        let told = self.errands.take_told().into_iter();
        told.map(|(asker, Ending { status, problem })| (asker, status, problem)).collect()
    }
}

fn driving(number: u64) -> MissionRecord {
    MissionRecord { number, state: DRIVE, ..MissionRecord::default() }
}

fn over(number: u64, outcome: u64) -> MissionRecord {
    MissionRecord { number, state: NONE, outcome, ..MissionRecord::default() }
}

#[test]
fn a_goal_is_accepted_driven_and_reached() {
    let mut client = Client::default();
    let (id, ticket) = client.says();
    assert_eq!(client.status(id), GoalStatusEnum::Accepted);
    assert_eq!(client.errands.progress(SECOND), None, "it is not under way");
    client.is_answered(ticket, Ok(driving(3)));
    assert_eq!(client.status(id), GoalStatusEnum::Executing);
    // What was said before may come after the answer.
    client.errands.follow(&over(2, REACHED), 0);
    client.errands.follow(&MissionRecord { state: PAUSED, ..driving(3) }, 0);
    assert_eq!(client.status(id), GoalStatusEnum::Executing, "it waits");
    assert_eq!(client.errands.progress(SECOND).unwrap().id, id);
    assert_eq!(client.errands.progress(SECOND + SECOND / 4), None, "told a moment ago");
    assert!(client.errands.progress(SECOND + SECOND / 2).is_some());
    client.errands.follow(&over(3, REACHED), 0);
    assert_eq!(client.ends(), [(1, GoalStatusEnum::Succeeded, String::new())]);
    assert_eq!(client.ends(), [], "told once");
    assert!(client.errands.problems().is_empty());
    assert_eq!(client.errands.ask(id, 7).unwrap().status, GoalStatusEnum::Succeeded, "who asks later");
    assert_eq!(client.errands.ask(GoalId::new_random(), 7).unwrap().status, GoalStatusEnum::Unknown);
    assert_eq!(client.errands.progress(9 * SECOND), None);
}

#[test]
fn what_ends_a_goal_short_of_its_place_is_said() {
    let stopped = MissionRecord { state: EMERGENCY_STOP, ..driving(1) };
    let anew = MissionRecord { state: EMERGENCY_STOP, ..driving(0) };
    for (said, problem) in [
        (driving(2), "another goal or path has taken its place"),
        (stopped, "emergency stop"),
        (anew, "mission lost: whoever led it has begun anew"),
        (over(1, CANCELLED), "the mission was cancelled"),
        (over(1, 4), "the mission was given up, with outcome 4"),
    ] {
        let mut client = Client::default();
        client.drives(1);
        client.errands.follow(&said, 0);
        assert_eq!(client.ends(), [(1, GoalStatusEnum::Aborted, problem.to_owned())]);
    }
    let mut client = Client::default();
    let (_, ticket) = client.says();
    client.is_answered(ticket, Err("refused: it leads out of the geofence"));
    let problem = "refused: it leads out of the geofence".to_owned();
    assert_eq!(client.errands.problems(), std::slice::from_ref(&problem));
    assert!(client.errands.problems().is_empty(), "said once");
    assert_eq!(client.ends(), [(1, GoalStatusEnum::Aborted, problem)]);
}

#[test]
fn a_goal_that_is_refused_takes_nobodys_place() {
    let mut client = Client::default();
    let first = client.drives(1);
    let (_, ticket) = client.says();
    client.is_answered(ticket, Err("refused: it leads out of the geofence"));
    assert_eq!(client.status(first), GoalStatusEnum::Executing);
    client.drives(2);
    let ends = client.ends();
    assert_eq!((ends[0].0, ends[0].1), (1, GoalStatusEnum::Aborted), "by the answer to the next");
    assert_eq!(client.status(first), GoalStatusEnum::Aborted);
}

#[test]
fn who_cancels_is_told_so_once_the_mission_is_cancelled() {
    let mut client = Client::default();
    let id = client.drives(1);
    assert_eq!(client.orders_cancel(Ticket(1)), None, "nobody wants it");
    assert_eq!((client.cancels(id), client.status(id)), (1, GoalStatusEnum::Canceling));
    let ticket = client.orders_cancel(Ticket(1)).unwrap();
    assert_eq!(client.orders_cancel(Ticket(1)), None, "once");
    assert_eq!(client.cancels(id), 1, "who says so again");
    client.is_answered(ticket, Ok(over(1, CANCELLED)));
    assert_eq!(client.ends()[0].1, GoalStatusEnum::Canceled);
    assert_eq!(client.errands.cancel(id, 0, 0, ticket), Err(Uncancelled::Over));
    assert_eq!(client.errands.cancel(GoalId::new_random(), 0, 0, ticket), Err(Uncancelled::Unknown));
    assert_eq!(client.cancels(GoalId::ZERO), 0, "there is none left");
}

#[test]
fn a_cancel_that_is_not_answered_is_ordered_again_a_second_later() {
    let mut client = Client::default();
    let id = client.drives(1);
    client.cancels(id);
    let ticket = client.orders_cancel(Ticket(1)).unwrap();
    client.is_answered(ticket, Err("expected an answer, found none"));
    assert_eq!(client.orders_cancel(ticket), None);
    client.now_ns = SECOND;
    assert!(client.orders_cancel(ticket).is_some());
}

#[test]
fn a_cancel_strikes_no_other_mission() {
    let mut client = Client::default();
    let id = client.drives(1);
    let another = client.order();
    client.cancels(id);
    assert_eq!(client.orders_cancel(Ticket(1)), None, "what was ordered before may take its place");
    client.is_answered(another, Ok(driving(2)));
    assert_eq!(client.orders_cancel(another), None);
    let ends = client.ends();
    assert_eq!(
        (ends[0].1, ends[0].2.as_str()),
        (GoalStatusEnum::Canceled, "another goal or path has taken its place")
    );
    // One that waits is cancelled when it is under way.
    let (id, ticket) = client.says();
    client.cancels(id);
    assert_eq!(client.orders_cancel(another), None);
    client.is_answered(ticket, Ok(driving(3)));
    assert!(client.orders_cancel(ticket).is_some());
    client.errands.follow(&over(3, REACHED), 0);
    assert_eq!(client.ends()[0].1, GoalStatusEnum::Succeeded, "it was there before");
}

#[test]
fn goals_are_cancelled_by_the_time_of_their_acceptance() {
    let mut client = Client::default();
    client.drives(1);
    client.now_ns = SECOND;
    let (later, _) = client.says();
    let last = Ticket(client.n_orders);
    assert_eq!(client.errands.cancel(GoalId::ZERO, SECOND as i64, 0, last).unwrap().len(), 1);
    assert_eq!(client.status(later), GoalStatusEnum::Accepted);
    assert_eq!(client.errands.cancel(later, SECOND as i64, 0, last).unwrap().len(), 2);
    assert_eq!(client.cancels(GoalId::ZERO), 2);
}

#[test]
fn floods_are_bounded() {
    let mut client = Client::default();
    for number in 1..200 {
        let id = client.drives(number);
        assert_eq!(client.errands.admit(id), Err(ErrandError::Known));
        for asker in 0..100 {
            client.errands.ask(id, asker);
        }
        let n_askers = client.errands.errands.last().unwrap().askers.len();
        assert_eq!(n_askers, ASKERS_MAX);
        client.errands.news(client.now_ns);
    }
    assert_eq!(client.errands.errands.len(), OVER_MAX + 1, "those that are over, and the last");
    assert_eq!(client.ends().len(), OVER_MAX * ASKERS_MAX);
    for _ in 1..OPEN_MAX {
        client.says();
    }
    assert_eq!(client.errands.admit(GoalId::new_random()), Err(ErrandError::TooMany));
    client.now_ns = OVER_NS;
    client.errands.news(client.now_ns);
    assert_eq!(client.errands.errands.len(), OPEN_MAX);
}
