//! Where the numbers of a cloud's points lie.

use byteorder::{BigEndian, ByteOrder, LittleEndian};

use crate::message::{PointCloud2, PointField};

/// Longest that a sweep is believed to last [s].
pub(super) const OFFSET_MAX_S: f64 = 1.0;
/// Points of a cloud at the most: some ten times what the largest sensors send.
const POINTS_MAX: usize = 1 << 24;

/// Why a cloud cannot be read. Every message is one line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LayoutError {
    /// A field is missing.
    #[error("fields: expected one named {expected:?}, found {}", names(.found))]
    NoField {
        /// What it has to be called.
        expected: String,
        /// What there is.
        found: Vec<String>,
    },
    /// A field is of no kind of number, or of several.
    #[error("field {name:?}: expected one number of datatype 1 to 8, found {count} of datatype {datatype}")]
    Kind {
        /// Its name.
        name: String,
        /// What it says.
        datatype: u8,
        /// How many of them.
        count: u32,
    },
    /// A field reaches beyond its point.
    #[error("field {name:?}: expected to end within the {step} bytes of a point, found it to end at {end}")]
    Beyond {
        /// Its name.
        name: String,
        /// Bytes of a point.
        step: u32,
        /// Where it ends.
        end: u64,
    },
    /// Rows are shorter than their points.
    #[error("row_step: expected at least {expected} for {width} points of {step} bytes, found {found}")]
    Row {
        /// Bytes that the points take.
        expected: u64,
        /// Points of a row.
        width: u32,
        /// Bytes of a point.
        step: u32,
        /// What it says.
        found: u32,
    },
    /// The data are shorter than the rows.
    #[error("data: expected {expected} bytes for {height} rows of {row} bytes, found {found}")]
    Short {
        /// Bytes that the rows take.
        expected: u64,
        /// Rows.
        height: u32,
        /// Bytes of a row.
        row: u32,
        /// What there is.
        found: usize,
    },
    /// Points have a time of another sweep.
    #[error(
        "field {name:?}: expected times within {OFFSET_MAX_S} s of the stamp, found one {offset_s:e} s away: are unit_s and \
         counts_from right?"
    )]
    Time {
        /// Its name.
        name: String,
        /// How far away it is [s].
        offset_s: f64,
    },
    /// More points than anybody measures.
    #[error("width x height: expected at most {POINTS_MAX} points, found {found}")]
    TooMany {
        /// How many it says.
        found: u64,
    },
}

fn names(found: &[String]) -> String {
    if found.is_empty() { "none".to_owned() } else { found.join(", ") }
}

/// A number of every point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Number {
    offset: usize,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    fn of(datatype: u8) -> Option<Self> {
        let all = [Self::I8, Self::U8, Self::I16, Self::U16, Self::I32, Self::U32, Self::F32, Self::F64];
        all.get(usize::from(datatype).wrapping_sub(1)).copied()
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The number that the bytes begin with.
    #[inline]
    fn read<Order: ByteOrder>(self, bytes: &[u8]) -> f64 {
        match self {
            Self::I8 => f64::from(bytes[0] as i8),
            Self::U8 => f64::from(bytes[0]),
            Self::I16 => f64::from(Order::read_i16(bytes)),
            Self::U16 => f64::from(Order::read_u16(bytes)),
            Self::I32 => f64::from(Order::read_i32(bytes)),
            Self::U32 => f64::from(Order::read_u32(bytes)),
            Self::F32 => f64::from(Order::read_f32(bytes)),
            Self::F64 => Order::read_f64(bytes),
        }
    }
}

/// A point as it stands in a cloud.
pub(super) struct Read {
    /// Its place [m].
    pub position_m: [f32; 3],
    /// What it is of, in numbers of the cloud.
    pub label: Option<i64>,
    /// When it was measured, in numbers of the cloud.
    pub time: Option<f64>,
}

/// Where the places of a cloud's points lie, their labels and their times; everything lies within its data.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    axes: [Number; 3],
    /// Whether the axes are little-endian floats of four bytes.
    is_plain: bool,
    label: Option<Number>,
    time: Option<Number>,
    width: usize,
    height: usize,
    point_step: usize,
    row_step: usize,
    is_bigendian: bool,
}

