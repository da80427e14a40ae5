//! What grounds look like from above: families of procedural textures, some of which no learner sees before its test.

use rand::RngExt;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::noise::{hash, noise, unit};

/// Red, green, blue, 0 to 1, in sRGB's order without its curve.
pub(super) type Colour = [f32; 3];

/// A family of textures of one ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct Texture {
    colour: Colour,
    /// Deviation of the brightness from pixel to pixel.
    grain: f32,
    /// Size of the brightness' slow changes, and how far they reach [m].
    blotch: f32,
    blotch_m: f64,
    /// Share of the pixels that are spots, and their colour.
    spots: f32,
    spot: Colour,
    /// Size of stripes, and their distance [m].
    stripe: f32,
    stripe_m: f64,
    /// Deviation of what a lidar sees of blades, stones and ripples below the plant's cells [m].
    relief_m: f32,
    direction_rad: f64,
}

/// Grain, blotches, their reach; spots; stripes, their distance; relief.
type Pattern = (f32, f32, f64, f32, f32, f64, f32);

const fn texture(colour: Colour, spot: Colour, pattern: Pattern) -> Texture {
    let (grain, blotch, blotch_m, spots, stripe, stripe_m, relief_m) = pattern;
    Texture { colour, grain, blotch, blotch_m, spots, spot, stripe, stripe_m, relief_m, direction_rad: 0.0 }
}

/// Families of each ground in the order of [`super::PAINTED_GROUNDS`]; the last of each is held out.
const FAMILIES: [[Texture; 4]; 7] = [
    [
        texture([0.27, 0.27, 0.29], [0.40, 0.40, 0.40], (0.04, 0.04, 9.0, 0.02, 0.00, 3.0, 0.004)),
        texture([0.38, 0.38, 0.39], [0.25, 0.25, 0.25], (0.03, 0.06, 14.0, 0.05, 0.03, 4.0, 0.005)),
        texture([0.48, 0.47, 0.46], [0.33, 0.33, 0.33], (0.05, 0.05, 6.0, 0.01, 0.04, 6.0, 0.004)),
        texture([0.33, 0.32, 0.34], [0.47, 0.46, 0.44], (0.06, 0.07, 4.0, 0.08, 0.05, 2.5, 0.005)),
    ],
    [
        texture([0.52, 0.49, 0.46], [0.33, 0.31, 0.30], (0.07, 0.14, 3.0, 0.12, 0.05, 2.5, 0.035)),
        texture([0.60, 0.53, 0.47], [0.40, 0.34, 0.30], (0.09, 0.11, 5.0, 0.08, 0.09, 4.0, 0.030)),
        texture([0.43, 0.43, 0.45], [0.60, 0.60, 0.60], (0.08, 0.16, 2.5, 0.10, 0.00, 3.0, 0.040)),
        texture([0.55, 0.50, 0.50], [0.36, 0.36, 0.33], (0.10, 0.12, 4.0, 0.16, 0.07, 1.8, 0.033)),
    ],
    [
        texture([0.47, 0.36, 0.25], [0.34, 0.26, 0.18], (0.06, 0.07, 6.0, 0.06, 0.00, 3.0, 0.018)),
        texture([0.53, 0.37, 0.26], [0.62, 0.52, 0.42], (0.05, 0.09, 9.0, 0.08, 0.04, 2.0, 0.020)),
        texture([0.42, 0.34, 0.25], [0.52, 0.45, 0.36], (0.07, 0.05, 4.0, 0.10, 0.03, 5.0, 0.016)),
        texture([0.50, 0.35, 0.23], [0.38, 0.33, 0.27], (0.08, 0.10, 3.5, 0.12, 0.05, 3.5, 0.019)),
    ],
    [
        texture([0.25, 0.42, 0.16], [0.48, 0.52, 0.24], (0.08, 0.08, 5.0, 0.06, 0.00, 3.0, 0.055)),
        texture([0.34, 0.47, 0.20], [0.20, 0.32, 0.12], (0.10, 0.11, 3.0, 0.12, 0.00, 3.0, 0.065)),
        texture([0.42, 0.50, 0.25], [0.60, 0.58, 0.35], (0.07, 0.07, 8.0, 0.08, 0.06, 2.5, 0.045)),
        texture([0.30, 0.40, 0.22], [0.52, 0.46, 0.24], (0.12, 0.10, 4.0, 0.15, 0.04, 4.0, 0.060)),
    ],
    [
        texture([0.26, 0.20, 0.14], [0.38, 0.34, 0.30], (0.04, 0.10, 3.0, 0.05, 0.00, 3.0, 0.012)),
        texture([0.32, 0.24, 0.16], [0.22, 0.18, 0.14], (0.05, 0.08, 5.0, 0.10, 0.07, 1.6, 0.016)),
        texture([0.22, 0.19, 0.16], [0.36, 0.30, 0.22], (0.03, 0.12, 4.0, 0.04, 0.04, 2.2, 0.010)),
        texture([0.30, 0.22, 0.17], [0.44, 0.38, 0.32], (0.06, 0.11, 2.5, 0.09, 0.05, 2.8, 0.014)),
    ],
    [
        texture([0.80, 0.70, 0.50], [0.68, 0.58, 0.40], (0.03, 0.05, 10.0, 0.02, 0.05, 2.0, 0.010)),
        texture([0.72, 0.60, 0.42], [0.82, 0.74, 0.58], (0.04, 0.06, 7.0, 0.04, 0.07, 3.0, 0.012)),
        texture([0.84, 0.77, 0.62], [0.72, 0.64, 0.50], (0.02, 0.04, 12.0, 0.03, 0.03, 1.6, 0.008)),
        texture([0.76, 0.67, 0.45], [0.62, 0.54, 0.40], (0.05, 0.08, 5.0, 0.06, 0.08, 2.4, 0.011)),
    ],
    [
        texture([0.80, 0.86, 0.92], [0.92, 0.95, 0.98], (0.02, 0.05, 8.0, 0.04, 0.00, 3.0, 0.002)),
        texture([0.68, 0.78, 0.86], [0.85, 0.90, 0.95], (0.02, 0.08, 5.0, 0.06, 0.05, 4.0, 0.003)),
        texture([0.88, 0.91, 0.94], [0.72, 0.80, 0.88], (0.03, 0.04, 11.0, 0.03, 0.02, 6.0, 0.002)),
        texture([0.73, 0.80, 0.85], [0.60, 0.70, 0.78], (0.04, 0.07, 4.0, 0.09, 0.04, 3.0, 0.003)),
    ],
];

