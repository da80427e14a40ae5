//! How fast uneven ground may be driven over: what the map says of it, and what the plant does there.

use std::sync::Arc;

use bicycle::lanes::Instructions;
use bicycle::{Command, Vehicle};
use navigator::{Config, RiskEstimator};
use physics_prior::Assumption;
use scenarios::{Patch, Plant, Stribeck, World};
use terrain::{GridGeometry, GridMap, SurfaceCell, TerrainClass};
use traversability::{CvarLevel, SpeedLaw};

/// Where bumps lie on the way [m].
const BUMP_M: f64 = 4.0;

/// A bump across the way of this height and length, as half a wave of a cosine; under the wheels of one side alone where
/// `is_one_sided`.
#[derive(Clone, Copy, Debug)]
struct Bump {
    height_m: f64,
    length_m: f64,
    is_one_sided: bool,
}

impl Bump {
    fn at(&self, x_m: f64, y_m: f64) -> f64 {
        let phase = 2.0 * (x_m - BUMP_M) / self.length_m;
        if phase.abs() > 1.0 || (self.is_one_sided && y_m < 0.0) {
            return 0.0;
        }
        0.5 * self.height_m * (1.0 + libm::cos(std::f64::consts::PI * phase))
    }

    fn world(&self) -> Arc<World> {
        let geometry = GridGeometry::centred(0.04, 150, 2400, 0.0, 0.0);
        let bump = *self;
        let height_m = move |x_m: f64, y_m: f64| bump.at(x_m, y_m);
        Arc::new(World::from_fn("bump", geometry, height_m, |_, _| Patch::open(Stribeck::ASPHALT)).unwrap())
    }

    /// Slowest of the limits along the way over it, by physics on a map that knows it [m/s].
    fn limit_mps(&self, vehicle: &Vehicle) -> f32 {
        let config = Config::for_vehicle(vehicle);
        let cell_m = config.risk_resolution_m();
        let grid = GridGeometry::centred(cell_m, 41, 61, BUMP_M, 0.0);
        let around = GridGeometry::centred(cell_m, 81, 101, BUMP_M, 0.0);
        let heights = (0..around.n_cells()).map(|index| {
            let [x_m, y_m] = around.centre_m(around.cell(index));
            SurfaceCell::certain(self.at(x_m, y_m) as f32, TerrainClass::Open, 0.0)
        });
        let surface = GridMap::from_values(around, heights.collect()).unwrap();
        let assumption = Assumption::Physics { prior: config.prior, level: CvarLevel::new(0.6).unwrap() };
        let instructions = Instructions::widest();
        let mut map =
            RiskEstimator::prior(&vehicle.geometry, &assumption, cell_m, grid, 16, instructions).unwrap();
        map.update(&surface).unwrap();
        let law = SpeedLaw {
            righting_radps2: vehicle.righting_radps2().map(|value| value as f32),
            most_rad: [vehicle.limits.roll_max_rad, vehicle.limits.pitch_max_rad]
                .map(|most| 0.9 * most as f32),
            least_mps: 0.1,
            most_mps: 25.0,
            reach_m: 0.0,
        };
        let (view, mut limits_mps) = (map.risk_map().view(), Vec::new());
        law.limits(&view, view.risks, &mut limits_mps);
        let row = grid.cell_at(BUMP_M, 0.0).unwrap().row;
        limits_mps[row * 61..(row + 1) * 61].iter().copied().fold(f32::INFINITY, f32::min)
    }

    /// Largest |roll| and |pitch| over it at a speed [rad], and the longest time without a wheel on the ground [s].
    fn driven(&self, vehicle: &Vehicle, speed_mps: f32) -> ([f64; 2], f64) {
        let mut vehicle = vehicle.clone();
        vehicle.limits.speed_max_mps = f64::from(speed_mps);
        let mut plant = Plant::new(&vehicle, self.world(), [-40.0, 0.0, 0.0]).unwrap();
        plant.set_command(Command { speed_mps, steering_rad: 0.0 }).unwrap();
        let (mut most_rad, mut flight_s, mut longest_s) = ([0.0_f64; 2], 0.0, 0.0_f64);
        while plant.pose().x_m < BUMP_M + 10.0 && plant.time_s() < 30.0 && !plant.rolled_over() {
            plant.advance(0.005);
            let [roll, pitch] = [plant.pose().roll_rad, plant.pose().pitch_rad];
            most_rad = [most_rad[0].max(roll.abs()), most_rad[1].max(pitch.abs())];
            let is_flying = plant.wheels().iter().all(|wheel| wheel.contact_m.is_none());
            flight_s = if is_flying { flight_s + 0.005 } else { 0.0 };
            longest_s = longest_s.max(flight_s);
        }
        (most_rad, longest_s)
    }
}

/// At the limit that the map tells, the vehicle keeps to the ground and within the limits of its attitude; at a
/// speed between 1.3 and 1.6 times as much it flies for 0.1 s or longer, or leans beyond them. The plant knows nothing of the law: it is springs, tyres and
/// rigid bodies.
#[test]
fn the_plant_keeps_to_the_ground_up_to_the_limit_and_not_far_beyond() {
    let across = |height_m: f64, length_m: f64| Bump { height_m, length_m, is_one_sided: false };
    let beside = |height_m: f64, length_m: f64| Bump { height_m, length_m, is_one_sided: true };
    let buggy = [across(0.08, 0.6), across(0.12, 1.2), across(0.2, 2.0), across(0.2, 4.0), beside(0.2, 2.0)];
    let full_size = [across(0.35, 2.6), across(0.53, 5.3), across(0.88, 8.8), across(0.8, 12.0)];
    for (name, bumps) in [("buggy_fifth", &buggy[..]), ("pietra_full_size", &full_size[..])] {
        let vehicle = formats::read_vehicle(name).unwrap();
        let most_rad = [vehicle.limits.roll_max_rad, vehicle.limits.pitch_max_rad];
        for bump in bumps {
            let limit_mps = bump.limit_mps(&vehicle);
            let is_lost = |speed_mps: f32| {
                let (lean_rad, flight_s) = bump.driven(&vehicle, speed_mps);
                let [roll_deg, pitch_deg] = lean_rad.map(f64::to_degrees);
                let share = speed_mps / limit_mps;
                println!(
                    "{name}, {bump:?}, {share:.2} of {limit_mps:.1} m/s: {roll_deg:.0} {pitch_deg:.0} deg, {flight_s:.2} s"
                );
                flight_s >= 0.1 || lean_rad[0] > most_rad[0] || lean_rad[1] > most_rad[1]
            };
            assert!(!is_lost(limit_mps), "{name}, {bump:?}: {limit_mps} m/s are too fast");
            // Whoever is faster still may run into the bump instead of over it.
            let n_lost = [1.3, 1.45, 1.6].into_iter().filter(|share| is_lost(share * limit_mps)).count();
            assert!(n_lost > 0, "{name}, {bump:?}: {limit_mps} m/s are too slow");
        }
    }
}
