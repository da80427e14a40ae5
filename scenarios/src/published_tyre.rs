//! A tyre of others, to hold the plant's against: that of CommonRoad's vehicle models, as they give it to vehicle 2, a
//! BMW 320i. Magic Formula PAC2002 of the ADAMS handbook, Althoff and Wuersching, "CommonRoad: Vehicle Models" (2020),
//! table 7; package commonroad-vehicle-models 3.0.2, `utils/tire_model.py`, at no camber and 4 kN.

/// Peak friction across and along [-].
pub const PEAK: [f64; 2] = [1.0489, 1.1739];
/// Stiffness across and along [-].
pub const STIFFNESS: [f64; 2] = [21.92, 22.303];
/// Slip angle [degrees] and lateral force over load.
pub const ACROSS: [[f64; 2]; 10] = [
    [0.5, 0.1891],
    [1.0, 0.3659],
    [2.0, 0.6507],
    [3.0, 0.8348],
    [4.0, 0.9414],
    [6.0, 1.0292],
    [8.0, 1.0483],
    [10.0, 1.0461],
    [15.0, 1.0223],
    [20.0, 1.0005],
];
/// Braking slip, one minus circumferential speed over that of the hub, and longitudinal force over load.
pub const ALONG: [[f64; 2]; 12] = [
    [0.005, 0.0971],
    [0.01, 0.2060],
    [0.02, 0.4101],
    [0.03, 0.5876],
    [0.05, 0.8505],
    [0.08, 1.0591],
    [0.10, 1.1237],
    [0.15, 1.1733],
    [0.20, 1.1631],
    [0.30, 1.1067],
    [0.50, 1.0037],
    [0.80, 0.9096],
];
/// Slip angle [degrees], braking slip, force over load along and across.
pub const COMBINED: [[f64; 4]; 12] = [
    [2.0, 0.02, 0.3466, 0.6555],
    [2.0, 0.05, 0.7480, 0.6384],
    [2.0, 0.10, 1.0479, 0.5611],
    [2.0, 0.20, 1.1347, 0.3774],
    [4.0, 0.02, 0.2647, 0.9440],
    [4.0, 0.05, 0.5975, 0.9226],
    [4.0, 0.10, 0.9092, 0.8328],
    [4.0, 0.20, 1.0709, 0.5980],
    [8.0, 0.02, 0.1601, 1.0505],
    [8.0, 0.05, 0.3832, 1.0380],
    [8.0, 0.10, 0.6536, 0.9795],
    [8.0, 0.20, 0.9012, 0.7935],
];
