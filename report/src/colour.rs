//! Colours and colour ramps of the pictures.

/// An sRGB colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Rgb(pub u8, pub u8, pub u8);

impl Rgb {
    pub(super) const WHITE: Self = Self(255, 255, 255);
    /// Text, axes and outlines.
    pub(super) const INK: Self = Self(0x1b, 0x22, 0x30);
    /// Second-rank text.
    pub(super) const INK_SOFT: Self = Self(0x5a, 0x64, 0x74);
    /// Grid lines.
    pub(super) const RULE: Self = Self(0xd9, 0xde, 0xe5);
    pub(super) const VEGETATION: Self = Self(0x3c, 0x8a, 0x3f);
    pub(super) const OBSTACLE: Self = Self(0x3b, 0x3f, 0x4a);
    /// Ground that was never seen fades towards this.
    pub(super) const UNSEEN: Self = Self(0xdf, 0xe4, 0xea);
    /// Ground unlike anything in the training data.
    pub(super) const UNFAMILIAR: Self = Self(0x6a, 0x2c, 0x91);
    pub(super) const GOAL: Self = Self(0xff, 0xc4, 0x2e);
    pub(super) const WALKER: Self = Self(0xb0, 0x12, 0x8f);
    pub(super) const FAILURE: Self = Self(0xd6, 0x1f, 0x3a);
    pub(super) const ROLL: Self = Self(0x1f, 0x6f, 0xd1);
    pub(super) const PITCH: Self = Self(0xd9, 0x6a, 0x0b);

    /// This colour with `share` in [0, 1] of another laid over it.
    pub(super) fn blend(self, over: Self, share: f32) -> Self {
        let mix = |below: u8, above: u8| {
            (f32::from(below) + (f32::from(above) - f32::from(below)) * share.clamp(0.0, 1.0)).round() as u8
        };
        Self(mix(self.0, over.0), mix(self.1, over.1), mix(self.2, over.2))
    }

    /// This colour in more or less light; 1 leaves it.
    pub(super) fn lit(self, light: f32) -> Self {
        let scale = |channel: u8| (f32::from(channel) * light).clamp(0.0, 255.0).round() as u8;
        Self(scale(self.0), scale(self.1), scale(self.2))
    }
}

/// Colours at equal distances from 0 to 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ramp(&'static [Rgb]);

impl Ramp {
    /// Ground, low to high.
    pub(super) const GROUND: Self =
        Self(&[Rgb(0xb3, 0xa5, 0x8a), Rgb(0xc9, 0xbb, 0x9c), Rgb(0xde, 0xcf, 0xb0), Rgb(0xf0, 0xe8, 0xd8)]);
    /// Risk, none to worst. Warm, so that it stands apart from the cold colours of speed.
    pub(super) const RISK: Self = Self(&[
        Rgb(0xff, 0xee, 0xa3),
        Rgb(0xfd, 0xb8, 0x4a),
        Rgb(0xf0, 0x6a, 0x2f),
        Rgb(0xc4, 0x1e, 0x3d),
        Rgb(0x6d, 0x0a, 0x4e),
    ]);
    /// Speed, slow to fast.
    pub(super) const SPEED: Self = Self(&[
        Rgb(0x2b, 0x1a, 0x78),
        Rgb(0x1d, 0x5f, 0xc9),
        Rgb(0x19, 0xb4, 0xea),
        Rgb(0x7d, 0xf0, 0xe0),
        Rgb(0xf4, 0xff, 0xf2),
    ]);

    /// The colour at `share` of the way; beyond the ends the end's.
    pub(super) fn at(self, share: f32) -> Rgb {
        let last = self.0.len() - 1;
        let place = if share.is_finite() { share.clamp(0.0, 1.0) * last as f32 } else { 0.0 };
        let below = (place as usize).min(last);
        self.0[below].blend(self.0[(below + 1).min(last)], place - below as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ramp_meets_its_colours_and_lies_halfway_between_them() {
        let ramp = Ramp(&[Rgb(0, 0, 0), Rgb(100, 50, 200), Rgb(200, 150, 0)]);
        assert_eq!(ramp.at(0.0), Rgb(0, 0, 0));
        assert_eq!(ramp.at(0.5), Rgb(100, 50, 200));
        assert_eq!(ramp.at(0.25), Rgb(50, 25, 100));
        assert_eq!(ramp.at(1.0), Rgb(200, 150, 0));
    }

    #[test]
    fn ramp_holds_its_ends_and_survives_what_is_no_number() {
        let ramp = Ramp(&[Rgb(1, 2, 3), Rgb(9, 9, 9)]);
        assert_eq!((ramp.at(-5.0), ramp.at(7.0)), (Rgb(1, 2, 3), Rgb(9, 9, 9)));
        assert_eq!(ramp.at(f32::NAN), Rgb(1, 2, 3));
    }

    #[test]
    fn blending_all_or_nothing_gives_one_of_the_two() {
        let (below, over) = (Rgb(10, 20, 30), Rgb(200, 100, 0));
        assert_eq!((below.blend(over, 0.0), below.blend(over, 1.0)), (below, over));
        assert_eq!(below.blend(over, 0.5), Rgb(105, 60, 15));
    }
}
