//! Maps of before a jump of the localisation. A lattice cannot be turned, so the map stays as it is and the vehicle is
//! carried to where it stands on it.

use std::collections::VecDeque;

use crate::Jump;

/// Jumps that are remembered: more than fall into the age of any map that is driven on.
const JUMPS_KEPT: usize = 64;

/// The jumps of late.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    jumps: VecDeque<(u64, Jump)>,
}

impl Default for Frame {
    /// With room for all jumps that are ever kept: a jump in the control cycle takes no memory.
    fn default() -> Self {
        Self { jumps: VecDeque::with_capacity(JUMPS_KEPT) }
    }
}

impl Frame {
    /// Notes a jump that the odometry of this time showed.
    pub fn note(&mut self, at_ns: u64, jump: &Jump) {
        if self.jumps.len() == JUMPS_KEPT {
            self.jumps.pop_front();
        }
        self.jumps.push_back((at_ns, *jump));
    }

    /// Forgets all: the clock was set, and no map is of a known time any more.
    pub fn forget(&mut self) {
        self.jumps.clear();
    }

    /// How the frame has moved since this time; `None` when it has not.
    pub fn since(&self, at_ns: u64) -> Option<Jump> {
        self.between(at_ns, u64::MAX)
    }

    /// How a frame of one time lies in that of another; `None` where both are the same.
    pub fn shift(&self, from_ns: u64, to_ns: u64) -> Option<Jump> {
        if to_ns < from_ns {
            return self.between(to_ns, from_ns).map(|jump| jump.inverse());
        }
        self.between(from_ns, to_ns)
    }

    fn between(&self, from_ns: u64, to_ns: u64) -> Option<Jump> {
        let within = self.jumps.iter().filter(|(at_ns, _)| *at_ns > from_ns && *at_ns <= to_ns);
        within.map(|(_, jump)| *jump).reduce(|all, next| all.then(&next))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_has_moved_by_all_jumps_after_the_time_and_by_no_others() {
        let mut frame = Frame::default();
        let first = Jump { step_m: [3.1, -1.4, 0.2], yaw_rad: 0.3 };
        let second = Jump { step_m: [-0.5, 0.0, 0.0], yaw_rad: -0.1 };
        frame.note(100, &first);
        frame.note(200, &second);
        assert_eq!(frame.since(99), Some(first.then(&second)), "before both");
        assert_eq!(frame.since(100), Some(second), "in the frame of the first");
        assert_eq!(frame.since(200), None, "in the frame of now");
        assert_eq!(frame.shift(99, 100), Some(first));
        assert_eq!(frame.shift(100, 250), Some(second));
        assert_eq!(frame.shift(250, 99), Some(first.then(&second).inverse()), "and back");
        assert_eq!(frame.shift(100, 199), None);
        frame.forget();
        assert_eq!(frame.since(0), None);
    }

    #[test]
    fn jumps_without_end_take_no_memory() {
        let mut frame = Frame::default();
        let capacity = frame.jumps.capacity();
        (0..1000).for_each(|at_ns| frame.note(at_ns, &Jump { step_m: [1.0, 0.0, 0.0], yaw_rad: 0.0 }));
        assert_eq!(frame.jumps.capacity(), capacity);
        assert_eq!(frame.since(989), Some(Jump { step_m: [10.0, 0.0, 0.0], yaw_rad: 0.0 }));
    }
}
