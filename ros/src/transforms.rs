//! Where frames lie against one another, as `/tf` and `/tf_static` tell it.
//!
//! A transform of a frame takes points of the frame to its parent. Times are those of the stamps [ns], on whatever clock
//! the robot has.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::Isometry3;

/// Frames that are kept at the most; a robot has some fifty.
const FRAMES_MAX: usize = 1024;
/// Samples of one moving frame that are kept.
const SAMPLES_MAX: usize = 512;
/// Longest way to the root.
const DEPTH_MAX: usize = 64;

/// Why a place cannot be told in another frame. Every message is one line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TransformError {
    /// Nobody has told of a way from one to the other.
    #[error("frame {from:?}: expected transforms on /tf or /tf_static that join it to {to:?}, found none")]
    Unjoined {
        /// The frame of the message.
        from: String,
        /// The frame that it is to be told in.
        to: String,
    },
    /// A transform on the way is too old.
    #[error(
        "frame {frame:?}: expected a transform on /tf at most {age_max_s:.2} s away from the message, found one {age_s:.2} s \
         away"
    )]
    Stale {
        /// The frame whose place is known only of another time.
        frame: String,
        /// How far away it is [s].
        age_s: f64,
        /// How far away it may be [s].
        age_max_s: f64,
    },
    /// The frames follow one another in a circle, or in too long a row.
    #[error(
        "frame {from:?}: expected a tree of at most {DEPTH_MAX} frames up to its root, found more or a circle"
    )]
    TooDeep {
        /// The frame of the message.
        from: String,
    },
}

/// The tree of frames.
#[derive(Clone, Debug)]
pub struct Transforms {
    age_max_ns: u64,
    frames: BTreeMap<String, Frame>,
}

/// A frame below another one.
#[derive(Clone, Debug)]
struct Frame {
    parent: String,
    place: Place,
}

#[derive(Clone, Debug)]
enum Place {
    Fixed(Isometry3<f64>),
    /// By the times of their stamps, in order.
    Moving(VecDeque<(i64, Isometry3<f64>)>),
}

impl Transforms {
    /// A tree without frames, whose moving ones may be told of up to `age_max_ns` away from the time that is asked for.
    pub fn new(age_max_ns: u64) -> Self {
        Self { age_max_ns, frames: BTreeMap::new() }
    }

    /// Takes over where a frame stays for good. A frame too many is left out.
    pub fn fix(&mut self, parent: &str, child: &str, transform: Isometry3<f64>) {
        self.set(parent, child, |frame| frame.place = Place::Fixed(transform));
    }

    /// Takes over where a frame lies at a time. What comes out of order is put in its place.
    pub fn place(&mut self, parent: &str, child: &str, at_ns: i64, transform: Isometry3<f64>) {
        self.set(parent, child, |frame| match &mut frame.place {
            Place::Moving(samples) => insert(samples, at_ns, transform),
            place @ Place::Fixed(_) => *place = Place::Moving(VecDeque::from([(at_ns, transform)])),
        });
    }

    /// Forgets where moving frames were: their clock has jumped.
    pub fn forget_moving(&mut self) {
        self.frames.retain(|_, frame| matches!(frame.place, Place::Fixed(_)));
    }

    fn set(&mut self, parent: &str, child: &str, change: impl FnOnce(&mut Frame)) {
        let (parent, child) = (plain(parent), plain(child));
        let is_known = self.frames.get(child).is_some_and(|frame| frame.parent == parent);
        if !is_known {
            if self.frames.len() >= FRAMES_MAX && !self.frames.contains_key(child) {
                return;
            }
            // A frame that has changed its parent has no past below the new one.
            let fresh = Frame { parent: parent.to_owned(), place: Place::Moving(VecDeque::new()) };
            self.frames.insert(child.to_owned(), fresh);
        }
        self.frames.get_mut(child).map(change);
    }

    /// What takes points of one frame to another at a time.
    ///
    /// # Errors
    /// The frames are not joined, not a tree, or a transform is too far away in time.
    pub fn between(&self, from: &str, to: &str, at_ns: i64) -> Result<Isometry3<f64>, TransformError> {
        self.find(from, to, Some(at_ns))
    }

    /// The same by where frames were told to lie last, whenever that was.
    ///
    /// # Errors
    /// The frames are not joined, or not a tree.
    pub fn latest(&self, from: &str, to: &str) -> Result<Isometry3<f64>, TransformError> {
        self.find(from, to, None)
    }

