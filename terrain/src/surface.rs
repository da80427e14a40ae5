//! What is known of one cell of ground.

use crate::TerrainClass;

/// How a height came to be known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Knowledge {
    /// Nothing was seen: a hole, and it stays one.
    #[default]
    Unknown,
    /// Filled in between measured neighbours.
    Interpolated,
    /// Seen.
    Measured,
}

/// The ground of one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceCell {
    /// Height of the ground itself, below any vegetation [m]; NaN while unknown.
    pub height_m: f32,
    /// Variance of the height [m2].
    pub height_variance_m2: f32,
    /// Height of soft vegetation above the ground [m].
    pub vegetation_height_m: f32,
    /// Probability of each [`TerrainClass`]; sums to one where the height is known or anything was seen, zeros
    /// otherwise. An obstacle may be seen where the ground is not.
    pub class_probability: [f32; TerrainClass::COUNT],
    /// How the height came to be known.
    pub knowledge: Knowledge,
}

impl SurfaceCell {
    /// A cell of which nothing is known.
    pub const UNKNOWN: Self = Self {
        height_m: f32::NAN,
        height_variance_m2: f32::INFINITY,
        vegetation_height_m: 0.0,
        class_probability: [0.0; TerrainClass::COUNT],
        knowledge: Knowledge::Unknown,
    };

    /// A cell whose truth is known.
    pub fn certain(height_m: f32, class: TerrainClass, vegetation_height_m: f32) -> Self {
        let mut class_probability = [0.0; TerrainClass::COUNT];
        class_probability[class as usize] = 1.0;
        Self {
            height_m,
            height_variance_m2: 0.0,
            vegetation_height_m,
            class_probability,
            knowledge: Knowledge::Measured,
        }
    }

    /// Whether there is a height to drive on.
    pub fn is_known(&self) -> bool {
        self.knowledge != Knowledge::Unknown
    }

    /// Whether both are the same to the last bit; an unknown height, which is no number, is the same as another.
    pub fn is_identical(&self, other: &Self) -> bool {
        let bits = |cell: &Self| {
            let heights = [cell.height_m, cell.height_variance_m2, cell.vegetation_height_m];
            (heights.map(f32::to_bits), cell.class_probability.map(f32::to_bits))
        };
        bits(self) == bits(other) && self.knowledge == other.knowledge
    }

    /// The likeliest class, `Open` where nothing was seen.
    pub fn class(&self) -> TerrainClass {
        let mut best = TerrainClass::Open;
        for class in TerrainClass::ALL {
            if self.class_probability[class as usize] > self.class_probability[best as usize] {
                best = class;
            }
        }
        best
    }
}
