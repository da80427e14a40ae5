//! Where the middle between the walls is: the line that the planner would drive if its nominal model were right.
//!
//! The nodes of a path make sharp corners, and a line of sight of one metre cuts them by up to 0.27 m: walls at equal
//! distances from the corners would punish the planner and not the model. So the planner drives a point that does what it is
//! told, and the walls stand to both sides of where that leads.

use super::lap::nominal_curvature_per_m;
use super::track::Track;

/// Way between decisions [m].
const STEP_M: f64 = 0.01;
/// Way between nodes of the line [m].
const SPACING_M: f64 = 0.1;

/// The closed line of a track.
pub(super) fn middle_line(track: &Track) -> Track {
    let ([mut x_m, mut y_m], mut yaw_rad) = track.place(0.0);
    let mut way_m = 0.0;
    let mut nodes: Vec<[f64; 2]> = Vec::new();
    let length_m = track.length_m();
    // The first lap leads onto the line.
    while way_m < 2.0 * length_m {
        way_m = track.project([x_m, y_m], way_m, 1.0).0.max(way_m);
        let curvature = nominal_curvature_per_m(track, [x_m, y_m, yaw_rad], way_m);
        yaw_rad += STEP_M * curvature;
        x_m += STEP_M * yaw_rad.cos();
        y_m += STEP_M * yaw_rad.sin();
        let is_far = nodes.last().is_none_or(|[x, y]: &[f64; 2]| (x_m - x).hypot(y_m - y) >= SPACING_M);
        if way_m >= length_m && is_far {
            nodes.push([x_m, y_m]);
        }
    }
    Track::closed(track.name, nodes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_is_smooth_closed_and_near_the_path() {
        for track in [Track::outdoor(), Track::indoor()] {
            let line = middle_line(&track);
            let n = line.nodes_m.len();
            for k in 0..n {
                let [a, b, c] = [0, 1, 2].map(|step| line.nodes_m[(k + step) % n]);
                let leg = |p: [f64; 2], q: [f64; 2]| [q[0] - p[0], q[1] - p[1]];
                let ([ux, uy], [vx, vy]) = (leg(a, b), leg(b, c));
                let turned = (ux * vy - uy * vx).atan2(ux * vx + uy * vy).abs();
                // Half a leg before and half a leg behind a node at 1.35 1/m; where it closes legs are shorter.
                assert!(turned < 0.2, "{} {k} {turned}", track.name);
                let (_, off_m) = track.project(b, 0.0, track.length_m());
                assert!(off_m < 0.3, "{} {k} {off_m}", track.name);
            }
        }
    }
}
