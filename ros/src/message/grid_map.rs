//! `grid_map_msgs`, and the arrays of `std_msgs` that its layers are.

use serde::{Deserialize, Serialize};

use super::{Header, Pose, named};

/// `std_msgs/MultiArrayDimension`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MultiArrayDimension {
    /// What it is called.
    pub label: String,
    /// Elements along it.
    pub size: u32,
    /// Elements of this dimension and those within it.
    pub stride: u32,
}

/// `std_msgs/MultiArrayLayout`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MultiArrayLayout {
    /// The outermost dimension first.
    pub dim: Vec<MultiArrayDimension>,
    /// Elements before the first.
    pub data_offset: u32,
}

/// `std_msgs/Float32MultiArray`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Float32MultiArray {
    /// How the elements lie.
    pub layout: MultiArrayLayout,
    /// The elements.
    pub data: Vec<f32>,
}

/// `grid_map_msgs/GridMapInfo`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GridMapInfo {
    /// Edge of a cell [m].
    pub resolution: f64,
    /// Length of the map along x [m].
    pub length_x: f64,
    /// Length of the map along y [m].
    pub length_y: f64,
    /// The middle of the map.
    pub pose: Pose,
}

/// `grid_map_msgs/GridMap`: the cell of the greatest x and y comes first, then those along falling x, then those along
/// falling y.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GridMap {
    /// Of when and which frame.
    pub header: Header,
    /// Where the cells lie.
    pub info: GridMapInfo,
    /// Names of the layers.
    pub layers: Vec<String>,
    /// Layers without which a cell is none.
    pub basic_layers: Vec<String>,
    /// The layers, in the order of their names.
    pub data: Vec<Float32MultiArray>,
    /// Place of the first cell along x.
    pub outer_start_index: u16,
    /// Place of the first cell along y.
    pub inner_start_index: u16,
}

named! {
    GridMap = "grid_map_msgs" / "GridMap";
}
