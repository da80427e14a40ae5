//! The radial flow that tells how much the training data resembles a latent: log density and its gradients.
//!
//! A layer with centre c, `a = softplus(alpha)`, `b = softplus(beta) - a` moves `z` to `z + u d` with `d = z - c`,
//! `r = |d|`, `h = 1/(a + r)`, `u = b h`, and changes the logarithm of volume by
//! `(H - 1) ln(1 + u) + ln(1 + v)` with `v = a b h^2` (Rezende and Mohamed; NatPN). After all layers the latent is
//! judged by the standard normal density.

use candle_core::{CpuStorage, CustomOp3, Layout, Result, Shape, Tensor};

use crate::loss::{contiguous, sigmoid};

/// ln(2 pi).
const LOG_TWO_PI: f64 = 1.837_877_066_409_345_3;

/// A density over latents of any width: parameters of all layers in double precision.
#[derive(Clone, Debug, PartialEq)]
pub struct RadialFlow {
    n_latent: usize,
    /// Row-major [layers, latent].
    centres: Vec<f64>,
    shapes: Vec<LayerShape>,
}

/// A layer's two numbers and what turns gradients by them into gradients by the raw ones.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LayerShape {
    a: f64,
    b: f64,
    /// da/dalpha, which is also -db/dalpha.
    a_by_alpha: f64,
    b_by_beta: f64,
}

/// What the backward pass needs to know of a layer's forward pass.
#[derive(Clone, Copy, Debug, Default)]
struct Step {
    h: f64,
    r: f64,
}

/// Room for one latent on its way through the flow.
#[derive(Clone, Debug)]
pub struct FlowScratch {
    /// The latent before every layer and after the last, [layers + 1, latent].
    path: Vec<f64>,
    steps: Vec<Step>,
    slope: Vec<f64>,
}

/// Gradients by the parameters of the flow.
struct FlowGradient {
    centres: Vec<f64>,
    /// [alpha of all layers, beta of all layers].
    shapes: Vec<f64>,
}

/// ln(1 + exp(x)) without overflow.
fn softplus(x: f64) -> f64 {
    x.max(0.0) + libm::log1p(libm::exp(-x.abs()))
}

impl RadialFlow {
    /// From `centre` [layers, latent], row-major, and `alpha` and `beta` of all layers.
    pub fn new(centre: &[f32], alpha: &[f32], beta: &[f32]) -> Self {
        let shape = |(&alpha, &beta): (&f32, &f32)| {
            let (alpha, beta) = (f64::from(alpha), f64::from(beta));
            let a = softplus(alpha);
            LayerShape { a, b: softplus(beta) - a, a_by_alpha: sigmoid(alpha), b_by_beta: sigmoid(beta) }
        };
        Self {
            n_latent: centre.len() / alpha.len(),
            centres: centre.iter().map(|&value| f64::from(value)).collect(),
            shapes: alpha.iter().zip(beta).map(shape).collect(),
        }
    }

    /// Room for one latent.
    pub fn scratch(&self) -> FlowScratch {
        FlowScratch {
            path: vec![0.0; (self.shapes.len() + 1) * self.n_latent],
            steps: vec![Step::default(); self.shapes.len()],
            slope: vec![0.0; self.n_latent],
        }
    }

    /// Logarithm of the density at a latent.
    pub fn log_density(&self, latent: &[f32], scratch: &mut FlowScratch) -> f64 {
        let width = self.n_latent;
        for (place, &value) in scratch.path.iter_mut().zip(latent) {
            *place = f64::from(value);
        }
        // Products of the layers' volume changes: one logarithm for all.
        let (mut across, mut along) = (1.0, 1.0);
        for (layer, shape) in self.shapes.iter().enumerate() {
            let (before, after) = scratch.path[layer * width..(layer + 2) * width].split_at_mut(width);
            let centre = &self.centres[layer * width..(layer + 1) * width];
            let r = before.iter().zip(centre).map(|(z, c)| (z - c) * (z - c)).sum::<f64>().sqrt();
            let h = 1.0 / (shape.a + r);
            let u = shape.b * h;
            for (place, (z, c)) in after.iter_mut().zip(before.iter().zip(centre)) {
                *place = z + u * (z - c);
            }
            across *= 1.0 + u;
            along *= 1.0 + shape.a * u * h;
            scratch.steps[layer] = Step { h, r };
        }
        let end = &scratch.path[self.shapes.len() * width..];
        let square: f64 = end.iter().map(|z| z * z).sum();
        -0.5 * (width as f64 * LOG_TWO_PI + square)
            + (width as f64 - 1.0) * libm::log(across)
            + libm::log(along)
    }

