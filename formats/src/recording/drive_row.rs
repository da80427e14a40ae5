//! A row of the drive log as a message: what was not measured is absent, what was is kept bit by bit.

use bicycle::{Column, DriveRow};
use foxglove::Encode;

/// Topic of the drive log.
pub(super) const TOPIC: &str = "/drive_log";

/// Field number of the first column; `t` and `run` stand before.
const FIRST_COLUMN_FIELD: u64 = 3;

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

/// Run and row of an encoded message; `None` when the bytes are none. Unknown fields are passed over.
pub(super) fn decode(bytes: &[u8]) -> Option<(String, DriveRow)> {
    let (mut run, mut row) = (String::new(), DriveRow::new(0.0));
    let mut rest = Wire(bytes);
    while !rest.0.is_empty() {
        let key = rest.varint()?;
        match (key >> 3, key & 7) {
            (1, 1) => row.time_s = rest.double()?,
            (2, 2) => run = String::from_utf8(rest.delimited()?.to_vec()).ok()?,
            (field, 1) => {
                let value = rest.double()?;
                let place =
                    field.checked_sub(FIRST_COLUMN_FIELD).and_then(|place| usize::try_from(place).ok());
                if let Some(column) = place.and_then(|place| Column::ALL.get(place)) {
                    row = row.with(*column, value);
                }
            }
            (_, 0) => drop(rest.varint()?),
            (_, 2) => drop(rest.delimited()?),
            (_, 5) => drop(rest.bytes(4)?),
            _ => return None,
        }
    }
    Some((run, row))
}

/// The protobuf wire format.
struct Wire<'a>(&'a [u8]);

impl<'a> Wire<'a> {
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

    fn double(&mut self) -> Option<f64> {
        self.bytes(8)?.try_into().ok().map(f64::from_le_bytes)
    }

    fn delimited(&mut self) -> Option<&'a [u8]> {
        let length = usize::try_from(self.varint()?).ok()?;
        self.bytes(length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_message_has_every_column_in_order_under_its_name() {
        let expected: Vec<_> = Column::ALL.into_iter().map(|column| (column.name(), column)).collect();
        assert_eq!(FIELDS, expected);
    }

    #[test]
    fn garbage_is_no_row() {
        for bytes in [&[0x09, 1, 2][..], &[0xff; 11], &[0x12, 200, 1], &[0x12, 1, 0xff], &[0x0b], &[0x0c]] {
            assert!(decode(bytes).is_none(), "{bytes:?}");
        }
        // An unknown field of each kind is passed over: varint 100, bytes 101, fixed32 102, double 103.
        let strange = [0xa0, 6, 5, 0xaa, 6, 1, 9, 0xb5, 6, 0, 0, 0, 0, 0xb9, 6, 0, 0, 0, 0, 0, 0, 0, 0];
        assert_eq!(decode(&strange).unwrap().0, "");
    }
}
