//! Maps made again from scans, in the order in which they were made, and held against their hashes.

use std::collections::BTreeMap;
use std::ops::Bound;
use std::sync::Arc;

use navigator::{Assessor, Belief, Destination, NavigatorError};
use traversability::CvarLevel;

use super::records::{Key, Records};
use super::survey::{Localisation, Survey};
use super::{Knowledge, ReplayError};
use crate::mapping::{LEARNED, PHYSICS};
use crate::risk_maker::RiskMaker;
use crate::setup::MachineSetup;
use bus::message::{DecisionRecord, RiskHeader, SurfaceHeader};
use bus::payload::{cell_numbers, content_hash};

/// Risk maps of a source that are kept: control uses the newest, or the one before.
const KEPT: usize = 4;

/// A risk map that could not be made again.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Unmade {
    /// What is missing or differs.
    pub what: String,
}

/// A risk map that was made again.
pub(super) struct Made {
    pub header: RiskHeader,
    pub payload: Vec<[f32; 4]>,
}

/// Makes maps on demand.
pub(super) struct Maps<'a> {
    records: &'a Records,
    machine: &'a MachineSetup,
    survey: Option<(u64, Survey)>,
    localisation: Localisation,
    surface_at: Option<Key>,
    remade: [RemadeRiskMaps<'a>; 2],
    missing: Vec<String>,
    n_surfaces: u64,
}

/// One source of risk maps.
struct RemadeRiskMaps<'a> {
    headers: &'a BTreeMap<Key, RiskHeader>,
    knowledge: Knowledge,
    number: u64,
    level: CvarLevel,
    maker: Option<(u64, RiskMaker)>,
    stuck_at: Option<Key>,
    made: BTreeMap<Key, Arc<Result<Made, Unmade>>>,
    n_made: u64,
}

impl<'a> Maps<'a> {
    pub fn new(
        records: &'a Records,
        machine: &'a MachineSetup,
        knowledge: &Knowledge,
        level: CvarLevel,
    ) -> Result<Self, ReplayError> {
        let remade = |place: usize, belief: &Belief, checkpoint: u64, number: u64| RemadeRiskMaps {
            headers: &records.risks[place],
            knowledge: Knowledge { belief: belief.clone(), checkpoint, corrector: None },
            number,
            level,
            maker: None,
            stuck_at: None,
            made: BTreeMap::new(),
            n_made: 0,
        };
        Ok(Self {
            records,
            machine,
            survey: None,
            localisation: Localisation::default(),
            surface_at: None,
            remade: [
                remade(0, &knowledge.belief, knowledge.checkpoint, LEARNED),
                remade(1, &Belief::Physics, 0, PHYSICS),
            ],
            missing: Vec::new(),
            n_surfaces: 0,
        })
    }

    /// Maps of the ground and risk maps made again with the recorded hash.
    pub fn n_made(&self) -> (u64, u64) {
        (self.n_surfaces, self.remade.iter().map(|remade| remade.n_made).sum())
    }

    /// Makes the maps that no decision asked for, too; returns what is missing, and what became of the localisation.
    pub fn finish(&mut self) -> Result<(Vec<String>, Localisation), ReplayError> {
        while self.step()? {}
        Ok((std::mem::take(&mut self.missing), std::mem::take(&mut self.localisation)))
    }

    /// The risk map that a decision was made on.
    pub fn risk(
        &mut self,
        decision: &DecisionRecord,
    ) -> Result<Result<Arc<Result<Made, Unmade>>, Unmade>, ReplayError> {
        let place = usize::from(decision.map_source == PHYSICS);
        let key = Key::from(decision.risk);
        loop {
            if let Some(made) = self.remade[place].made.get(&key) {
                return Ok(Ok(Arc::clone(made)));
            }
            let Some(header) = self.remade[place].headers.get(&key) else {
                return Ok(Err(Unmade { what: format!("risk map {}", key.sequence) }));
            };
            let wanted = Key::from(header.surface);
            if self.surface_at.is_some_and(|at| at >= wanted) || !self.step()? {
                return Ok(Err(Unmade { what: format!("map of the ground {}", wanted.sequence) }));
            }
        }
    }

    /// The next map of the ground, and every risk map that was made of it; false at the end.
    fn step(&mut self) -> Result<bool, ReplayError> {
        let after = self.surface_at;
        let records = self.records;
        let later = (after.map_or(Bound::Unbounded, Bound::Excluded), Bound::Unbounded);
        let Some((&key, header)) = records.surfaces.range(later).next() else { return Ok(false) };
        if let Some(at) = after.filter(|at| at.epoch_ns == key.epoch_ns && at.sequence + 1 < key.sequence) {
            self.missing.push(format!("maps of the ground {} to {}", at.sequence + 1, key.sequence - 1));
        }
        self.surface_at = Some(key);
        let made = self.survey(key, header)?;
        for remade in &mut self.remade {
            remade.follow(header, &made, records, self.machine)?;
        }
        Ok(true)
    }

