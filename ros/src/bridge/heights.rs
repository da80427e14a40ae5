//! Heights of the ground for as long as a risk map may be judged on them.

use std::collections::VecDeque;

use bus::channel::{Bus, ChannelError, Inlet, SURFACE};
use bus::message::{Source, SurfaceHeader};
use terrain::GridMap;

/// Maps of the ground that are kept: more than come while one is judged.
const KEPT: usize = 4;
/// Where a cell's height stands among its numbers, and how it came to be known: 0 = not at all.
const HEIGHT: usize = 0;
const KNOWLEDGE: usize = 7;

/// The maps of the ground that came last.
pub(super) struct Heights {
    surfaces: Inlet<SurfaceHeader, [f32; 8]>,
    kept: VecDeque<(Source, GridMap<Option<f32>>)>,
}

impl Heights {
    pub(super) fn new(bus: &Bus) -> Result<Self, ChannelError> {
        Ok(Self { surfaces: bus.inlet(&SURFACE)?, kept: VecDeque::with_capacity(KEPT + 1) })
    }

    /// Takes over what has come.
    pub(super) fn hear(&mut self) {
        let Self { surfaces, kept } = self;
        surfaces.poll(|header, cells| {
            let height_m = |cell: &[f32; 8]| (cell[KNOWLEDGE] > 0.0).then_some(cell[HEIGHT]);
            let heights_m = cells.iter().map(height_m).collect();
            let geometry = header.grid.geometry();
            if let Some(map) = geometry.and_then(|geometry| GridMap::from_values(geometry, heights_m)) {
                let source = Source { epoch_ns: header.stamp.epoch_ns, sequence: header.stamp.sequence };
                kept.push_back((source, map));
            }
            if kept.len() > KEPT {
                kept.pop_front();
            }
        });
    }

    /// Heights of this map of the ground [m], if it is still known and has cells of this size.
    pub(super) fn of(&self, surface: &Source, resolution_m: f64) -> Option<&GridMap<Option<f32>>> {
        let is_same = |kept: &Source| (kept.epoch_ns, kept.sequence) == (surface.epoch_ns, surface.sequence);
        let (_, map) = self.kept.iter().find(|(source, _)| is_same(source))?;
        (map.geometry().resolution_m == resolution_m).then_some(map)
    }
}
