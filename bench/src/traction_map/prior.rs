//! The physics prior of a traction map, from its heights and classes alone.

use formats::{TractionMap, TractionPmfs};
use physics_prior::{SkidSteerGround, SkidSteerPrior};
use terrain::{FilteredGround, GridMap, GroundFilter, filter_ground, height_step_m};
use traversability::Pmf;

use super::JudgeError;

/// How the ground is found below branches and crowns. The height tolerance is at least the step of the map's heights.
///
/// Crowns of forest trees are up to 8 m wide; a skid-steered machine of 50 kg is sent over no more than 30 degrees
/// (the Husky's stated side slope); heights scatter by 0.15 m and what is 2.5 m high is no ground (the defaults of the
/// filter's common implementations, lidR and PDAL); over 4 m the steps of a map built of voxels of 0.5 m leave a
/// slope of 0.02.
pub const GROUND_FILTER: GroundFilter = GroundFilter {
    widest_object_m: 8.0,
    slope_max_rad: std::f64::consts::FRAC_PI_6,
    height_tolerance_m: 0.15,
    step_max_m: 2.5,
    plane_radius_m: 2.0,
};

/// The physics prior of a map, and the ground it was made of.
#[derive(Clone, Debug)]
pub struct Prior {
    /// The ground under everything.
    pub ground: FilteredGround,
    /// The finest step of the heights [m].
    pub height_step_m: Option<f32>,
    /// Distributions of every known cell, uniform elsewhere.
    pub pmfs: TractionPmfs,
}

/// Makes the prior of a map: slopes from the filtered ground, and how likely something stands or hangs in a cell from
/// the cell and its class.
///
/// # Errors
/// The ground cannot be found.
pub fn prior_of(map: &TractionMap) -> Result<Prior, JudgeError> {
    let step_m = height_step_m(&map.elevation_m);
    let tolerance_m = GROUND_FILTER.height_tolerance_m.max(step_m.map_or(0.0, f64::from));
    let filter = GroundFilter { height_tolerance_m: tolerance_m, ..GROUND_FILTER };
    let ground = filter_ground(&map.elevation_m, &filter)?;
    let obstruction = obstruction(map, &ground.is_ground);
    let prior = SkidSteerPrior::default();
    let mut pmfs = TractionPmfs {
        linear: GridMap::filled(*map.geometry(), Pmf::UNIFORM),
        angular: GridMap::filled(*map.geometry(), Pmf::UNIFORM),
    };
    for index in map.known_cells() {
        let [east, north] = ground.gradient.values()[index].map(f64::from);
        let place =
            SkidSteerGround { steepness: east.hypot(north), obstruction: obstruction.values()[index] };
        let belief = prior.belief(place);
        pmfs.linear.values_mut()[index] = belief.linear;
        pmfs.angular.values_mut()[index] = belief.angular;
    }
    Ok(Prior { ground, height_step_m: step_m, pmfs })
}

/// Probability that something stands or hangs in a cell: half by its own height, half by how often it is so with cells
/// of its class. The file gives its classes numbers without names, so that all that is taken from a class is what its
/// cells look like in this map.
fn obstruction(map: &TractionMap, is_ground: &GridMap<bool>) -> GridMap<f64> {
    let mut counts = [[0_usize; 2]; 256];
    let class = |index: usize| usize::from(map.semantic_id.values()[index]);
    for index in map.known_cells() {
        counts[class(index)][usize::from(!is_ground.values()[index])] += 1;
    }
    let mut obstruction = GridMap::filled(*map.geometry(), f64::NAN);
    for index in map.known_cells() {
        let [free, obstructed] = counts[class(index)];
        let of_class = obstructed as f64 / (free + obstructed) as f64;
        let own = if is_ground.values()[index] { 0.0 } else { 1.0 };
        obstruction.values_mut()[index] = 0.5 * (own + of_class);
    }
    obstruction
}
