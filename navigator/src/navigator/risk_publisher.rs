//! An assessor and the memory that its risk map lies in.

use std::sync::Arc;

use terrain::{GridGeometry, GridMap, SurfaceCell};
use traversability::{Risk, RiskMap, RiskMapView};

use super::EPOCH_NS;
use super::mail::ToAssessor;
use crate::{Assessor, MessageId, NavigatorError, RiskHeader, RiskMessage, SurfaceHeader};

pub(super) struct RiskPublisher {
    assessor: Assessor,
    map: Option<(RiskHeader, RiskMap)>,
}

impl RiskPublisher {
    pub fn new(assessor: Assessor) -> Self {
        Self { assessor, map: None }
    }

    /// Returns whether the vehicle got stuck somewhere.
    pub fn hear(&mut self, mail: &mut ToAssessor) -> Result<bool, NavigatorError> {
        let is_stuck = !mail.stuck.is_empty();
        mail.stuck.drain(..).for_each(|stuck| self.assessor.hear_stuck(&stuck));
        mail.missions.drain(..).try_for_each(|mission| self.assessor.hear_mission(&mission))?;
        Ok(is_stuck)
    }

    pub fn know_friction(&mut self, map: Arc<GridMap<f32>>) {
        self.assessor.know_friction(map);
    }

    pub fn hear_surface(&mut self, header: &SurfaceHeader) {
        self.assessor.hear_surface(header);
    }

    /// Judges a map of the ground; returns whether that made a risk map.
    pub fn judge(
        &mut self,
        header: &SurfaceHeader,
        surface: &GridMap<SurfaceCell>,
    ) -> Result<bool, NavigatorError> {
        if !self.assessor.has_goal() {
            return Ok(false);
        }
        self.assessor.judge(header, surface)?;
        self.publish()
    }

    /// Makes the risk map of what is known; returns whether anything is.
    pub fn publish(&mut self) -> Result<bool, NavigatorError> {
        let Some(known) = self.assessor.known() else { return Ok(false) };
        let (header, mut map) = self.map.take().map_or_else(
            || (None, RiskMap::constant(known.geometry, known.n_yaws, Risk::OUTSIDE)),
            |(header, map)| (Some(header), map),
        );
        take_over(&mut map, &known);
        map.fill(|risks, _| self.assessor.correct(risks));
        let Some(made) = self.assessor.finish(map.view())? else { return Ok(false) };
        let sequence = header.map_or(0, |header| header.id.sequence) + 1;
        self.map = Some((RiskHeader { id: MessageId { epoch_ns: EPOCH_NS, sequence }, ..made }, map));
        Ok(true)
    }

    pub fn message(&self) -> Option<RiskMessage<'_>> {
        let (header, map) = self.map.as_ref()?;
        Some(RiskMessage { header: *header, content: Some((map.view(), self.assessor.time_to_goal())) })
    }

    pub fn view(&self) -> Option<RiskMapView<'_>> {
        self.map.as_ref().map(|(_, map)| map.view())
    }
}

fn take_over(map: &mut RiskMap, known: &RiskMapView<'_>) {
    let GridGeometry { origin, .. } = known.geometry;
    map.place_at(origin);
    map.fill(|risks, ground| {
        risks.copy_from_slice(known.risks);
        ground.copy_from_slice(known.ground);
    });
}