    /// Adds `by_density` times the gradient at the latent that `scratch` has just seen to `gradient`, and leaves the
    /// gradient by the latent in `scratch.slope`.
    fn backward(&self, by_density: f64, scratch: &mut FlowScratch, gradient: &mut FlowGradient) {
        let (width, n_layers) = (self.n_latent, self.shapes.len());
        let FlowScratch { path, steps, slope } = scratch;
        for (slope, z) in slope.iter_mut().zip(&path[n_layers * width..]) {
            *slope = -by_density * z;
        }
        for layer in (0..n_layers).rev() {
            let LayerShape { a, b, a_by_alpha, b_by_beta } = self.shapes[layer];
            let Step { h, r } = steps[layer];
            let before = &path[layer * width..(layer + 1) * width];
            let centre = &self.centres[layer * width..(layer + 1) * width];
            let u = b * h;
            let along: f64 = slope.iter().zip(before.iter().zip(centre)).map(|(s, (z, c))| s * (z - c)).sum();
            let by_u = along + by_density * (width as f64 - 1.0) / (1.0 + u);
            let by_v = by_density / (1.0 + a * u * h);
            let by_r = -h * h * b * (by_u + 2.0 * by_v * a * h);
            let by_a = by_v * u * h + by_r;
            let by_b = by_u * h + by_v * a * h * h;
            gradient.shapes[layer] += (by_a - by_b) * a_by_alpha;
            gradient.shapes[n_layers + layer] += by_b * b_by_beta;
            let per_r = if r > 0.0 { by_r / r } else { 0.0 };
            let by_centre = &mut gradient.centres[layer * width..(layer + 1) * width];
            for dim in 0..width {
                let by_offset = u * slope[dim] + per_r * (before[dim] - centre[dim]);
                by_centre[dim] -= by_offset;
                slope[dim] += by_offset;
            }
        }
    }
}

/// Log densities [rows] of latents [rows, latent] under centres [layers, latent] and shapes [2, layers]: alpha, beta.
pub struct LogDensity;

impl LogDensity {
    fn flow(centres: &[f32], shapes: &[f32]) -> RadialFlow {
        let (alpha, beta) = shapes.split_at(shapes.len() / 2);
        RadialFlow::new(centres, alpha, beta)
    }
}

