//! Processes that keep dying, and processes that refuse their input.

use std::cell::{Cell, RefCell};
use std::process::Command;

use bus::channel::Bus;
use bus::clock::now_ns;
use bus::status::{Meter, Role};
use runtime::supervisor::{RestartPolicy, RunEnd, Start, Supervisor};

use crate::fixture::Run;

/// Soon enough for a test.
const POLICY: RestartPolicy = RestartPolicy {
    restarts_max: 3,
    back_off_ns: 20_000_000,
    back_off_max_ns: 60_000_000,
    window_ns: 60_000_000_000,
};

/// How it ended, and when each process was started [ms].
fn supervise(roles: &[Role], script: &str) -> (RunEnd, Vec<(Role, u64)>) {
    let run = Run::new();
    let bus = Bus::join(&run.name).unwrap();
    let (starts, began_ns) = (RefCell::new(Vec::new()), now_ns());
    let command = |role: Role, start: Start| {
        // Whoever takes the place of one that has died is told so, and nobody else.
        let is_again = starts.borrow().iter().any(|(started, _)| *started == role);
        assert_eq!(start == Start::Again, is_again);
        starts.borrow_mut().push((role, (now_ns() - began_ns) / 1_000_000));
        let mut command = Command::new("sh");
        command.args(["-c", script, role.name()]);
        command
    };
    let mut supervisor = Supervisor::new(&bus, roles, POLICY, &command).unwrap();
    let end = supervisor.run(&|| now_ns() - began_ns > 30_000_000_000, &mut |_| ());
    (end, starts.into_inner())
}

#[test]
fn what_keeps_dying_is_started_again_ever_later_and_then_given_up() {
    let (end, starts) = supervise(&[Role::Control], "exit 1");
    let RunEnd::GaveUp { role: Role::Control, why } = end else { panic!("{end:?}") };
    assert_eq!(why, "it ended 4 times within 60 s, the last time by exit status: 1");
    assert_eq!(starts.len(), 4, "once, and three times again");
    // At least as late as stated: 20, 40, then at the most 60 ms.
    for (pair, least_ms) in starts.windows(2).zip([20, 40, 60]) {
        assert!(pair[1].1 - pair[0].1 >= least_ms, "{starts:?}");
    }
}

#[test]
fn a_killed_process_counts_as_dead_and_says_by_what() {
    let (end, _) = supervise(&[Role::Mapping], "kill -9 $$");
    let RunEnd::GaveUp { role: Role::Mapping, why } = end else { panic!("{end:?}") };
    assert!(why.contains("signal: 9"), "{why}");
}

#[test]
fn what_refuses_its_input_is_not_started_again_and_takes_the_others_along() {
    let script = "[ $0 = mapping ] && exit 2; exec sleep 30";
    let (end, starts) = supervise(&[Role::Learning, Role::Mapping], script);
    assert_eq!(end, RunEnd::GaveUp { role: Role::Mapping, why: "it refused its input".to_owned() });
    assert_eq!(starts.iter().map(|(role, _)| *role).collect::<Vec<_>>(), [Role::Learning, Role::Mapping]);
}

#[test]
fn the_others_start_once_the_recorder_hears_them_or_has_died() {
    let run = Run::new();
    let bus = Bus::join(&run.name).unwrap();
    let (starts, meter, n_looks) = (RefCell::new(Vec::new()), RefCell::new(None), Cell::new(0));
    let command = |role: Role, _| {
        starts.borrow_mut().push(role);
        let mut command = Command::new("sleep");
        command.arg("30");
        command
    };
    let roles = [Role::Control, Role::Recorder];
    let mut supervisor = Supervisor::new(&bus, &roles, POLICY, &command).unwrap();
    let is_over = || {
        n_looks.set(n_looks.get() + 1);
        if n_looks.get() == 10 {
            assert_eq!(*starts.borrow(), [Role::Recorder], "nobody was to speak before it listens");
            meter.replace(Some(Meter::new(&bus, Role::Recorder).unwrap()));
        }
        starts.borrow().len() == 2 || n_looks.get() > 200
    };
    assert_eq!(supervisor.run(&is_over, &mut |_| ()), RunEnd::Interrupted);
    assert_eq!(starts.into_inner(), [Role::Recorder, Role::Control]);
    let (_, starts) = supervise(&roles, "[ $0 = recorder ] && exit 1; exit 2");
    assert_eq!([starts[0].0, starts[1].0], [Role::Recorder, Role::Control], "without a recording");
}

#[test]
fn the_end_of_the_vehicle_ends_the_run() {
    for code in [0, 1] {
        let script = format!("[ $0 = plant ] && exit {code}; exec sleep 30");
        let (end, _) = supervise(&[Role::Plant, Role::Control], &script);
        assert_eq!(end, RunEnd::Plant(code));
    }
}
