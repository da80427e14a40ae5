//! One life of mapping, made again: the recorded odometry is shown to a surveyor in its order, and the jumps and places
//! that come of it are held against those that the maps tell of.

use std::ops::Bound;

use bicycle::{Odometry, SensorModel};
use navigator::{Jump, NavigatorError, Surface, Surveyor, Whereabouts};

use super::difference;
use super::records::{Key, Records};
use crate::convert::{jump_of, odometry_message, surface_record, track_record};
use crate::intake::hash_of;
use crate::mapping::JUMPED;
use crate::setup::MachineSetup;
use bus::message::{OdometryRecord, Stamp, SurfaceHeader};
use terrain::Mount;

/// Messages of what moves among which that of a scan is looked for: more are lost than anybody loses.
const TRACKS_LOOKED_AT: usize = 16;

/// What became of the localisation that maps of the ground tell of.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Localisation {
    /// Maps of which it was made out again to the same bits.
    pub n_verified: u64,
    /// Maps of which it could not be made out again.
    pub n_unverified: u64,
    /// Why it could not, each reason once, with the first of the maps.
    pub unverified: Vec<String>,
    /// Where it is another than the odometry shows.
    pub contradictions: Vec<String>,
}

/// A life of mapping.
pub(super) struct Survey {
    surveyor: Surveyor,
    mounts: Vec<Mount>,
    last_map: u64,
    last_odometry: Option<Key>,
    last_tracks: Option<Key>,
    trust: Trust,
    /// Whether every map since the beginning was there, and so every jump.
    is_shift_known: bool,
    /// Whether every map since the beginning was made again as it was, and so every track.
    are_tracks_known: bool,
}

/// Whether the surveyor knows of the odometry what mapping knew.
#[derive(Clone, Copy, Debug)]
enum Trust {
    /// From this time on [ns].
    From(u64),
    /// Something is missing. The guard is again as it was once two samples that both were shown differ in their place, and
    /// a scan of after these lies between samples of after them.
    Lost { before: Option<OdometryRecord> },
}

/// Why the odometry of a map is not what mapping took in.
enum Doubt {
    /// It was not recorded.
    Missing(String),
    /// It was, and is another.
    Differs(String),
}

/// Odometry in the order in which it was taken in.
type Samples<'a> = Vec<(&'a Key, &'a (Stamp, OdometryRecord))>;

/// Where the vehicle was, and the jump that was followed there.
type Place = (Odometry, Jump);

impl Survey {
    pub fn new(machine: &MachineSetup) -> Result<Self, NavigatorError> {
        let MachineSetup { vehicle, model, config } = machine;
        let surveyor = Surveyor::new(vehicle, config.elevation, config.guard, Surface::Sensed)?
            .with_sensors(SensorModel::of(&model.effects))
            .with_moving(config.moving.as_ref())?;
        Ok(Self {
            surveyor,
            mounts: config.sensors.clone(),
            last_map: 0,
            last_odometry: None,
            last_tracks: None,
            trust: Trust::From(0),
            is_shift_known: true,
            are_tracks_known: true,
        })
    }

    /// The ground as of the last map that was followed.
    pub fn surveyor(&self) -> &Surveyor {
        &self.surveyor
    }

    /// Makes the next map again; says which scan is missing for it. Jump and place are those that the odometry shows, or
    /// where that is not known those that the map tells of.
    pub fn follow(
        &mut self,
        header: &SurfaceHeader,
        records: &Records,
        found: &mut Localisation,
    ) -> Result<Result<(), String>, NavigatorError> {
        let known_jump = self.take_in(header, records, found);
        let told = header.odometry.odometry(header.odometry_at_ns);
        if header.event == JUMPED {
            let last = records.odometry.get(&Key::from(header.last_odometry));
            let place = known_jump.zip(last).map(|(jump, (stamp, record))| {
                (record.odometry(stamp.valid_at_ns), jump.unwrap_or(Jump::NONE))
            });
            let (there, jump) = place.unwrap_or((told, jump_of(header)));
            self.surveyor.follow_jump(&there, &jump)?;
            self.judge(header, place.ok_or(None), found);
            return Ok(Ok(()));
        }
        let Some((scan, points)) = records.scans.get(&Key::from(header.scan)) else {
            self.judge(header, Err(None), found);
            return Ok(Err(format!("scan {}", header.scan.sequence)));
        };
        let Some(scan) = scan.scan(points, &self.mounts) else {
            self.judge(header, Err(None), found);
            return Ok(Err(format!("scan {} of unknown sensor {}", header.scan.sequence, scan.sensor)));
        };
        let place = self.place(scan.valid_at_ns);
        let there = place.as_ref().map_or(told, |(there, _)| *there);
        self.judge(header, place, found);
        self.surveyor.fuse(&there, &scan)?;
        self.judge_tracks(header, records, found);
        Ok(Ok(()))
    }