impl Layout {
    /// The layout of a cloud, with the fields of these names as label and as time.
    pub(super) fn new(
        cloud: &PointCloud2,
        label: Option<&str>,
        time: Option<&str>,
    ) -> Result<Self, LayoutError> {
        let number = |name: &str| number(cloud, name);
        let axes = [number("x")?, number("y")?, number("z")?];
        let layout = Self {
            axes,
            is_plain: !cloud.is_bigendian && axes.iter().all(|axis| axis.kind == Kind::F32),
            label: label.map(number).transpose()?,
            time: time.map(number).transpose()?,
            width: cloud.width as usize,
            height: cloud.height as usize,
            point_step: cloud.point_step as usize,
            row_step: cloud.row_step as usize,
            is_bigendian: cloud.is_bigendian,
        };
        check_size(cloud)?;
        Ok(layout)
    }

    pub(super) fn n_points(&self) -> usize {
        self.width * self.height
    }

    /// Every so many-th point, row by row.
    pub(super) fn points<'a>(&'a self, data: &'a [u8], stride: usize) -> impl Iterator<Item = Read> + 'a {
        let of_row = self.width * self.point_step;
        // By the data, not by the number of rows, which may be anything where they have no points.
        let rows = data.chunks(self.row_step.max(1)).take(self.height).enumerate();
        let points = rows.flat_map(move |(row, bytes)| {
            let first = (row * self.width).next_multiple_of(stride) - row * self.width;
            bytes[..of_row].chunks_exact(self.point_step).skip(first).step_by(stride)
        });
        points.map(|point| self.read(point))
    }

    #[inline]
    fn read(&self, point: &[u8]) -> Read {
        let read = |number: Number| self.number(point, number);
        let [x, y, z] = self.axes;
        // What nearly every sensor sends is read without asking of each number what it is.
        let position_m = if self.is_plain {
            let float = |axis: Number| LittleEndian::read_f32(&point[axis.offset..]);
            [float(x), float(y), float(z)]
        } else {
            [read(x) as f32, read(y) as f32, read(z) as f32]
        };
        // A label is a whole number: what is none is that of nothing.
        Read { position_m, label: self.label.map(|label| read(label) as i64), time: self.time.map(read) }
    }

    #[inline]
    fn number(&self, point: &[u8], Number { offset, kind }: Number) -> f64 {
        let bytes = &point[offset..];
        if self.is_bigendian { kind.read::<BigEndian>(bytes) } else { kind.read::<LittleEndian>(bytes) }
    }
}

fn number(cloud: &PointCloud2, name: &str) -> Result<Number, LayoutError> {
    let Some(field) = cloud.fields.iter().find(|field| field.name == name) else {
        let found = cloud.fields.iter().map(|field| field.name.clone()).collect();
        return Err(LayoutError::NoField { expected: name.to_owned(), found });
    };
    let PointField { offset, datatype, count, .. } = *field;
    // Some drivers say 0 where they mean one.
    let kind = Kind::of(datatype).filter(|_| count <= 1);
    let kind = kind.ok_or_else(|| LayoutError::Kind { name: name.to_owned(), datatype, count })?;
    let end = u64::from(offset) + kind.size() as u64;
    if end > u64::from(cloud.point_step) {
        return Err(LayoutError::Beyond { name: name.to_owned(), step: cloud.point_step, end });
    }
    Ok(Number { offset: offset as usize, kind })
}

/// Everything that the numbers say lies within the data.
fn check_size(cloud: &PointCloud2) -> Result<(), LayoutError> {
    let PointCloud2 { width, height, point_step: step, row_step: row, .. } = *cloud;
    let n_points = u64::from(width) * u64::from(height);
    if n_points > POINTS_MAX as u64 {
        return Err(LayoutError::TooMany { found: n_points });
    }
    let of_row = u64::from(width) * u64::from(step);
    if u64::from(row) < of_row {
        return Err(LayoutError::Row { expected: of_row, width, step, found: row });
    }
    // The last row may leave out what lies behind its points.
    let expected = u64::from(height.saturating_sub(1)) * u64::from(row) + if height > 0 { of_row } else { 0 };
    if (cloud.data.len() as u64) < expected {
        return Err(LayoutError::Short { expected, height, row, found: cloud.data.len() });
    }
    Ok(())
}
