//! What the steps and the end of a rollout cost beside the limits: to a goal, and along a path.

use super::{Flight, GoalTask};
use crate::kernel::Kernel;
use crate::objective::ReferenceStep;
use bicycle::lanes::Real;

/// What a step and the end cost beside the limits.
pub(super) trait Stage<K: Kernel> {
    fn step(&self, t: usize, flight: &mut Flight<K>);
    fn finish(&self, flight: &Flight<K>) -> Real<K>;
}

impl<K: Kernel> Stage<K> for GoalTask<'_> {
    #[inline(always)]
    fn step(&self, _t: usize, flight: &mut Flight<K>) {
        let kernel = flight.state.x.0;
        let dx = flight.state.x - kernel.real(self.x_cells);
        let dy = flight.state.y - kernel.real(self.y_cells);
        flight.distance = dx.mul_add(dx, dy * dy).sqrt();
        let cost = flight.distance.mul_add(kernel.real(self.distance_s), kernel.real(self.step_s));
        flight.running = flight.running.add_where(flight.under_way, cost);
        let away = kernel.real(self.tolerance_cells).less(flight.distance);
        flight.under_way = kernel.and(flight.under_way, away);
    }

    #[inline(always)]
    fn finish(&self, flight: &Flight<K>) -> Real<K> {
        let kernel = flight.distance.0;
        let rest = match &self.field {
            None => flight.distance * kernel.real(self.rest_s),
            Some(field) => field.seconds(flight.state.x, flight.state.y),
        };
        kernel.real(0.0).add_where(flight.under_way, rest)
    }
}

/// A moving point to keep up with.
pub(super) struct PathTask<'a>(pub(super) &'a [ReferenceStep]);

impl<K: Kernel> Stage<K> for PathTask<'_> {
    #[inline(always)]
    fn step(&self, t: usize, flight: &mut Flight<K>) {
        let (kernel, reference) = (flight.state.x.0, &self.0[t]);
        let dx = flight.state.x - kernel.real(reference.x_cells);
        let dy = flight.state.y - kernel.real(reference.y_cells);
        let [tx, ty] = reference.tangent.map(|value| kernel.real(value));
        let (along, across) = (dx.mul_add(tx, dy * ty), dy.mul_add(tx, -(dx * ty)));
        let along = along * along * kernel.real(reference.along_s);
        flight.running = flight.running + (across * across).mul_add(kernel.real(reference.across_s), along);
    }

    #[inline(always)]
    fn finish(&self, flight: &Flight<K>) -> Real<K> {
        flight.state.x.0.real(0.0)
    }
}