    fn find(&self, from: &str, to: &str, at_ns: Option<i64>) -> Result<Isometry3<f64>, TransformError> {
        let (from, to) = (plain(from), plain(to));
        let up = self.up(from)?;
        let down = self.up(to)?;
        let meeting = up.iter().find(|frame| down.contains(frame));
        let meeting =
            *meeting.ok_or_else(|| TransformError::Unjoined { from: from.into(), to: to.into() })?;
        Ok(self.climb(to, meeting, at_ns)?.inverse() * self.climb(from, meeting, at_ns)?)
    }

    /// The frame and all above it, up to the root.
    fn up<'a>(&'a self, from: &'a str) -> Result<Vec<&'a str>, TransformError> {
        let mut way = vec![from];
        let mut frame = from;
        while let Some(Frame { parent, .. }) = self.frames.get(frame) {
            if way.len() == DEPTH_MAX {
                return Err(TransformError::TooDeep { from: from.to_owned() });
            }
            frame = parent;
            way.push(frame);
        }
        Ok(way)
    }

    /// From a frame up to one above it.
    fn climb(&self, from: &str, to: &str, at_ns: Option<i64>) -> Result<Isometry3<f64>, TransformError> {
        let (mut frame, mut total) = (from, Isometry3::identity());
        while frame != to {
            // Whoever asks has been up here.
            let Some(Frame { parent, place }) = self.frames.get(frame) else { break };
            total = self.at(frame, place, at_ns)? * total;
            frame = parent;
        }
        Ok(total)
    }

    fn at(&self, frame: &str, place: &Place, at_ns: Option<i64>) -> Result<Isometry3<f64>, TransformError> {
        let samples = match place {
            Place::Fixed(transform) => return Ok(*transform),
            Place::Moving(samples) => samples,
        };
        let newest_ns = || samples.back().map_or(0, |(sample_ns, _)| *sample_ns);
        let at_ns = at_ns.unwrap_or_else(newest_ns);
        let after = samples.partition_point(|(sample_ns, _)| *sample_ns < at_ns);
        let (before, after) = (after.checked_sub(1).and_then(|k| samples.get(k)), samples.get(after));
        if let (Some((before_ns, before)), Some((after_ns, after))) = (before, after) {
            return Ok(blend(before, after, share(*before_ns, *after_ns, at_ns)));
        }
        // A frame has one sample at least.
        let nearest = before.or(after).map(|(sample_ns, transform)| (sample_ns.abs_diff(at_ns), *transform));
        let (age_ns, transform) = nearest.unwrap_or((u64::MAX, Isometry3::identity()));
        if age_ns <= self.age_max_ns {
            return Ok(transform);
        }
        let [age_s, age_max_s] = [age_ns, self.age_max_ns].map(|ns| ns as f64 * 1e-9);
        Err(TransformError::Stale { frame: frame.to_owned(), age_s, age_max_s })
    }
}

/// Names may begin with a slash, as those of ROS 1 did.
fn plain(frame: &str) -> &str {
    frame.strip_prefix('/').unwrap_or(frame)
}

fn insert(samples: &mut VecDeque<(i64, Isometry3<f64>)>, at_ns: i64, transform: Isometry3<f64>) {
    let place = samples.partition_point(|(sample_ns, _)| *sample_ns < at_ns);
    match samples.get_mut(place) {
        Some(sample) if sample.0 == at_ns => sample.1 = transform,
        _ => samples.insert(place, (at_ns, transform)),
    }
    if samples.len() > SAMPLES_MAX {
        samples.pop_front();
    }
}

/// How far a time lies on the way from one to another, 0 to 1.
fn share(before_ns: i64, after_ns: i64, at_ns: i64) -> f64 {
    at_ns.abs_diff(before_ns) as f64 / after_ns.abs_diff(before_ns).max(1) as f64
}