    fn survey(
        &mut self,
        key: Key,
        header: &SurfaceHeader,
    ) -> Result<Result<Vec<[f32; 8]>, Unmade>, ReplayError> {
        if self.survey.as_ref().is_none_or(|(epoch_ns, _)| *epoch_ns != key.epoch_ns) {
            self.survey = Some((key.epoch_ns, Survey::new(self.machine)?));
        }
        let Some((_, survey)) = &mut self.survey else { return Ok(Err(Unmade { what: String::new() })) };
        if let Err(what) = survey.follow(header, self.records, &mut self.localisation)? {
            self.missing.push(what.clone());
            return Ok(Err(Unmade { what }));
        }
        let cells: Vec<[f32; 8]> = survey.surveyor().surface().values().iter().map(cell_numbers).collect();
        if content_hash(&cells) != header.content_hash {
            return Ok(Err(Unmade { what: format!("map of the ground {} differs", key.sequence) }));
        }
        self.n_surfaces += 1;
        Ok(Ok(cells))
    }
}

impl RemadeRiskMaps<'_> {
    /// Makes the risk maps that were made of this map of the ground.
    fn follow(
        &mut self,
        surface: &SurfaceHeader,
        cells: &Result<Vec<[f32; 8]>, Unmade>,
        records: &Records,
        machine: &MachineSetup,
    ) -> Result<(), NavigatorError> {
        let source = surface.stamp.source();
        if let Some((_, maker)) = &mut self.maker {
            maker.hear_surface(surface);
        }
        let of_this: Vec<(Key, RiskHeader)> = self
            .headers
            .iter()
            .filter(|(_, header)| header.surface == source)
            .map(|(key, header)| (*key, *header))
            .collect();
        for (key, header) in of_this {
            let made = match cells {
                Err(unmade) => Err(unmade.clone()),
                Ok(cells) => self.make(key, &header, surface, cells, (records, machine))?,
            };
            self.n_made += u64::from(made.is_ok());
            self.made.insert(key, Arc::new(made));
            while self.made.len() > KEPT {
                self.made.pop_first();
            }
        }
        Ok(())
    }

    fn make(
        &mut self,
        key: Key,
        header: &RiskHeader,
        surface: &SurfaceHeader,
        cells: &[[f32; 8]],
        (records, machine): (&Records, &MachineSetup),
    ) -> Result<Result<Made, Unmade>, NavigatorError> {
        let is_new = self.maker.as_ref().is_none_or(|(epoch_ns, _)| *epoch_ns != key.epoch_ns);
        let is_by_others =
            self.maker.as_ref().is_none_or(|(_, maker)| maker.checkpoint() != header.checkpoint);
        if is_new || is_by_others {
            let MachineSetup { vehicle, model, config } = machine;
            let Some(belief) = self.knowledge.of(header.checkpoint, records) else {
                return Ok(Err(Unmade { what: format!("networks {:016x}", header.checkpoint) }));
            };
            let assessor = Assessor::new(vehicle, &model.limits, config, &belief, self.level)?;
            match &mut self.maker {
                Some((_, maker)) if !is_new => maker.judge_by(assessor, header.checkpoint)?,
                _ => {
                    let maker = RiskMaker::new(assessor, self.number, header.checkpoint);
                    self.maker = Some((key.epoch_ns, maker));
                }
            }
        }
        let Some((_, maker)) = &mut self.maker else { return Ok(Err(Unmade { what: String::new() })) };
        maker.set_destination(Destination { goal_m: header.goal_m, tolerance_m: header.tolerance_m });
        // As it was judged for; a number that is no share makes another map than was recorded.
        CvarLevel::new(header.alpha).map_or(Ok(()), |level| maker.judge_at(level))?;
        let until = Key::from(header.stuck);
        for (at, (stamp, stuck)) in records.stuck.range(..=until) {
            if self.stuck_at.is_none_or(|done| *at > done) && at.sequence > 0 {
                maker.note_stuck(stamp, stuck);
                self.stuck_at = Some(*at);
            }
        }
        let differs = || Unmade { what: format!("risk map {} differs", key.sequence) };
        if maker.update(surface, cells)?.is_err() {
            return Ok(Err(differs()));
        }
        let (Some(n), Some(writer)) = (maker.n_elements(), maker.writer()) else { return Ok(Err(differs())) };
        let mut payload: Vec<[f32; 4]> = (0..n).map(writer).collect();
        let made = maker.finish(&mut payload)?;
        if made.content_hash != header.content_hash {
            return Ok(Err(differs()));
        }
        Ok(Ok(Made { header: *header, payload }))
    }
}