    /// Shows the surveyor what mapping took in since the map before; returns the jump that the last of it shows, `None`
    /// when that is not known.
    fn take_in(
        &mut self,
        header: &SurfaceHeader,
        records: &Records,
        found: &mut Localisation,
    ) -> Option<Option<Jump>> {
        let number = header.stamp.sequence;
        let (samples, doubt) = self.samples(header, records);
        self.is_shift_known &= self.is_next(header);
        (self.last_map, self.last_odometry) = (number, Some(Key::from(header.last_odometry)));
        match &doubt {
            None => {}
            Some(Doubt::Missing(what)) => {
                found.unverified.push(format!("map of the ground {number}: {what}"));
            }
            Some(Doubt::Differs(how)) => {
                found.contradictions.push(format!("map of the ground {number}: {how}"));
            }
        }
        let is_known = |survey: &Self| doubt.is_none() && matches!(survey.trust, Trust::From(_));
        let mut last = is_known(self).then_some(None);
        for (place, (key, (stamp, record))) in samples.iter().enumerate() {
            let was_known = is_known(self);
            let jump = self.show(stamp, record);
            last = was_known.then_some(jump);
            let has_map = header.event == JUMPED && place + 1 == samples.len();
            if was_known && jump.is_some() && !has_map {
                found.contradictions.push(format!(
                    "map of the ground {number}: expected one before it, of the jump that odometry {} shows, found none",
                    key.sequence
                ));
            }
        }
        if doubt.is_some() {
            // Of these samples, too, mapping may have seen others.
            self.trust = Trust::Lost { before: None };
        }
        last
    }

    fn show(&mut self, stamp: &Stamp, record: &OdometryRecord) -> Option<Jump> {
        let jump = self.surveyor.take(&odometry_message(stamp, record)).ok()?;
        if let Trust::Lost { before } = self.trust {
            let has_moved = before.is_some_and(|before| !is_same_place(&before, record));
            self.trust = if has_moved {
                Trust::From(stamp.valid_at_ns)
            } else {
                Trust::Lost { before: Some(*record) }
            };
        }
        jump
    }

