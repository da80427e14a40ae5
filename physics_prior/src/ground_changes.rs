//! Which cells of the ground are no longer what they were when poses were judged by them.

use std::ops::Range;

use terrain::GridMap;

use crate::cell_set::{CellSet, CellSpan};
use crate::ground::Contact;
use crate::planes::Planes;

/// Everything that poses read of a cell, to the bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CellRead {
    /// What wheels stand on.
    pub contact: [u32; Contact::N_VALUES],
    /// What a belly may touch.
    pub bump: u32,
    /// What is counted under a footprint.
    pub counts: [u8; 3],
}

/// The cells whose change a pose feels.
#[derive(Clone, Debug)]
pub(crate) struct Felt {
    /// Under the wheels.
    pub wheels: Vec<CellSpan>,
    /// Under the belly.
    pub belly: Vec<CellSpan>,
    /// Under the footprint, wherever it turns within its yaw bin.
    pub footprint: Vec<CellSpan>,
}

impl Felt {
    /// Finds the cells in the layers of a window, for base cells like the given one.
    pub fn lay_on(&mut self, planes: &Planes, base: [i64; 2]) {
        for span in self.wheels.iter_mut().chain(&mut self.belly).chain(&mut self.footprint) {
            span.lay_on(planes, base);
        }
    }
}

/// What was read last, and where that differs from what was read before.
#[derive(Clone, Debug)]
pub(crate) struct GroundChanges {
    /// `None` where nothing was read yet.
    last: GridMap<Option<CellRead>>,
    contacts: CellSet,
    bumps: CellSet,
    counts: CellSet,
    marks: [Vec<bool>; 3],
}

impl GroundChanges {
    /// Nothing was read yet.
    pub fn new(planes: &Planes, felt: &[&Felt]) -> Self {
        let geometry = *planes.window();
        let set = |spans: fn(&Felt) -> &Vec<CellSpan>| {
            CellSet::new(*planes, felt.iter().flat_map(|felt| spans(felt)))
        };
        Self {
            last: GridMap::filled(geometry, None),
            contacts: set(|felt| &felt.wheels),
            bumps: set(|felt| &felt.belly),
            counts: set(|felt| &felt.footprint),
            marks: [(); 3].map(|()| vec![false; geometry.n_cells()]),
        }
    }

    /// Goes to another window: what was read keeps its cells.
    pub fn move_to(&mut self, planes: &Planes, felt: &[&Felt]) {
        let last = std::mem::replace(self, Self::new(planes, felt)).last;
        self.last = last.seen_from(planes.window(), &None);
    }

    /// Takes over what is read of some cells now; the others are what they were.
    pub fn note(&mut self, rows: Range<usize>, cols: Range<usize>, read: impl Fn(usize, usize) -> CellRead) {
        let n_cols = self.last.geometry().n_cols;
        self.marks.iter_mut().for_each(|marks| marks.fill(false));
        for row in rows {
            for col in cols.clone() {
                let index = row * n_cols + col;
                let now = read(row, col);
                let before = self.last.values_mut()[index].replace(now);
                self.marks[0][index] = before.is_none_or(|before| before.contact != now.contact);
                self.marks[1][index] = before.is_none_or(|before| before.bump != now.bump);
                self.marks[2][index] = before.is_none_or(|before| before.counts != now.counts);
            }
        }
        let sets = [&mut self.contacts, &mut self.bumps, &mut self.counts];
        sets.into_iter().zip(&mut self.marks).for_each(|(set, marks)| set.hold(marks));
    }

    /// All cells are what they were.
    pub fn note_none(&mut self) {
        [&mut self.contacts, &mut self.bumps, &mut self.counts].into_iter().for_each(CellSet::clear);
    }

    /// Bytes of what is kept of the cells.
    pub fn n_bytes(&self) -> usize {
        let sets = [&self.contacts, &self.bumps, &self.counts];
        size_of_val(self.last.values()) + sets.iter().map(|set| set.n_bytes()).sum::<usize>()
    }

    /// Of the poses with base cells at [`crate::ASKED`] positions of a layer from `first` on, those that feel a change.
    pub fn felt_by(&self, felt: &Felt, first: usize) -> u64 {
        self.contacts.meets(&felt.wheels, first)
            | self.bumps.meets(&felt.belly, first)
            | self.counts.meets(&felt.footprint, first)
    }
}
