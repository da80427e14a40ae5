//! The edges of the search: where they lead and which cells they cross.

/// Length of a knight's move [cells].
pub const LONGEST_CELLS: f64 = 2.236_067_977_499_79;

/// One direction of travel across the grid.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Eastward and northward, in cells.
    pub towards: [isize; 2],
    /// The two cells beside the line: crossed by a knight's move, touched at their corner by a diagonal; the start
    /// itself for a straight edge. As `towards`.
    beside: [[isize; 2]; 2],
}

/// The 8-neighbourhood first, then the knight's moves; each counter-clockwise from east.
pub const EDGES: [Edge; 16] = [
    straight([1, 0]),
    diagonal([1, 1]),
    straight([0, 1]),
    diagonal([-1, 1]),
    straight([-1, 0]),
    diagonal([-1, -1]),
    straight([0, -1]),
    diagonal([1, -1]),
    knight([2, 1]),
    knight([1, 2]),
    knight([-1, 2]),
    knight([-2, 1]),
    knight([-2, -1]),
    knight([-1, -2]),
    knight([1, -2]),
    knight([2, -1]),
];

const fn straight(towards: [isize; 2]) -> Edge {
    Edge { towards, beside: [[0, 0]; 2] }
}

const fn diagonal(towards: [isize; 2]) -> Edge {
    Edge { towards, beside: [[towards[0], 0], [0, towards[1]]] }
}

const fn knight(towards: [isize; 2]) -> Edge {
    let near = [towards[0] / 2, towards[1] / 2];
    Edge { towards, beside: [near, [towards[0] - near[0], towards[1] - near[1]]] }
}

impl Edge {
    /// Heading along the edge [rad].
    pub fn yaw_rad(&self) -> f64 {
        libm::atan2(self.towards[1] as f64, self.towards[0] as f64)
    }

    /// Distance in a row-major array between start and end.
    pub fn step(&self, stride: isize) -> isize {
        offset(self.towards, stride)
    }

    /// Time over the edge, per metre of cell edge, when `slowness_at` gives the time per metre at an array distance
    /// from the start.
    ///
    /// The line from centre to centre spends half of its length in either end cell; a knight's move a quarter in
    /// each of four cells. A diagonal only touches two more cells at their corner: it is no faster than the better
    /// of them, so that it never slips between two obstacles.
    pub fn time_per_cell(&self, stride: isize, slowness_at: impl Fn(isize) -> f32) -> f32 {
        let ends = 0.5 * (slowness_at(0) + slowness_at(self.step(stride)));
        let beside = || self.beside.map(|cell| slowness_at(offset(cell, stride)));
        match self.towards[0].abs() + self.towards[1].abs() {
            1 => ends,
            2 => {
                let [left, right] = beside();
                std::f32::consts::SQRT_2 * ends.max(left.min(right))
            }
            _ => {
                let [near, far] = beside();
                LONGEST_CELLS as f32 * 0.5 * (ends + 0.5 * (near + far))
            }
        }
    }
}

fn offset(cell: [isize; 2], stride: isize) -> isize {
    cell[1] * stride + cell[0]
}
