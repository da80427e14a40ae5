//! AnyNav's table 6.

use scenarios::LandscapeKind;

use super::method::Method;

/// One cell of the published table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Published {
    /// Share of tasks at the goal [-].
    pub success: f64,
    /// Mean time of these [s].
    pub time_s: f64,
    /// Driven over expected time.
    pub ratio: Option<f64>,
}

/// What the paper found for a row.
pub const fn published(landscape: LandscapeKind, method: Method) -> Published {
    let (success, time_s, ratio) = match landscape {
        LandscapeKind::Garden => garden(method),
        LandscapeKind::Island => island(method),
    };
    Published { success, time_s, ratio }
}

const fn garden(method: Method) -> (f64, f64, Option<f64>) {
    match method {
        Method::Binary => (0.72, 31.661, Some(1.116)),
        Method::Appearance => (0.26, 53.774, None),
        Method::Constant20 => (0.90, 42.820, Some(0.969)),
        Method::Constant50 => (0.82, 29.765, Some(1.078)),
        Method::Constant80 => (0.82, 28.197, Some(1.127)),
        Method::Friction50 => (1.0, 39.260, Some(0.997)),
        Method::Friction150 => (0.86, 29.620, Some(1.158)),
        Method::Speed75 => (1.0, 35.830, Some(0.942)),
        Method::Speed125 => (0.82, 27.638, Some(1.230)),
        Method::NoSteering => (0.96, 32.304, Some(1.064)),
        Method::Ours => (1.0, 29.648, Some(1.037)),
    }
}

const fn island(method: Method) -> (f64, f64, Option<f64>) {
    match method {
        Method::Binary => (0.60, 46.544, Some(1.208)),
        Method::Appearance => (0.08, 62.605, None),
        Method::Constant20 => (0.92, 73.678, Some(0.962)),
        Method::Constant50 => (0.92, 46.183, Some(1.063)),
        Method::Constant80 => (0.82, 42.408, Some(1.208)),
        Method::Friction50 => (0.92, 55.217, Some(1.004)),
        Method::Friction150 => (0.74, 38.569, Some(1.181)),
        Method::Speed75 => (0.94, 49.620, Some(0.986)),
        Method::Speed125 => (0.80, 38.032, Some(1.286)),
        Method::NoSteering => (0.88, 44.405, Some(1.083)),
        Method::Ours => (0.94, 41.942, Some(1.099)),
    }
}
