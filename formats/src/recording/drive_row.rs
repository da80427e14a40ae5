//! A row of the drive log as a message: what was not measured is absent, what was is kept bit by bit.

use std::collections::BTreeMap;

use bicycle::{Column, DriveRow};
use foxglove::Encode;

/// Topic of the drive log.
pub(super) const TOPIC: &str = "/drive_log";

/// Defines the message from the columns in their order: the derived encoding numbers fields from 1.
macro_rules! drive_log_row {
    ($($field:ident: $column:ident),* $(,)?) => {
        #[derive(Debug, Encode)]
        pub(super) struct DriveLogRow {
            t: f64,
            run: String,
            $($field: Option<f64>,)*
        }

        impl DriveLogRow {
            pub(super) fn new(run: &str, row: &DriveRow) -> Self {
                let known = |column| Some(row.value(column)).filter(|value| !value.is_nan());
                Self { t: row.time_s, run: run.to_owned(), $($field: known(Column::$column),)* }
            }
        }

        #[cfg(test)]
        const FIELDS: &[(&str, Column)] = &[$((stringify!($field), Column::$column)),*];
    };
}

drive_log_row! {
    x: X, y: Y, z: Z,
    roll: Roll, pitch: Pitch, yaw: Yaw,
    vx: Vx, vy: Vy, wz: Wz,
    ax: Ax, ay: Ay, az: Az,
    cmd_speed: CmdSpeed, cmd_steer: CmdSteer, cmd_accel: CmdAccel,
    cmd_throttle: CmdThrottle, cmd_brake: CmdBrake,
    wheel_speed: WheelSpeed, steer_meas: SteerMeas,
    cmd_wz: CmdWz, wheel_wz: WheelWz,
    cmd_left: CmdLeft, cmd_right: CmdRight,
}

/// Where the drive log's fields stand in the messages of a recording, by the names that its own schema gives them: a
/// recording of a program with other columns, or in another order, is read for what it says.
pub struct Fields(BTreeMap<u64, Field>);

#[derive(Clone, Copy)]
enum Field {
    Time,
    Run,
    Column(Column),
}

impl Field {
    /// `None` for a name that this program does not know.
    fn named(name: &[u8]) -> Option<Self> {
        match name {
            b"t" => Some(Self::Time),
            b"run" => Some(Self::Run),
            name => Column::ALL.into_iter().find(|column| column.name().as_bytes() == name).map(Self::Column),
        }
    }
}

impl Fields {
    /// From a schema, a `FileDescriptorSet` of protobuf; `None` for other bytes and for messages without a time.
    pub fn of(schema: &[u8]) -> Option<Self> {
        // Numbers of the fields in protobuf's own descriptors: file, message, field, its name and its number.
        let file = part(schema, 1)?;
        let message = part(file, 4)?;
        let mut fields = BTreeMap::new();
        for (number, value) in Wire(message) {
            let (2, Value::Bytes(field)) = (number, value?) else { continue };
            let number = Wire(field).find_map(|(place, value)| match (place, value?) {
                (3, Value::Word(number)) => Some(number),
                _ => None,
            })?;
            fields.extend(Field::named(part(field, 1)?).map(|known| (number, known)));
        }
        let has_time = fields.values().any(|field| matches!(field, Field::Time));
        has_time.then_some(Self(fields))
    }

    /// Run and row of an encoded message; `None` when the bytes are none. Unknown fields are passed over.
    pub fn decode(&self, bytes: &[u8]) -> Option<(String, DriveRow)> {
        let (mut run, mut row) = (String::new(), DriveRow::new(0.0));
        for (number, value) in Wire(bytes) {
            match (self.0.get(&number), value?) {
                (Some(Field::Time), Value::Double(value)) => row.time_s = value,
                (Some(Field::Run), Value::Bytes(bytes)) => run = String::from_utf8(bytes.to_vec()).ok()?,
                (Some(Field::Column(column)), Value::Double(value)) => row = row.with(*column, value),
                (Some(_), _) => return None,
                (None, _) => {}
            }
        }
        Some((run, row))
    }
}

/// The first field of this number that holds bytes.
fn part(message: &[u8], number: u64) -> Option<&[u8]> {
    Wire(message).find_map(|(place, value)| match value? {
        Value::Bytes(bytes) if place == number => Some(bytes),
        _ => None,
    })
}

/// The protobuf wire format: number and value of field after field; `None` in place of a value ends it.
struct Wire<'a>(&'a [u8]);

