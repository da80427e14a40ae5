//! What two maps of the ground differ in.

use terrain::{Cell, CellRegion, GridMap, SurfaceCell};

/// The bounding rectangle, in the window of `next`, of all cells that differ; what entered the window differs.
pub(super) fn changed_region(last: &GridMap<SurfaceCell>, next: &GridMap<SurfaceCell>) -> Option<CellRegion> {
    let geometry = next.geometry();
    if (geometry.resolution_m, geometry.n_rows, geometry.n_cols)
        != (last.geometry().resolution_m, last.geometry().n_rows, last.geometry().n_cols)
    {
        return Some(CellRegion::whole(geometry));
    }
    let mut found: Option<CellRegion> = None;
    for (index, cell) in next.values().iter().enumerate() {
        let Cell { row, col } = geometry.cell(index);
        let lattice = [geometry.origin[0] + col as i64, geometry.origin[1] + row as i64];
        if last.at_lattice(lattice).is_some_and(|before| is_same(before, cell)) {
            continue;
        }
        found = Some(match found {
            None => CellRegion { rows: row..row + 1, cols: col..col + 1 },
            Some(region) => CellRegion {
                rows: region.rows.start.min(row)..region.rows.end.max(row + 1),
                cols: region.cols.start.min(col)..region.cols.end.max(col + 1),
            },
        });
    }
    found
}

/// To the last bit: an unknown height is no number, and equal to itself here.
fn is_same(one: &SurfaceCell, other: &SurfaceCell) -> bool {
    let bits = |cell: &SurfaceCell| {
        let SurfaceCell { height_m, height_variance_m2, vegetation_height_m, class_probability, .. } = *cell;
        (
            [height_m, height_variance_m2, vegetation_height_m].map(f32::to_bits),
            class_probability.map(f32::to_bits),
        )
    };
    bits(one) == bits(other) && one.knowledge == other.knowledge
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::{GridGeometry, TerrainClass};

    fn map(origin: [i64; 2]) -> GridMap<SurfaceCell> {
        let geometry = GridGeometry { resolution_m: 0.5, origin, n_rows: 4, n_cols: 5 };
        GridMap::filled(geometry, SurfaceCell::UNKNOWN)
    }

    #[test]
    fn only_what_differs_has_changed() {
        let last = map([0, 0]);
        assert_eq!(changed_region(&last, &last), None, "unknown heights are equal to themselves");
        let mut next = last.clone();
        for cell in [Cell { row: 1, col: 3 }, Cell { row: 2, col: 2 }] {
            next[cell] = SurfaceCell::certain(1.0, TerrainClass::Open, 0.0);
        }
        assert_eq!(changed_region(&last, &next), Some(CellRegion { rows: 1..3, cols: 2..4 }));
    }

    #[test]
    fn what_entered_the_window_has_changed() {
        let moved = map([1, 0]);
        assert_eq!(changed_region(&map([0, 0]), &moved), Some(CellRegion { rows: 0..4, cols: 4..5 }));
        let far = map([100, 0]);
        assert_eq!(changed_region(&map([0, 0]), &far), Some(CellRegion::whole(far.geometry())));
    }
}
