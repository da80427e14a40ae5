//! As regular as the system permits: cores of its own, a fixed priority, memory that stays where it is.

use rustix::mm::{MlockAllFlags, mlockall};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use thread_priority::{
    Error, RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

use bus::status::Role;

/// Sets cores, priority and memory of this thread, and of those that it will start, as a role needs them; says what was done and what was not permitted.
///
/// Control has the last core for itself, the others share the rest. SCHED_FIFO goes to those that the vehicle waits for;
/// learning and the recorder take what is left. To be called before the process starts any other thread.
pub fn configure_thread(role: Role) -> String {
    [pinned(role), scheduled(role), locked()].join("; ")
}

/// SCHED_FIFO priority; `None` keeps the ordinary policy.
fn priority(role: Role) -> Option<u8> {
    match role {
        Role::Control => Some(50),
        Role::Plant | Role::Ros => Some(45),
        Role::Mapping | Role::Mission => Some(40),
        Role::Learning | Role::Recorder => None,
    }
}

fn pinned(role: Role) -> String {
    let allowed = match sched_getaffinity(None) {
        Ok(allowed) => allowed,
        Err(error) => return format!("not pinned: {error}"),
    };
    let cores: Vec<usize> = (0..CpuSet::MAX_CPU).filter(|&core| allowed.is_set(core)).collect();
    let Some(own) = own_cores(role, &cores) else { return "not pinned: there is one core only".to_owned() };
    let mut wanted = CpuSet::new();
    own.iter().for_each(|&core| wanted.set(core));
    match sched_setaffinity(None, &wanted) {
        Ok(()) => {
            format!("pinned to core {}", own.iter().map(usize::to_string).collect::<Vec<_>>().join(", "))
        }
        Err(error) => format!("not pinned: {error}"),
    }
}

/// The cores of a role among those there are.
fn own_cores(role: Role, cores: &[usize]) -> Option<&[usize]> {
    match cores {
        [] | [_] => None,
        [_, .., _] if role == Role::Control => cores.get(cores.len() - 1..),
        [..] => cores.get(..cores.len() - 1),
    }
}

fn scheduled(role: Role) -> String {
    let Some(level) = priority(role) else { return "ordinary priority".to_owned() };
    let Ok(value) = ThreadPriorityValue::try_from(level) else { return "no SCHED_FIFO".to_owned() };
    let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    match set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(value), fifo) {
        Ok(()) => format!("SCHED_FIFO {level}"),
        Err(Error::OS(code)) => {
            let error = std::io::Error::from_raw_os_error(code);
            format!("no SCHED_FIFO: {error}; it takes CAP_SYS_NICE or a limit `rtprio` of {level}")
        }
        Err(error) => format!("no SCHED_FIFO: {error:?}"),
    }
}

fn locked() -> String {
    // Locked once it is used: what channels keep in reserve is not fetched for that.
    match mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE | MlockAllFlags::ONFAULT) {
        Ok(()) => "memory locked".to_owned(),
        Err(error) => {
            format!("memory not locked: {error}; it takes CAP_IPC_LOCK or a higher limit `memlock`")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_has_a_core_of_its_own_where_there_are_two() {
        for cores in [vec![0, 1], vec![2, 5, 7]] {
            let control = own_cores(Role::Control, &cores).unwrap();
            let others = own_cores(Role::Learning, &cores).unwrap();
            assert_eq!([others, control].concat(), cores);
            assert_eq!(control.len(), 1);
        }
        assert_eq!(own_cores(Role::Control, &[3]), None);
        assert_eq!(own_cores(Role::Plant, &[]), None);
    }

    #[test]
    fn it_says_what_was_done_or_why_not() {
        // A thread of its own: it stays settled.
        let told = std::thread::spawn(|| configure_thread(Role::Learning)).join().unwrap();
        let parts: Vec<&str> = told.split("; ").collect();
        assert!(parts[0].contains("pinned"), "{told}");
        assert!(parts.contains(&"ordinary priority"), "{told}");
        assert!(told.contains("memory locked") || told.contains("memory not locked: "), "{told}");
    }
}
