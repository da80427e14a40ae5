//! Sets of cells that are asked for many neighbouring poses at once.

use std::ops::Range;

use crate::planes::Planes;

/// Poses that a set answers for at a time.
pub const ASKED: usize = u64::BITS as usize;

/// A set of cells of a window.
#[derive(Clone, Debug)]
pub struct CellSet {
    planes: Planes,
    /// Level l, one bit at [`Planes::index`] of a cell: whether any of the 2^l cells from there eastward is in the set.
    levels: Vec<Vec<u64>>,
    is_empty: bool,
}

/// Adjacent cells of one row, as offsets from a base cell.
#[derive(Clone, Debug)]
pub struct CellSpan {
    /// Westmost cell: columns, rows.
    start: [i64; 2],
    n_cells: usize,
    /// 2 to the power of this: two stretches of so many cells cover the span.
    level: usize,
    /// [`Planes::delta`] of the first cells of the stretches.
    stretches: [isize; 2],
}

impl CellSpan {
    /// The least spans that hold all of these cells, one for each row that has any.
    pub fn of_rows(cells: impl IntoIterator<Item = [i64; 2]>) -> Vec<Self> {
        let mut rows = std::collections::BTreeMap::new();
        for [col, row] in cells {
            let extent = rows.entry(row).or_insert((col, col));
            *extent = (extent.0.min(col), extent.1.max(col));
        }
        let span = |(row, (west, east)): (i64, (i64, i64))| {
            let n_cells = (east - west + 1) as usize;
            Self { start: [west, row], n_cells, level: n_cells.ilog2() as usize, stretches: [0; 2] }
        };
        rows.into_iter().map(span).collect()
    }

    /// Finds its cells in the layers of a window, for base cells like the given one.
    pub fn lay_on(&mut self, planes: &Planes, base: [i64; 2]) {
        let [west, row] = self.start;
        let other = west + (self.n_cells - (1 << self.level)) as i64;
        self.stretches = [west, other].map(|col| planes.delta(base, [col, row]));
    }
}

impl CellSet {
    /// No cell of a window whose layers lie like this, to be asked for these spans and shorter ones.
    pub fn new<'a>(planes: Planes, spans: impl Iterator<Item = &'a CellSpan>) -> Self {
        let n_levels = spans.map(|span| span.level + 1).max().unwrap_or(1);
        // A question reads the word after the one that it begins in.
        let n_words = planes.layer_len().div_ceil(ASKED) + 2;
        Self { planes, levels: vec![vec![0; n_words]; n_levels], is_empty: true }
    }

    /// Bytes of its bits.
    pub fn n_bytes(&self) -> usize {
        self.levels.iter().map(|bits| size_of_val(&**bits)).sum()
    }

    /// Holds no cell from now on.
    pub fn clear(&mut self) {
        if !std::mem::replace(&mut self.is_empty, true) {
            self.levels.iter_mut().for_each(|bits| bits.fill(0));
        }
    }

    /// Holds the marked cells from now on, and no others; row-major over the window. The marks are used up.
    pub fn hold(&mut self, marks: &mut [bool]) {
        self.clear();
        self.is_empty = !marks.contains(&true);
        if self.is_empty {
            return;
        }
        let terrain::GridGeometry { origin: [west, south], n_cols, .. } = *self.planes.window();
        for (row, marks) in marks.chunks_exact_mut(n_cols).enumerate() {
            if !marks.contains(&true) {
                continue;
            }
            for (level, bits) in self.levels.iter_mut().enumerate() {
                let reach = if level == 0 { 0 } else { 1 << (level - 1) };
                for col in 0..n_cols {
                    // The window's border ends the stretch.
                    marks[col] |= marks[(col + reach).min(n_cols - 1)];
                    if marks[col] {
                        let index = self.planes.index([west + col as i64, south + row as i64]);
                        bits[index / ASKED] |= 1 << (index % ASKED);
                    }
                }
            }
        }
    }

    /// For base cells at [`ASKED`] positions of a layer from `first` on, the first one's answer in the lowest bit: whether
    /// any cell of any of the spans is in the set.
    pub fn meets(&self, spans: &[CellSpan], first: usize) -> u64 {
        if self.is_empty {
            return 0;
        }
        let mut meets = 0;
        for span in spans {
            let bits = &self.levels[span.level];
            for delta in span.stretches {
                let at = first.wrapping_add_signed(delta);
                let (word, shift) = (at / ASKED, at % ASKED);
                meets |= (bits[word] >> shift) | ((bits[word + 1] << 1) << (ASKED - 1 - shift));
            }
        }
        meets
    }
}