impl CustomOp3 for LogDensity {
    fn name(&self) -> &'static str {
        "radial-flow-log-density"
    }

    fn cpu_fwd(
        &self,
        latents: &CpuStorage,
        latents_layout: &Layout,
        centres: &CpuStorage,
        centres_layout: &Layout,
        shapes: &CpuStorage,
        shapes_layout: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let flow = Self::flow(contiguous(centres, centres_layout)?, contiguous(shapes, shapes_layout)?);
        let mut scratch = flow.scratch();
        let rows = contiguous(latents, latents_layout)?.chunks_exact(flow.n_latent);
        let densities: Vec<f32> = rows.map(|row| flow.log_density(row, &mut scratch) as f32).collect();
        let shape = Shape::from(densities.len());
        Ok((CpuStorage::F32(densities), shape))
    }

    fn bwd(
        &self,
        latents: &Tensor,
        centres: &Tensor,
        shapes: &Tensor,
        _densities: &Tensor,
        by_densities: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>, Option<Tensor>)> {
        let numbers = |tensor: &Tensor| tensor.contiguous()?.flatten_all()?.to_vec1::<f32>();
        let flow = Self::flow(&numbers(centres)?, &numbers(shapes)?);
        let mut scratch = flow.scratch();
        let mut gradient =
            FlowGradient { centres: vec![0.0; flow.centres.len()], shapes: vec![0.0; 2 * flow.shapes.len()] };
        let rows = numbers(latents)?;
        let mut by_latents = Vec::with_capacity(rows.len());
        for (row, by_density) in rows.chunks_exact(flow.n_latent).zip(numbers(by_densities)?) {
            flow.log_density(row, &mut scratch);
            flow.backward(f64::from(by_density), &mut scratch, &mut gradient);
            by_latents.extend(scratch.slope.iter().map(|&slope| slope as f32));
        }
        let single = |values: &[f64], like: &Tensor| {
            let values: Vec<f32> = values.iter().map(|&value| value as f32).collect();
            Tensor::from_vec(values, like.shape(), like.device())
        };
        Ok((
            Some(Tensor::from_vec(by_latents, latents.shape(), latents.device())?),
            Some(single(&gradient.centres, centres)?),
            Some(single(&gradient.shapes, shapes)?),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use candle_core::{Device, Var};

    const CENTRES: [f32; 6] = [0.3, -0.2, -0.5, 0.4, 0.1, 0.7];
    const ALPHA: [f32; 3] = [0.4, -0.6, 0.2];
    const BETA: [f32; 3] = [1.5, -0.9, 0.8];

    fn flow() -> RadialFlow {
        RadialFlow::new(&CENTRES, &ALPHA, &BETA)
    }

    fn log_density(flow: &RadialFlow, latent: &[f32]) -> f64 {
        flow.log_density(latent, &mut flow.scratch())
    }

    /// Where the flow takes a latent.
    fn moved(flow: &RadialFlow, latent: [f64; 2]) -> [f64; 2] {
        let mut z = latent;
        for (layer, shape) in flow.shapes.iter().enumerate() {
            let d = [0, 1].map(|dim| z[dim] - flow.centres[2 * layer + dim]);
            let u = shape.b / (shape.a + d[0].hypot(d[1]));
            z = [z[0] + u * d[0], z[1] + u * d[1]];
        }
        z
    }

    #[test]
    fn change_of_volume_is_the_numeric_jacobian() {
        let (flow, step) = (flow(), 1e-5);
        for latent in [[0.1f32, 0.9], [-2.0, 0.3], [5.0, -4.0]] {
            let z = latent.map(f64::from);
            let column = |dim: usize| {
                let (mut above, mut below) = (z, z);
                above[dim] += step;
                below[dim] -= step;
                let (above, below) = (moved(&flow, above), moved(&flow, below));
                [0, 1].map(|k| (above[k] - below[k]) / (2.0 * step))
            };
            let (first, second) = (column(0), column(1));
            let determinant = first[0] * second[1] - first[1] * second[0];
            let end = moved(&flow, z);
            let normal = -LOG_TWO_PI - 0.5 * (end[0] * end[0] + end[1] * end[1]);
            let expected = normal + determinant.abs().ln();
            assert!((log_density(&flow, &latent) - expected).abs() < 1e-7, "{latent:?}");
        }
    }

    #[test]
    fn density_integrates_to_one_in_the_plane() {
        let (flow, step) = (flow(), 0.05);
        let mut scratch = flow.scratch();
        let axis = || (-240..240).map(|k| (f64::from(k) + 0.5) * step);
        let mut sum = 0.0;
        for x in axis() {
            for y in axis() {
                sum += flow.log_density(&[x as f32, y as f32], &mut scratch).exp() * step * step;
            }
        }
        assert!((sum - 1.0).abs() < 2e-3, "{sum}");
    }

    #[test]
    fn flow_that_moves_nothing_is_the_normal_density() {
        let flow = RadialFlow::new(&[0.5; 4], &[0.3; 1], &[0.3; 1]);
        let expected = -2.0 * LOG_TWO_PI - 0.5 * (1.0 + 4.0);
        assert!((log_density(&flow, &[1.0, 0.0, -2.0, 0.0]) - expected).abs() < 1e-12);
    }

    #[test]
    fn gradients_match_finite_differences() {
        let latents = [0.4f32, -0.5, 2.0, 1.0, -1.3, 0.2];
        let shapes: Vec<f32> = ALPHA.iter().chain(&BETA).copied().collect();
        let weights = [1.0f32, -0.5, 2.0];
        let variable = |values: &[f32], rows: usize| {
            Var::from_slice(values, (rows, values.len() / rows), &Device::Cpu).unwrap()
        };
        let inputs = [variable(&latents, 3), variable(&CENTRES, 3), variable(&shapes, 2)];
        let weighted = Tensor::from_slice(&weights, 3, &Device::Cpu).unwrap();
        let densities = inputs[0].apply_op3(&inputs[1], &inputs[2], LogDensity).unwrap();
        let gradients = (densities * weighted).unwrap().sum_all().unwrap().backward().unwrap();
        let value = |latents: &[f32], centres: &[f32], shapes: &[f32]| {
            let flow = LogDensity::flow(centres, shapes);
            let rows = latents.chunks_exact(2).zip(weights);
            rows.map(|(row, weight)| f64::from(weight) * log_density(&flow, row)).sum::<f64>()
        };
        let originals = [latents.to_vec(), CENTRES.to_vec(), shapes];
        for (which, input) in inputs.iter().enumerate() {
            let found = gradients.get(input).unwrap().flatten_all().unwrap().to_vec1::<f32>().unwrap();
            for place in 0..found.len() {
                let step = 1.0 / 1024.0;
                let at = |by: f32| {
                    let mut moved = originals.clone();
                    moved[which][place] += by;
                    value(&moved[0], &moved[1], &moved[2])
                };
                let slope = (at(step) - at(-step)) / f64::from(2.0 * step);
                let error = (f64::from(found[place]) - slope).abs();
                assert!(error < 2e-3 * slope.abs().max(0.3), "{which} {place}: {} {slope}", found[place]);
            }
        }
    }

    #[test]
    fn softplus_survives_large_arguments() {
        assert_eq!((softplus(800.0), softplus(-800.0)), (800.0, 0.0));
        assert!((softplus(0.0) - 2f64.ln()).abs() < 1e-15);
    }
}
