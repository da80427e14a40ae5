//! `visualization_msgs`, and what of other packages a marker holds.

use serde::{Deserialize, Serialize};

use super::{Header, Point, Pose, Vector3, named};

/// `std_msgs/ColorRGBA`, each in [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ColorRgba {
    /// Red.
    pub r: f32,
    /// Green.
    pub g: f32,
    /// Blue.
    pub b: f32,
    /// How little shows through.
    pub a: f32,
}

/// `builtin_interfaces/Duration`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Duration {
    /// Whole seconds [s].
    pub sec: i32,
    /// The rest [ns].
    pub nanosec: u32,
}

/// `sensor_msgs/CompressedImage`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct CompressedImage {
    /// Of when and which frame.
    pub header: Header,
    /// How it is compressed.
    pub format: String,
    /// Its bytes.
    #[serde(with = "serde_bytes")]
    pub data: Vec<u8>,
}

/// `visualization_msgs/UVCoordinate`, each in [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct UvCoordinate {
    /// Along the picture's width.
    pub u: f32,
    /// Along its height.
    pub v: f32,
}

/// `visualization_msgs/MeshFile`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MeshFile {
    /// Its name.
    pub filename: String,
    /// Its bytes.
    #[serde(with = "serde_bytes")]
    pub data: Vec<u8>,
}

/// `visualization_msgs/Marker`, as it is since ROS 2 Humble.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Marker {
    /// Of when and which frame.
    pub header: Header,
    /// What kind of thing it shows; together with the number it names the marker.
    pub ns: String,
    /// Its number among those.
    pub id: i32,
    /// Its shape: [`Marker::CYLINDER`] and so on.
    pub r#type: i32,
    /// 0 shows it, 2 takes it away, 3 takes all away.
    pub action: i32,
    /// Where it is.
    pub pose: Pose,
    /// How large it is [m]; of lines, x is the width.
    pub scale: Vector3,
    /// Its colour.
    pub color: ColorRgba,
    /// How long it is shown; 0 = for ever.
    pub lifetime: Duration,
    /// Whether it moves with its frame.
    pub frame_locked: bool,
    /// Corners of a line, in the frame of the pose [m].
    pub points: Vec<Point>,
    /// Their colours; none where all have the marker's.
    pub colors: Vec<ColorRgba>,
    /// Where a picture for it lies.
    pub texture_resource: String,
    /// The picture.
    pub texture: CompressedImage,
    /// Where corners lie in the picture.
    pub uv_coordinates: Vec<UvCoordinate>,
    /// What is written there.
    pub text: String,
    /// Where its mesh lies.
    pub mesh_resource: String,
    /// The mesh.
    pub mesh_file: MeshFile,
    /// Whether the mesh says what it is made of.
    pub mesh_use_embedded_materials: bool,
}

impl Marker {
    /// An arrow from the first of its points to the second.
    pub const ARROW: i32 = 0;
    /// An upright cylinder.
    pub const CYLINDER: i32 = 3;
    /// A line through all points.
    pub const LINE_STRIP: i32 = 4;
}

/// `visualization_msgs/MarkerArray`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MarkerArray {
    /// The markers.
    pub markers: Vec<Marker>,
}

named! {
    MarkerArray = "visualization_msgs" / "MarkerArray";
}