enum Value<'a> {
    Word(u64),
    Double(f64),
    Bytes(&'a [u8]),
    /// Four bytes, which nothing here is.
    Short,
}

impl<'a> Iterator for Wire<'a> {
    type Item = (u64, Option<Value<'a>>);

    fn next(&mut self) -> Option<Self::Item> {
        if self.0.is_empty() {
            return None;
        }
        let (number, value) = match self.varint() {
            Some(key) => (key >> 3, self.value(key & 7)),
            None => (0, None),
        };
        if value.is_none() {
            self.0 = &[];
        }
        Some((number, value))
    }
}

impl<'a> Wire<'a> {
    fn value(&mut self, kind: u64) -> Option<Value<'a>> {
        match kind {
            0 => self.varint().map(Value::Word),
            1 => self.bytes(8)?.try_into().ok().map(|bytes| Value::Double(f64::from_le_bytes(bytes))),
            2 => {
                let length = usize::try_from(self.varint()?).ok()?;
                self.bytes(length).map(Value::Bytes)
            }
            5 => self.bytes(4).map(|_| Value::Short),
            _ => None,
        }
    }

    fn bytes(&mut self, n: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(n)?;
        self.0 = rest;
        Some(taken)
    }

    fn varint(&mut self) -> Option<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.bytes(1)?[0];
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Some(value);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A field that holds bytes, or a word.
    fn bytes_field(number: u8, bytes: &[u8]) -> Vec<u8> {
        [&[number << 3 | 2, bytes.len() as u8], bytes].concat()
    }

    /// The schema of a message with these fields, numbered from 1.
    fn schema_of(names: &[&str]) -> Vec<u8> {
        let field = |(place, name): (usize, &&str)| {
            let number = [3 << 3, place as u8 + 1];
            bytes_field(2, &[bytes_field(1, name.as_bytes()), number.to_vec()].concat())
        };
        let fields: Vec<u8> = names.iter().enumerate().flat_map(field).collect();
        bytes_field(1, &bytes_field(4, &fields))
    }

    #[test]
    fn the_message_has_every_column_in_order_under_its_name() {
        let expected: Vec<_> = Column::ALL.into_iter().map(|column| (column.name(), column)).collect();
        assert_eq!(FIELDS, expected);
        let schema = DriveLogRow::get_schema().unwrap();
        let fields = Fields::of(&schema.data).unwrap();
        assert_eq!(fields.0.len(), 2 + Column::ALL.len());
    }

    #[test]
    fn a_log_with_other_columns_in_another_order_is_read_by_its_names() {
        let fields = Fields::of(&schema_of(&["yaw", "tilt", "run", "t", "x"])).unwrap();
        let double = |number: u8, value: f64| [&[number << 3 | 1], &value.to_le_bytes()[..]].concat();
        let bytes = [double(1, 0.5), double(2, 9.0), bytes_field(3, b"b"), double(4, 7.0), double(5, -1.0)];
        let (run, row) = fields.decode(&bytes.concat()).unwrap();
        assert_eq!((run.as_str(), row.time_s), ("b", 7.0));
        assert_eq!((row.value(Column::Yaw), row.value(Column::X)), (0.5, -1.0));
        assert!(row.value(Column::Y).is_nan() && row.value(Column::Z).is_nan());
    }

    #[test]
    fn what_is_no_schema_of_a_log_is_none() {
        let whole = schema_of(&["t", "x"]);
        assert!(Fields::of(&whole).is_some());
        for length in 0..whole.len() {
            assert!(Fields::of(&whole[..length]).is_none(), "{length} bytes");
        }
        assert!(Fields::of(&schema_of(&["x", "y"])).is_none(), "without a time");
    }

    #[test]
    fn garbage_is_no_row() {
        let fields = Fields::of(&DriveLogRow::get_schema().unwrap().data).unwrap();
        for bytes in [&[0x09, 1, 2][..], &[0xff; 11], &[0x12, 200, 1], &[0x12, 1, 0xff], &[0x0b], &[0x0c]] {
            assert!(fields.decode(bytes).is_none(), "{bytes:?}");
        }
        // An unknown field of each kind is passed over: varint 100, bytes 101, fixed32 102, double 103.
        let strange = [0xa0, 6, 5, 0xaa, 6, 1, 9, 0xb5, 6, 0, 0, 0, 0, 0xb9, 6, 0, 0, 0, 0, 0, 0, 0, 0];
        assert_eq!(fields.decode(&strange).unwrap().0, "");
    }
}
