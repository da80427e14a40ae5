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

/// Height of a small machine with its sensors [m]: what is lower stands in its way, what is higher may hang over it.
pub const MACHINE_HEIGHT_M: f32 = 1.0;

/// Half the length of the machine [m], the Husky's 0.99 m: what is nearer to a cell is met by a machine that stands
/// there in one heading or another.
pub const MACHINE_REACH_M: f64 = 0.5;

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

/// Makes the prior of a map: slopes from the filtered ground, and how likely something is in the way from what
/// stands within the machine's reach and from the cell's class.
///
/// # Errors
/// The ground cannot be found.
pub fn prior_of(map: &TractionMap) -> Result<Prior, JudgeError> {
    let step_m = height_step_m(&map.elevation_m);
    let tolerance_m = GROUND_FILTER.height_tolerance_m.max(step_m.map_or(0.0, f64::from));
    let filter = GroundFilter { height_tolerance_m: tolerance_m, ..GROUND_FILTER };
    let ground = filter_ground(&map.elevation_m, &filter)?;
    let obstruction = obstruction(map, &ground);
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

/// Probability that something is in the way of a machine in a cell: half by what stands within its reach, half by how
/// often something stands in cells of the class. The file gives its classes numbers without names, so that all that is
/// taken from a class is what its cells look like in this map.
fn obstruction(map: &TractionMap, ground: &FilteredGround) -> GridMap<f64> {
    let standing = standing(map, ground);
    let mut of_class = [[0.0_f64; 2]; 256];
    let class = |index: usize| usize::from(map.semantic_id.values()[index]);
    for index in map.known_cells() {
        let [sum, count] = &mut of_class[class(index)];
        (*sum, *count) = (*sum + standing.values()[index], *count + 1.0);
    }
    let mut obstruction = GridMap::filled(*map.geometry(), f64::NAN);
    for index in map.known_cells() {
        let [sum, count] = of_class[class(index)];
        obstruction.values_mut()[index] = 0.5 * (most_within_reach(&standing, index) + sum / count);
    }
    obstruction
}

/// Probability that what the map shows in a cell stands in the way: none for ground, one for what is no higher than the
/// machine, one half for what may as well be a branch over it.
fn standing(map: &TractionMap, ground: &FilteredGround) -> GridMap<f64> {
    let mut standing = GridMap::filled(*map.geometry(), 0.0);
    for index in map.known_cells().filter(|&index| !ground.is_ground.values()[index]) {
        let height_m = map.elevation_m.values()[index] - ground.height_m.values()[index];
        standing.values_mut()[index] = if height_m > MACHINE_HEIGHT_M { 0.5 } else { 1.0 };
    }
    standing
}

fn most_within_reach(standing: &GridMap<f64>, index: usize) -> f64 {
    let geometry = standing.geometry();
    let centre = geometry.cell(index);
    let reach = (MACHINE_REACH_M / geometry.resolution_m + 1e-9).floor() as usize;
    let rows = centre.row.saturating_sub(reach)..(centre.row + reach + 1).min(geometry.n_rows);
    let mut most = 0.0_f64;
    for row in rows {
        let up = row.abs_diff(centre.row);
        let across = ((reach * reach - up * up) as f64).sqrt() as usize;
        let cols = centre.col.saturating_sub(across)..(centre.col + across + 1).min(geometry.n_cols);
        most = cols.map(|col| standing.values()[row * geometry.n_cols + col]).fold(most, f64::max);
    }
    most
}

#[cfg(test)]
mod tests {
    use terrain::GridGeometry;

    use super::*;

    #[test]
    fn what_stands_is_met_from_the_four_neighbours_of_half_a_metre() {
        let geometry = GridGeometry { resolution_m: 0.5, origin: [0, 0], n_rows: 5, n_cols: 6 };
        let mut standing = GridMap::filled(geometry, 0.0);
        standing.values_mut()[2 * 6 + 3] = 1.0;
        let met: Vec<usize> = (0..30).filter(|&index| most_within_reach(&standing, index) > 0.0).collect();
        assert_eq!(met, [9, 14, 15, 16, 21]);
    }
}
