//! As regular as the system permits: cores of its own, a fixed priority, memory that stays where it is.

use rustix::mm::{MlockAllFlags, mlockall};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
use thread_priority::{
    Error, RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

use bus::status::Role;
use std::path::Path;

/// Where the system says what each of its cores can do.
const CORES: &str = "/sys/devices/system/cpu";

/// Sets cores, priority and memory of this thread, and of those that it will start, as a role needs them; says of each what
/// was done, or what was not permitted.
///
/// Where cores are of several sizes, as the system states them, control has the last of the largest for itself, those that
/// the vehicle waits for share the other large ones, and learning and the recorder all the rest; where they are alike,
/// control has the last and the others share the rest. SCHED_FIFO goes to those that the vehicle waits for. To be called
/// before the process starts any other thread.
pub fn granted(role: Role) -> [Result<String, String>; 3] {
    [pinned(role), scheduled(role), locked()]
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

fn pinned(role: Role) -> Result<String, String> {
    let refused = |error| format!("not pinned: {error}");
    let allowed = sched_getaffinity(None).map_err(refused)?;
    let cores: Vec<usize> = (0..CpuSet::MAX_CPU).filter(|&core| allowed.is_set(core)).collect();
    let large = largest(&cores, Path::new(CORES));
    let own = own_cores(role, &cores, &large).ok_or("not pinned: there is one core only")?;
    let mut wanted = CpuSet::new();
    own.iter().for_each(|&core| wanted.set(core));
    sched_setaffinity(None, &wanted).map_err(refused)?;
    Ok(format!("pinned to core {}", own.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")))
}

/// Those of the cores whose stated capacity is the largest; all of them where nothing is stated of one.
fn largest(cores: &[usize], stated: &Path) -> Vec<usize> {
    let capacity = |core: &usize| -> Option<u32> {
        let text = std::fs::read_to_string(stated.join(format!("cpu{core}/cpu_capacity"))).ok()?;
        text.trim().parse().ok()
    };
    let Some(capacities) = cores.iter().map(capacity).collect::<Option<Vec<u32>>>() else {
        return cores.to_vec();
    };
    let most = capacities.iter().max();
    cores.iter().zip(&capacities).filter(|(_, of)| Some(*of) == most).map(|(core, _)| *core).collect()
}

/// The cores of a role among those there are, of which some are large.
fn own_cores(role: Role, cores: &[usize], large: &[usize]) -> Option<Vec<usize>> {
    let of_control = *large.last().filter(|_| cores.len() > 1)?;
    let shared =
        |among: &[usize]| among.iter().copied().filter(|&core| core != of_control).collect::<Vec<_>>();
    match priority(role) {
        _ if role == Role::Control => Some(vec![of_control]),
        Some(_) if large.len() > 1 => Some(shared(large)),
        _ => Some(shared(cores)),
    }
}

fn scheduled(role: Role) -> Result<String, String> {
    let Some(level) = priority(role) else { return Ok("ordinary priority".to_owned()) };
    let value = ThreadPriorityValue::try_from(level).map_err(|_| "no SCHED_FIFO")?;
    let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    match set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(value), fifo) {
        Ok(()) => Ok(format!("SCHED_FIFO {level}")),
        Err(Error::OS(code)) => {
            let error = std::io::Error::from_raw_os_error(code);
            Err(format!("no SCHED_FIFO: {error}; it takes CAP_SYS_NICE or a limit `rtprio` of {level}"))
        }
        Err(error) => Err(format!("no SCHED_FIFO: {error:?}")),
    }
}

fn locked() -> Result<String, String> {
    // Locked once it is used: what channels keep in reserve is not fetched for that.
    match mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE | MlockAllFlags::ONFAULT) {
        Ok(()) => Ok("memory locked".to_owned()),
        Err(error) => {
            Err(format!("memory not locked: {error}; it takes CAP_IPC_LOCK or a higher limit `memlock`"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_has_a_core_of_its_own_where_there_are_two() {
        for cores in [vec![0, 1], vec![2, 5, 7]] {
            let control = own_cores(Role::Control, &cores, &cores).unwrap();
            for other in [Role::Learning, Role::Mapping] {
                assert_eq!([own_cores(other, &cores, &cores).unwrap(), control.clone()].concat(), cores);
            }
            assert_eq!(control.len(), 1);
        }
        assert_eq!(own_cores(Role::Control, &[3], &[3]), None);
        assert_eq!(own_cores(Role::Plant, &[], &[]), None);
    }

    #[test]
    fn who_the_vehicle_waits_for_has_the_large_cores() {
        let cores = [0, 1, 2, 3, 4, 5];
        let of = |role, large: &[usize]| own_cores(role, &cores, large).unwrap();
        assert_eq!([of(Role::Control, &[2, 3]), of(Role::Mapping, &[2, 3])], [[3], [2]]);
        assert_eq!(of(Role::Recorder, &[2, 3]), [0, 1, 2, 4, 5], "whatever is left");
        // One alone is control's.
        assert_eq!(of(Role::Control, &[4]), [4]);
        assert_eq!(of(Role::Mapping, &[4]), [0, 1, 2, 3, 5]);
    }

    #[test]
    fn the_largest_cores_are_those_of_which_the_most_is_stated() {
        let folder = tempfile::tempdir().unwrap();
        let state = |core: usize, capacity: &str| {
            let of_core = folder.path().join(format!("cpu{core}"));
            std::fs::create_dir_all(&of_core).unwrap();
            std::fs::write(of_core.join("cpu_capacity"), capacity).unwrap();
        };
        let large = |cores: &[usize]| largest(cores, folder.path());
        assert_eq!(large(&[0, 1]), [0, 1], "nothing is stated");
        for (core, capacity) in [(0, "414\n"), (1, "414\n"), (4, "1024\n"), (5, "1024\n")] {
            state(core, capacity);
        }
        assert_eq!(large(&[0, 1, 4, 5]), [4, 5]);
        assert_eq!(large(&[0, 1]), [0, 1], "the process may use no others");
        assert_eq!(large(&[0, 4, 7]), [0, 4, 7], "nothing is stated of the last");
        state(7, "much");
        assert_eq!(large(&[4, 0, 7]), [4, 0, 7]);
    }

    #[test]
    fn it_says_what_was_done_or_why_not() {
        // A thread of its own: it stays settled.
        let [cores, priority, memory] = std::thread::spawn(|| granted(Role::Learning))
            .join()
            .unwrap()
            .map(|told| told.unwrap_or_else(|why| why));
        assert!(cores.contains("pinned"), "{cores}");
        assert_eq!(priority, "ordinary priority");
        assert!(memory.contains("memory locked") || memory.contains("memory not locked: "), "{memory}");
    }
}