    /// Where a scan was taken: as the odometry shows, or why it is not known; `None` for odometry that is missing.
    fn place(&mut self, at_ns: u64) -> Result<Place, Option<&'static str>> {
        let Trust::From(known_ns) = self.trust else { return Err(None) };
        if at_ns < known_ns {
            return Err(None);
        }
        match self.surveyor.place(at_ns) {
            Ok(Whereabouts::Between(there) | Whereabouts::Ahead(Some(there))) => Ok((there, Jump::NONE)),
            _ => {
                Err(Some("expected none of a scan from a time at which nobody knows where it was, found one"))
            }
        }
    }

    /// Holds what a map tells against what the odometry shows. Once that is not known to be the same, nothing is known of
    /// what moves either, which is tracked over all scans.
    fn judge(
        &mut self,
        header: &SurfaceHeader,
        place: Result<Place, Option<&'static str>>,
        found: &mut Localisation,
    ) {
        let n_verified = found.n_verified;
        self.compare(header, place, found);
        self.are_tracks_known &= self.is_shift_known && found.n_verified > n_verified;
    }

    fn compare(
        &mut self,
        header: &SurfaceHeader,
        place: Result<Place, Option<&'static str>>,
        found: &mut Localisation,
    ) {
        let (there, jump) = place.unwrap_or_default();
        let told = self.surveyor.header(&there, (header.event == JUMPED).then_some(jump));
        let mut expected = surface_record(&told, self.surveyor.surface().geometry());
        if !self.is_shift_known {
            (expected.shift_m, expected.shift_yaw_rad) = (header.shift_m, header.shift_yaw_rad);
        }
        let difference = match place {
            Err(None) => {
                found.n_unverified += 1;
                return;
            }
            Err(Some(why)) => Some(why.to_owned()),
            Ok(_) => difference::first(&expected, header),
        };
        let Some(difference) = difference else {
            found.n_verified += 1;
            return;
        };
        let of = match header.event {
            JUMPED => format!("odometry {}", header.last_odometry.sequence),
            _ => format!("scan {}", header.scan.sequence),
        };
        found
            .contradictions
            .push(format!("map of the ground {}, of {of}: {difference}", header.stamp.sequence));
    }

    /// Holds what mapping said of what moves against what the same scans show, as long as all of them were there.
    fn judge_tracks(&mut self, header: &SurfaceHeader, records: &Records, found: &mut Localisation) {
        let Some(tracker) = self.surveyor.tracker().filter(|_| self.are_tracks_known) else { return };
        let after = self.last_tracks.map_or(Bound::Unbounded, Bound::Excluded);
        let mut later = records.tracks.range((after, Bound::Unbounded)).take(TRACKS_LOOKED_AT);
        let Some((key, (_, told))) = later.find(|(_, (tracks, _))| tracks.scan == header.scan) else {
            return;
        };
        self.last_tracks = Some(*key);
        if !tracker.moving().iter().map(track_record).eq(told.iter().copied()) {
            found.contradictions.push(format!(
                "tracks of scan {}: expected those that the scans show, found others",
                header.scan.sequence
            ));
        }
    }

    /// What mapping took in since the map before, as far as it was recorded, and what is wrong with that.
    fn samples<'a>(&self, header: &SurfaceHeader, records: &'a Records) -> (Samples<'a>, Option<Doubt>) {
        let last = Key::from(header.last_odometry);
        let n = usize::try_from(header.n_odometry).unwrap_or(usize::MAX);
        let mut newest: Samples<'a> = records.odometry.range(..=last).rev().take(n).collect();
        newest.reverse();
        let is_later = match newest.first() {
            Some((first, _)) => self.last_odometry.is_none_or(|before| **first > before),
            None => self.last_odometry.is_none_or(|before| last == before),
        };
        let is_whole = newest.len() == n
            && is_later
            && hash_of(newest.iter().map(|(_, sample)| *sample)) == header.odometry_hash;
        if self.is_next(header) && is_whole {
            return (newest, None);
        }
        let since: Samples<'a> = match self.last_odometry {
            None => newest,
            Some(before) if before > last => Vec::new(),
            Some(before) => {
                records.odometry.range((Bound::Excluded(before), Bound::Included(last))).collect()
            }
        };
        let doubt = self.doubt(header, &since);
        (since, Some(doubt))
    }

    fn is_next(&self, header: &SurfaceHeader) -> bool {
        self.last_map.checked_add(1) == Some(header.stamp.sequence)
    }

    fn doubt(&self, header: &SurfaceHeader, since: &Samples<'_>) -> Doubt {
        let (last, n) = (Key::from(header.last_odometry), header.n_odometry);
        if !self.is_next(header) {
            let before = header.stamp.sequence.saturating_sub(1);
            return Doubt::Missing(told("maps of the ground", self.last_map.saturating_add(1), before));
        }
        let Some(before) = self.last_odometry.filter(|before| before.epoch_ns == last.epoch_ns) else {
            return Doubt::Missing(format!(
                "which {n} odometry messages up to {} it was made with",
                last.sequence
            ));
        };
        let Some(n_sent) = last.sequence.checked_sub(before.sequence).filter(|n_sent| *n_sent >= n) else {
            return Doubt::Differs(format!(
                "expected at most the odometry after {}, found {n} up to {}",
                before.sequence, last.sequence
            ));
        };
        let first = before.sequence.saturating_add(1);
        let mut next = first;
        for (key, _) in since {
            if key.sequence != next {
                return Doubt::Missing(told("odometry", next, key.sequence - 1));
            }
            next = key.sequence.saturating_add(1);
        }
        if next <= last.sequence {
            return Doubt::Missing(told("odometry", next, last.sequence));
        }
        let all = told("odometry", first, last.sequence);
        if n < n_sent {
            return Doubt::Missing(format!("which {n} of {all} it was made with"));
        }
        let (expected, found) = (header.odometry_hash, hash_of(since.iter().map(|(_, sample)| *sample)));
        Doubt::Differs(format!(
            "{all}: expected what mapping took in, of hash {expected:016x}, found {found:016x}"
        ))
    }
}

fn told(what: &str, first: u64, last: u64) -> String {
    if first == last { format!("{what} {first}") } else { format!("{what} {first} to {last}") }
}

/// Whether the localisation says the same of both.
fn is_same_place(one: &OdometryRecord, other: &OdometryRecord) -> bool {
    let place = |record: &OdometryRecord| {
        (record.position_m, record.attitude_rad, record.velocity_mps, record.yaw_rate_radps)
    };
    place(one) == place(other)
}
