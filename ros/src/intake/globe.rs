//! Fixes, and goals in degrees.

use nalgebra::Point3;

use super::{Intake, IntakeError, MOTION_AGE_MAX_NS, twist_of};
use crate::globe::GlobeError;
use crate::message::{GeoPoseStamped, NavSatFix};
use crate::odometry;
use crate::stamps::Arrival;

impl Intake {
    /// Learns where the map lies on the globe from where the antenna was when the fix was taken.
    ///
    /// # Errors
    /// See [`IntakeError`]; nothing is learned then.
    pub fn fix(&mut self, fix: &NavSatFix, arrival: Arrival) -> Result<(), IntakeError> {
        let stamp_ns = fix.header.stamp.nanoseconds();
        // A receiver that stamps by the satellites' time is refused, and moves nobody else's clock.
        let at_ns = self.clock.clone().at_ns(stamp_ns, arrival)?;
        let antenna = self.transforms.between(&fix.header.frame_id, &self.frames.vehicle, stamp_ns)?;
        let within_s = MOTION_AGE_MAX_NS as f64 * 1e-9;
        let (told_at_ns, record) = self.told_near(at_ns).ok_or(GlobeError::NoOdometry { within_s })?;
        let after_s = (at_ns as f64 - told_at_ns as f64) * 1e-9;
        let vehicle = odometry::motion_of_record(&record) * twist_of(&record).over(after_s);
        let antenna_m = vehicle * Point3::from(antenna.translation.vector);
        Ok(self.georeference.note(fix, [antenna_m.x, antenna_m.y])?)
    }

    /// A goal in degrees, as a place of the map [m].
    ///
    /// # Errors
    /// See [`GlobeError`].
    pub fn goal_on_globe(&self, goal: &GeoPoseStamped) -> Result<Vec<[f64; 2]>, IntakeError> {
        Ok(vec![self.georeference.place_m(&goal.pose.position)?])
    }
}
