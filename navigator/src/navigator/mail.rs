//! Messages that wait for the part that they are for.

use std::collections::VecDeque;

use bicycle::ImuSample;

use crate::{
    MessageId, MissionMessage, OdometryMessage, ScanMessage, StuckMessage, SurfaceHeader, TracksMessage,
};

/// Odometry, and messages of the inertial measurement unit, that wait for a part at the most: as many as on the channel of processes; of more, the oldest is dropped.
const ODOMETRY_MAX: usize = 32;
/// The same of scans, and of maps of the ground.
const SCANS_MAX: usize = 2;
const SURFACES_MAX: usize = 2;

/// What waits for an assessor.
#[derive(Debug, Default)]
pub(super) struct ToAssessor {
    pub missions: Vec<MissionMessage>,
    pub stuck: Vec<StuckMessage>,
}

/// All that waits.
#[derive(Debug)]
pub(super) struct Mail<C> {
    pub to_leader: VecDeque<OdometryMessage<C>>,
    pub to_surveyor: VecDeque<OdometryMessage<C>>,
    pub to_pilot: VecDeque<OdometryMessage<C>>,
    pub to_corrector: VecDeque<(MessageId, Vec<ImuSample>)>,
    pub scans: VecDeque<ScanMessage>,
    pub surfaces: VecDeque<SurfaceHeader>,
    pub learned: ToAssessor,
    /// `None` where nobody stands in.
    pub physics: Option<ToAssessor>,
    pub mission_to_pilot: Option<MissionMessage>,
    pub tracks_to_pilot: Option<TracksMessage>,
    /// A learned map has come that whoever stands in has not heard of.
    pub has_learned: bool,
}

impl<C> Default for Mail<C> {
    fn default() -> Self {
        let queue = || VecDeque::with_capacity(ODOMETRY_MAX);
        Self {
            to_leader: queue(),
            to_surveyor: queue(),
            to_pilot: queue(),
            to_corrector: VecDeque::with_capacity(ODOMETRY_MAX),
            scans: VecDeque::with_capacity(SCANS_MAX),
            surfaces: VecDeque::with_capacity(SURFACES_MAX),
            learned: ToAssessor::default(),
            physics: None,
            mission_to_pilot: None,
            tracks_to_pilot: None,
            has_learned: false,
        }
    }
}

impl<C: Copy> Mail<C> {
    pub fn odometry(&mut self, message: &OdometryMessage<C>) {
        for queue in [&mut self.to_leader, &mut self.to_surveyor, &mut self.to_pilot] {
            put(queue, *message, ODOMETRY_MAX);
        }
    }

    pub fn imu(&mut self, id: MessageId, samples: Vec<ImuSample>) {
        put(&mut self.to_corrector, (id, samples), ODOMETRY_MAX);
    }

    pub fn scan(&mut self, message: ScanMessage) {
        put(&mut self.scans, message, SCANS_MAX);
    }

    pub fn surface(&mut self, header: SurfaceHeader) {
        put(&mut self.surfaces, header, SURFACES_MAX);
    }

    pub fn mission(&mut self, message: &MissionMessage) {
        self.mission_to_pilot = Some(*message);
        self.assessors().for_each(|mail| mail.missions.push(*message));
    }

    pub fn stuck(&mut self, message: &StuckMessage) {
        self.assessors().for_each(|mail| mail.stuck.push(*message));
    }

    fn assessors(&mut self) -> impl Iterator<Item = &mut ToAssessor> {
        std::iter::once(&mut self.learned).chain(&mut self.physics)
    }

    pub fn has_stuck(&self) -> bool {
        !self.learned.stuck.is_empty()
    }
}

fn put<T>(queue: &mut VecDeque<T>, message: T, most: usize) {
    if queue.len() == most {
        queue.pop_front();
    }
    queue.push_back(message);
}