fn blend(before: &Isometry3<f64>, after: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
    // Opposite attitudes have no way between them: the nearer one counts.
    before.try_lerp_slerp(after, share, 1e-9).unwrap_or(if share < 0.5 { *before } else { *after })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Translation3, UnitQuaternion};

    const SECOND_NS: i64 = 1_000_000_000;

    fn turned(x_m: f64, yaw_rad: f64) -> Isometry3<f64> {
        let rotation = UnitQuaternion::from_euler_angles(0.0, 0.0, yaw_rad);
        Isometry3::from_parts(Translation3::new(x_m, 0.0, 0.0), rotation)
    }

    fn close(motion: &Isometry3<f64>, from_m: [f64; 3], to_m: [f64; 3]) {
        let there = motion * Point3::from(from_m);
        assert!((there - Point3::from(to_m)).norm() < 1e-12, "{there} instead of {to_m:?}");
    }

    #[test]
    fn ways_lead_up_and_down_the_tree() {
        let mut tree = Transforms::new(0);
        tree.fix("base", "mast", Isometry3::translation(0.0, 0.0, 1.0));
        tree.fix("mast", "lidar", turned(0.5, std::f64::consts::FRAC_PI_2));
        tree.fix("base", "camera", Isometry3::translation(1.0, 0.0, 0.0));
        // Ahead of the lidar is left of the mast, half a metre ahead of it and a metre up.
        close(&tree.between("lidar", "base", 0).unwrap(), [2.0, 0.0, 0.0], [0.5, 2.0, 1.0]);
        close(&tree.between("lidar", "camera", 0).unwrap(), [2.0, 0.0, 0.0], [-0.5, 2.0, 1.0]);
        close(&tree.between("base", "lidar", 0).unwrap(), [0.5, 2.0, 1.0], [2.0, 0.0, 0.0]);
        close(&tree.between("/lidar", "lidar", 0).unwrap(), [1.0, 2.0, 3.0], [1.0, 2.0, 3.0]);
    }

    #[test]
    fn between_two_times_a_frame_is_on_the_way() {
        let mut tree = Transforms::new(SECOND_NS as u64 / 2);
        tree.place("map", "odom", 3 * SECOND_NS, turned(4.0, 0.4));
        tree.place("map", "odom", SECOND_NS, turned(2.0, 0.0));
        let halfway = tree.between("odom", "map", 2 * SECOND_NS).unwrap();
        assert!((halfway.translation.x - 3.0).abs() < 1e-12);
        assert!((halfway.rotation.euler_angles().2 - 0.2).abs() < 1e-12);
        let soon = tree.between("odom", "map", 3 * SECOND_NS + SECOND_NS / 2).unwrap();
        assert!((soon.translation.x - 4.0).abs() < 1e-12, "as it was last");
        let stale = tree.between("odom", "map", 4 * SECOND_NS).unwrap_err();
        assert_eq!(stale, TransformError::Stale { frame: "odom".into(), age_s: 1.0, age_max_s: 0.5 });
        assert!((tree.latest("odom", "map").unwrap().translation.x - 4.0).abs() < 1e-12);
        tree.forget_moving();
        assert!(matches!(tree.latest("odom", "map"), Err(TransformError::Unjoined { .. })));
    }

    #[test]
    fn frames_that_nobody_joins_and_circles_are_refused() {
        let mut tree = Transforms::new(0);
        tree.fix("base", "lidar", Isometry3::identity());
        let told = tree.between("lidar", "map", 0).unwrap_err().to_string();
        assert_eq!(
            told,
            "frame \"lidar\": expected transforms on /tf or /tf_static that join it to \"map\", found none"
        );
        tree.fix("lidar", "base", Isometry3::identity());
        assert!(matches!(tree.between("lidar", "map", 0), Err(TransformError::TooDeep { .. })));
    }

    #[test]
    fn a_frame_that_changes_its_parent_lies_below_the_new_one_only() {
        let mut tree = Transforms::new(0);
        tree.place("odom", "base", SECOND_NS, turned(1.0, 0.0));
        tree.place("map", "base", 2 * SECOND_NS, turned(7.0, 0.0));
        assert!((tree.latest("base", "map").unwrap().translation.x - 7.0).abs() < 1e-12);
        assert!(tree.latest("base", "odom").is_err());
    }

    #[test]
    fn what_is_kept_is_bounded() {
        let mut tree = Transforms::new(0);
        for k in 0..2 * FRAMES_MAX {
            tree.fix("map", &format!("frame{k}"), Isometry3::identity());
        }
        assert_eq!(tree.frames.len(), FRAMES_MAX);
        for k in 0..2 * SAMPLES_MAX as i64 {
            tree.place("map", "frame1", k, Isometry3::identity());
        }
        let Place::Moving(samples) = &tree.frames["frame1"].place else { panic!("it moves") };
        assert_eq!((samples.len(), samples[0].0), (SAMPLES_MAX, SAMPLES_MAX as i64));
    }
}
