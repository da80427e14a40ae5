//! Measured or predicted values of the four traversability parameters.

/// How much of a command arrives (PIETRA, equation 2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Traction {
    /// Achieved over commanded speed, in [0, 1].
    pub linear: f32,
    /// Achieved over commanded yaw rate, in [0, 1].
    pub angular: f32,
}

/// How far the vehicle leans, either way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attitude {
    /// |roll| [rad].
    pub roll_rad: f32,
    /// |pitch| [rad].
    pub pitch_rad: f32,
}

/// The four traversability parameters of one pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Traversability {
    /// What arrives of the commands.
    pub traction: Traction,
    /// How far the vehicle leans.
    pub attitude: Attitude,
}
