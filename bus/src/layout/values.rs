//! The numbers of a record, read from its bytes by its layout.

use super::{RecordLayout, Scalar};

/// One number of a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A measured number.
    Number(f64),
    /// A count, or a time [ns].
    Count(u64),
}

/// The numbers of a record with their names: those of a record within behind its name and a dot, those of an array behind
/// its name and their place. `layouts` holds the records that it is made of. `None` for bytes of another length.
pub fn values(layout: &RecordLayout, layouts: &[RecordLayout], bytes: &[u8]) -> Option<Vec<(String, Value)>> {
    if bytes.len() != layout.size {
        return None;
    }
    let mut named = Vec::new();
    for field in &layout.fields {
        for place in 0..field.count {
            let own =
                if field.count == 1 { field.name.to_owned() } else { format!("{}_{place}", field.name) };
            let rest = |size: usize| bytes.get(field.offset + place * size..)?.get(..size);
            match field.scalar {
                Scalar::F32 => named.push((own, Value::Number(f32::from_le_bytes(fixed(rest(4)?)?).into()))),
                Scalar::F64 => named.push((own, Value::Number(f64::from_le_bytes(fixed(rest(8)?)?)))),
                Scalar::U32 => named.push((own, Value::Count(u32::from_le_bytes(fixed(rest(4)?)?).into()))),
                Scalar::U64 => named.push((own, Value::Count(u64::from_le_bytes(fixed(rest(8)?)?)))),
                Scalar::I64 => {
                    // Indices of cells: exact as far as maps reach.
                    named.push((own, Value::Number(i64::from_le_bytes(fixed(rest(8)?)?) as f64)));
                }
                Scalar::Record(name) => {
                    let inner = layouts.iter().find(|layout| layout.name == name)?;
                    let within = values(inner, layouts, rest(inner.size)?)?;
                    named.extend(within.into_iter().map(|(name, value)| (format!("{own}.{name}"), value)));
                }
            }
        }
    }
    Some(named)
}

fn fixed<const N: usize>(bytes: &[u8]) -> Option<[u8; N]> {
    bytes.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::{OdometryRecord, RiskHeader, layouts};

    #[test]
    fn numbers_are_found_where_the_types_have_them() {
        let record = OdometryRecord {
            position_m: [1.0, 2.0, 3.0],
            applied_speed_mps: 0.5,
            applied_by: 1,
            ..OdometryRecord::default()
        };
        let found = values(&OdometryRecord::layout(), &layouts(), bytemuck::bytes_of(&record)).unwrap();
        let of = |name: &str| found.iter().find(|(own, _)| own == name).unwrap().1;
        assert_eq!(of("position_m_2"), Value::Number(3.0));
        assert_eq!((of("applied_speed_mps"), of("applied_by")), (Value::Number(0.5), Value::Count(1)));
        let mut header = RiskHeader::default();
        (header.grid.origin, header.stamp.sequence) = ([-7, 9], u64::MAX);
        let bytes = bytemuck::bytes_of(&header);
        let found = values(&RiskHeader::layout(), &layouts(), bytes).unwrap();
        let of = |name: &str| found.iter().find(|(own, _)| own == name).unwrap().1;
        assert_eq!(of("grid.origin_0"), Value::Number(-7.0));
        assert_eq!(of("stamp.sequence"), Value::Count(u64::MAX));
        assert_eq!(values(&RiskHeader::layout(), &layouts(), &bytes[1..]), None);
    }
}