/// Poses between two that are to be judged, up to which it costs less to judge them too than to begin anew.
const GAP_MAX: u32 = 4;

/// Stretches of poses that hold all those whose bit is set.
pub fn stretches(mut asked: u64) -> impl Iterator<Item = Range<usize>> {
    std::iter::from_fn(move || {
        if asked == 0 {
            return None;
        }
        let first = asked.trailing_zeros();
        let mut end = first;
        loop {
            end += (!(asked >> end)).trailing_zeros();
            let rest = asked.checked_shr(end).unwrap_or(0);
            asked = rest.checked_shl(end).unwrap_or(0);
            match rest.trailing_zeros() {
                gap if rest != 0 && gap <= GAP_MAX => end += gap,
                _ => return Some(first as usize..end as usize),
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use terrain::GridGeometry;

    use super::*;
    use crate::ResolutionRatio;

    const WINDOW: GridGeometry = GridGeometry { resolution_m: 0.1, origin: [-7, 5], n_rows: 9, n_cols: 83 };

    proptest! {
        #[test]
        fn stretches_hold_what_is_set_and_end_where_nothing_is(asked in prop_oneof![any::<u64>(), Just(0), Just(u64::MAX)]) {
            let is_set = |lane: usize| asked >> lane & 1 == 1;
            let mut end = 0;
            for stretch in stretches(asked) {
                prop_assert!(is_set(stretch.start) && is_set(stretch.end - 1));
                prop_assert!((end..stretch.start).all(|lane| !is_set(lane)));
                prop_assert!(end == 0 || stretch.start - end > GAP_MAX as usize, "they go together");
                end = stretch.end;
            }
            prop_assert!((end..ASKED).all(|lane| !is_set(lane)));
        }

        #[test]
        fn a_base_cell_meets_the_set_where_one_of_its_cells_does(
            marked in prop::collection::vec((0..9usize, 0..83usize), 0..6),
            cells in prop::collection::vec((-3..9i64, -1..2i64), 1..9),
            risk_m in prop::sample::select(vec![0.1, 0.3, 0.15, 0.05]),
        ) {
            let ratio = ResolutionRatio::new(risk_m, 0.1).unwrap();
            let planes = Planes::new(WINDOW, ratio);
            let mut spans = CellSpan::of_rows(cells.iter().map(|&(col, row)| [col, row]));
            let mut set = CellSet::new(planes, spans.iter());
            let mut marks = vec![false; WINDOW.n_cells()];
            // What the set held before is gone.
            marks[4 * 83 + 5] = true;
            set.hold(&mut marks);
            marks.fill(false);
            marked.iter().for_each(|&(row, col)| marks[row * 83 + col] = true);
            set.hold(&mut marks.clone());
            // Rows that are asked for as a whole hold what lies between their cells too.
            let holds = |row: i64, col: i64| marks[((row - 5) * 83 + col + 7) as usize];
            let row_of = |row: i64| cells.iter().filter(move |cell| cell.1 == row).map(|cell| cell.0);
            for base_row in 6..13 {
                for first in -4..-4 + ratio.stride() {
                    let base = [first, base_row];
                    spans.iter_mut().for_each(|span| span.lay_on(&planes, base));
                    let answer = set.meets(&spans, planes.index(base));
                    for lane in 0..ASKED as i64 {
                        let col = first + lane * ratio.stride();
                        if col + 8 >= WINDOW.n_cols as i64 - 7 {
                            break;
                        }
                        let expected = (-1..2).any(|row| {
                            let (west, east) = (row_of(row).min(), row_of(row).max());
                            west.zip(east).is_some_and(|(west, east)| {
                                (west..=east).any(|off| holds(base_row + row, col + off))
                            })
                        });
                        prop_assert_eq!(answer >> lane & 1 == 1, expected, "{} {}", base_row, lane);
                    }
                }
            }
        }
    }
}
