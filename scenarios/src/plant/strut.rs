//! Spring, damper and travel stops between a wheel and the body.

use bicycle::Suspension;

/// Stiffness of the travel stops over that of the spring [-].
const STOP_RATIO: f64 = 10.0;
/// Damping of the travel stops over critical for the wheel [-].
const STOP_DAMPING: f64 = 0.3;

/// Strut of one axle's wheels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strut {
    suspension: Suspension,
    /// Spring force at rest [N].
    preload_n: f64,
    stop_n_per_m: f64,
    stop_ns_per_m: f64,
}

impl Strut {
    pub(crate) fn new(suspension: Suspension, load_n: f64, wheel_kg: f64) -> Self {
        let stop_n_per_m = STOP_RATIO * suspension.stiffness_n_per_m;
        let stop_ns_per_m = 2.0 * STOP_DAMPING * (stop_n_per_m * wheel_kg).sqrt();
        Self { suspension, preload_n: load_n, stop_n_per_m, stop_ns_per_m }
    }

    /// Force at a travel [N], its stiffness [N/m] and damping [N s/m].
    pub(crate) fn law(&self, travel_m: f64) -> [f64; 3] {
        let Suspension { stiffness_n_per_m, damping_ns_per_m, travel_m: most_m } = self.suspension;
        let spring_n = self.preload_n + stiffness_n_per_m * travel_m;
        // An unloaded spring is loose, it does not pull.
        let spring = if spring_n > 0.0 { [spring_n, stiffness_n_per_m] } else { [0.0, 0.0] };
        let beyond_m = travel_m - travel_m.clamp(-most_m, most_m);
        if beyond_m == 0.0 {
            return [spring[0], spring[1], damping_ns_per_m];
        }
        let force_n = spring[0] + self.stop_n_per_m * beyond_m;
        [force_n, spring[1] + self.stop_n_per_m, damping_ns_per_m + self.stop_ns_per_m]
    }
}
