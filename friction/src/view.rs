//! Ground seen from above: colour and height in square pixels.

/// Red, green, blue, height.
pub const CHANNELS: usize = 4;
/// Half of the square over which heights are smoothed before their rise is taken, and of the distance over which it is [m].
const SMOOTH_M: f64 = 3.0;
const RISE_M: f64 = 2.0;

/// A picture from above, on pixels along the map's axes.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Edge of a pixel [m].
    pub resolution_m: f64,
    /// South-west corner [m].
    pub south_west_m: [f64; 2],
    /// Northward.
    pub n_rows: usize,
    /// Eastward.
    pub n_cols: usize,
    /// Shape [channel, row, column], row 0 in the south: red, green, blue from 0 to 1, height [m].
    pub values: Vec<f32>,
}

/// A picture that friction cannot be seen in.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ViewError {
    /// No colour, or no height, or a shape that is none.
    #[error(
        "view: expected {CHANNELS} channels (red, green, blue, height) of {n_rows} x {n_cols} pixels, found {found} numbers"
    )]
    Shape {
        /// Rows.
        n_rows: usize,
        /// Columns.
        n_cols: usize,
        /// Numbers given.
        found: usize,
    },
    /// Other pixels than the network learned from.
    #[error("view: expected pixels of {expected_m} m, found {found_m} m")]
    Resolution {
        /// Edge of a pixel the network knows [m].
        expected_m: f64,
        /// Edge found [m].
        found_m: f64,
    },
    /// A height or a colour is no number.
    #[error("view: {channel} at row {row}, column {col}: expected {expected}, found {found}")]
    Value {
        /// Which channel.
        channel: &'static str,
        /// Row, 0 = south.
        row: usize,
        /// Column, 0 = west.
        col: usize,
        /// What would do.
        expected: &'static str,
        /// What stands there.
        found: f32,
    },
}

impl View {
    /// Refuses what no picture holds.
    ///
    /// # Errors
    /// Other than four channels, pixels without size, colours outside 0 to 1, heights that are no numbers.
    pub fn validate(&self) -> Result<(), ViewError> {
        let Self { n_rows, n_cols, .. } = *self;
        if self.values.len() != CHANNELS * n_rows * n_cols || self.values.is_empty() {
            return Err(ViewError::Shape { n_rows, n_cols, found: self.values.len() });
        }
        if !(self.resolution_m.is_finite() && self.resolution_m > 0.0) {
            return Err(ViewError::Resolution { expected_m: 0.5, found_m: self.resolution_m });
        }
        for (index, &found) in self.values.iter().enumerate() {
            let (channel, pixel) = (index / (n_rows * n_cols), index % (n_rows * n_cols));
            let (is_sound, expected) = match channel {
                3 => (found.is_finite(), "a finite height"),
                _ => ((0.0..=1.0).contains(&found), "0 to 1"),
            };
            if !is_sound {
                let channel = ["red", "green", "blue", "height"][channel];
                return Err(ViewError::Value {
                    channel,
                    row: pixel / n_cols,
                    col: pixel % n_cols,
                    expected,
                    found,
                });
            }
        }
        Ok(())
    }

    /// Row and column of the pixel at a place, or of the nearest one.
    pub fn pixel(&self, at_m: [f64; 2]) -> [usize; 2] {
        let place = |axis: usize, n: usize| {
            let cell = (at_m[axis] - self.south_west_m[axis]) / self.resolution_m;
            (cell.max(0.0) as usize).min(n - 1)
        };
        [place(1, self.n_rows), place(0, self.n_cols)]
    }

    /// Mean red, green and blue.
    pub fn mean_colour(&self) -> [f32; 3] {
        let n = self.n_rows * self.n_cols;
        [0, 1, 2].map(|channel| {
            let values = &self.values[channel * n..(channel + 1) * n];
            (values.iter().map(|value| f64::from(*value)).sum::<f64>() / n as f64) as f32
        })
    }

    /// Rises of the ground as far as whole vehicles feel them.
    pub fn slopes(&self) -> Slopes {
        let heights_m = &self.values[3 * self.n_rows * self.n_cols..];
        let half = (SMOOTH_M / self.resolution_m).round() as usize;
        let along = smoothed(heights_m, self.n_cols, half);
        let turned = smoothed(&transposed(&along, self.n_cols), self.n_rows, half);
        Slopes { heights_m: transposed(&turned, self.n_rows) }
    }
}

/// Smoothed heights of a view.
#[derive(Clone, Debug)]
pub struct Slopes {
    heights_m: Vec<f32>,
}

impl Slopes {
    /// Rise east and north at a place [-].
    pub fn at(&self, view: &View, at_m: [f64; 2]) -> [f64; 2] {
        let height_m = |x_m: f64, y_m: f64| {
            let [row, col] = view.pixel([x_m, y_m]);
            f64::from(self.heights_m[row * view.n_cols + col])
        };
        let [x_m, y_m] = at_m;
        let east_m = height_m(x_m + RISE_M, y_m) - height_m(x_m - RISE_M, y_m);
        let north_m = height_m(x_m, y_m + RISE_M) - height_m(x_m, y_m - RISE_M);
        [east_m, north_m].map(|rise_m| rise_m / (2.0 * RISE_M))
    }
}

/// Means over `half` neighbours to both sides within rows; at the edges over those there are.
fn smoothed(values: &[f32], n_cols: usize, half: usize) -> Vec<f32> {
    let mean = |row: &[f32], col: usize| {
        let around = &row[col.saturating_sub(half)..(col + half + 1).min(n_cols)];
        around.iter().sum::<f32>() / around.len() as f32
    };
    values.chunks(n_cols).flat_map(|row| (0..n_cols).map(move |col| mean(row, col))).collect()
}

fn transposed(values: &[f32], n_cols: usize) -> Vec<f32> {
    (0..n_cols).flat_map(|col| values.iter().skip(col).step_by(n_cols).copied()).collect()
}