/// Which textures, light and season.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Looks {
    /// Those that a learner may see: three families a ground, usual light, spring to late summer.
    Known,
    /// Others: the fourth family of each ground, dimmer or brighter light of another tint, autumn.
    HeldOut,
}

impl Texture {
    /// The family that a world has of a ground, and its own variant of it.
    pub(super) fn drawn(ground: usize, looks: Looks, rng: &mut Xoshiro256PlusPlus) -> Self {
        let family = match looks {
            Looks::Known => rng.random_range(0..3),
            Looks::HeldOut => 3,
        };
        let mut texture = FAMILIES[ground][family];
        let mut about = |value: f32, by: f32| value * (1.0 + by * rng.random_range(-1.0..1.0));
        texture.colour = texture.colour.map(|part| about(part, 0.06));
        texture.spot = texture.spot.map(|part| about(part, 0.06));
        texture.grain = about(texture.grain, 0.3);
        texture.blotch = about(texture.blotch, 0.3);
        texture.stripe = about(texture.stripe, 0.3);
        texture.relief_m = about(texture.relief_m, 0.3);
        texture.direction_rad = rng.random_range(0.0..std::f64::consts::PI);
        texture
    }

    /// Colour of a pixel, given the numbers of its column and row.
    pub(super) fn colour(&self, seed: u64, at_m: [f64; 2], pixel: [u64; 2]) -> Colour {
        let random = |key: u64| unit(hash(seed ^ key, pixel));
        let blotch = noise(seed ^ 1, at_m, self.blotch_m) as f32;
        let (sin, cos) = self.direction_rad.sin_cos();
        let along_m = at_m[0] * cos + at_m[1] * sin + noise(seed ^ 2, at_m, 6.0);
        let stripe = (std::f64::consts::TAU * along_m / self.stripe_m).sin() as f32;
        let grain = 1.7 * (random(3) + random(4) - 1.0) * 1.5;
        let brightness = 1.0 + self.blotch * blotch + self.stripe * stripe + self.grain * grain;
        let base = if random(5) < self.spots { self.spot } else { self.colour };
        base.map(|part| part * brightness)
    }

    /// What a lidar sees above the ground [m].
    pub(super) fn relief_m(&self, seed: u64, pixel: [u64; 2]) -> f32 {
        let random = |key: u64| unit(hash(seed ^ key, pixel));
        2.4 * self.relief_m * (random(6) + random(7) - 1.0)
    }
}

/// Light and season over a world.
#[derive(Clone, Copy, Debug)]
pub(super) struct Light {
    tint: Colour,
    /// Share of what grows that has turned.
    autumn: f32,
}

/// What turned grass looks like.
const STRAW: Colour = [0.62, 0.54, 0.30];
/// Of the grounds, which grow.
const GRASS: usize = 3;

impl Light {
    pub(super) fn drawn(looks: Looks, rng: &mut Xoshiro256PlusPlus) -> Self {
        let (gains, tints, seasons) = match looks {
            Looks::Known => ([0.85..1.0, 1.0..1.15], -0.03..0.03, 0.0..0.25),
            Looks::HeldOut => ([0.7..0.85, 1.15..1.25], 0.03..0.06, 0.25..0.45),
        };
        let is_bright = usize::from(rng.random_bool(0.5));
        let gain: f32 = rng.random_range(gains[is_bright].clone());
        let tint: f32 = rng.random_range(tints);
        Self { tint: [gain * (1.0 + tint), gain, gain * (1.0 - tint)], autumn: rng.random_range(seasons) }
    }

    /// A pixel under this light.
    pub(super) fn on(&self, ground: usize, colour: Colour) -> Colour {
        let turned = if ground == GRASS { self.autumn } else { 0.0 };
        std::array::from_fn(|i| {
            (self.tint[i] * (colour[i] + turned * (STRAW[i] - colour[i]))).clamp(0.0, 1.0)
        })
    }
}
