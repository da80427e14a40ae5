//! The messages of a recorded channel as rows of a table.

use bicycle::Column;
use bus::layout::{RecordLayout, Value, values};
use bus::message::{
    CheckpointHeader, CommandRecord, DecisionRecord, ImuRecord, LAYOUT_VERSION, MissionRecord,
    OdometryRecord, OrderHeader, RiskHeader, ScanHeader, Stamp, StuckRecord, SurfaceHeader, TrackRecord,
    TracksHeader, layouts,
};
use formats::RecordedCell;

use super::recorded_stamp;
use crate::recorder::topic;

/// A row: the fields of a message by name.
pub type Row = Vec<(String, RecordedCell)>;

/// The rows of a message under a topic of a channel: one for each record of its payload, with the header's fields before
/// its own; of maps, scans and orders the header alone.
///
/// Errors: what was expected and found, for another topic, another version of the layouts, and bytes that are no message.
pub fn recorded_rows(name: &str, bytes: &[u8]) -> Result<Vec<Row>, String> {
    let (header, record) = shape(name).ok_or("expected the topic of a channel, found another")?;
    let found = recorded_stamp(bytes).ok_or("expected a stamp, found fewer bytes")?.layout_version;
    if found != LAYOUT_VERSION {
        return Err(format!("expected layouts of version {LAYOUT_VERSION}, found version {found}"));
    }
    let refused = || format!("expected a message of its layout, found {} bytes", bytes.len());
    let (head, rest) = bytes.split_at_checked(header.size).ok_or_else(refused)?;
    let head = named(&header, head).ok_or_else(refused)?;
    let Some(record) = record else { return Ok(vec![head]) };
    if !rest.len().is_multiple_of(record.size) {
        return Err(refused());
    }
    let rows = rest.chunks_exact(record.size).map(|own| Some([head.clone(), named(&record, own)?].concat()));
    rows.collect::<Option<_>>().ok_or_else(refused)
}

/// A message of odometry under the names of a drive log, with `t` since `began_ns` [s].
///
/// Errors: those of [`recorded_rows`].
pub fn recorded_odometry(bytes: &[u8], began_ns: &mut Option<u64>) -> Result<Vec<Row>, String> {
    recorded_rows(topic::ODOMETRY, bytes)?;
    let refused = "expected a record of odometry, found other bytes";
    let stamp = recorded_stamp(bytes).ok_or(refused)?;
    let record: OdometryRecord =
        bytemuck::try_pod_read_unaligned(&bytes[size_of::<Stamp>()..]).map_err(|_| refused)?;
    let began_ns = *began_ns.get_or_insert(stamp.valid_at_ns);
    let time_s = stamp.valid_at_ns.saturating_sub(began_ns) as f64 * 1e-9;
    let row = bus::message::drive_row(time_s, &record.odometry(stamp.valid_at_ns), [0.0; 2]);
    let measured = Column::ALL.into_iter().filter(|own| !matches!(own, Column::CmdSpeed | Column::CmdSteer));
    let known =
        measured.map(|column| (column.name(), row.value(column))).filter(|(_, value)| !value.is_nan());
    let cells = [("t", time_s)].into_iter().chain(known);
    Ok(vec![cells.map(|(name, value)| (name.to_owned(), RecordedCell::Number(value))).collect()])
}

/// Header and records of a channel's messages.
fn shape(name: &str) -> Option<(RecordLayout, Option<RecordLayout>)> {
    Some(match name {
        topic::ODOMETRY => (Stamp::layout(), Some(OdometryRecord::layout())),
        topic::IMU => (Stamp::layout(), Some(ImuRecord::layout())),
        topic::COMMAND => (Stamp::layout(), Some(CommandRecord::layout())),
        topic::DECISION => (Stamp::layout(), Some(DecisionRecord::layout())),
        topic::STUCK => (Stamp::layout(), Some(StuckRecord::layout())),
        topic::MISSION => (Stamp::layout(), Some(MissionRecord::layout())),
        topic::TRACKS => (TracksHeader::layout(), Some(TrackRecord::layout())),
        topic::SCAN => (ScanHeader::layout(), None),
        topic::SURFACE => (SurfaceHeader::layout(), None),
        topic::RISK | topic::RISK_PHYSICS => (RiskHeader::layout(), None),
        topic::ORDER | topic::EMERGENCY_STOP => (OrderHeader::layout(), None),
        topic::CHECKPOINT => (CheckpointHeader::layout(), None),
        _ => return None,
    })
}

/// The fields of a record; a header's own stamp is told as one that stands in it.
fn named(layout: &RecordLayout, bytes: &[u8]) -> Option<Row> {
    let prefix = if layout.name == Stamp::layout().name { "stamp." } else { "" };
    let all = values(layout, &layouts(), bytes)?.into_iter().map(|(name, value)| {
        let cell = match value {
            Value::Number(number) => RecordedCell::Number(number),
            Value::Count(count) => RecordedCell::Count(count),
        };
        (format!("{prefix}{name}"), cell)
    });
    let is_told = |name: &str| !matches!(name, "stamp.layout_version" | "stamp.reserved");
    Some(all.filter(|(name, _)| is_told(name)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(stamp: Stamp, samples: &[ImuRecord]) -> Vec<u8> {
        [bytemuck::bytes_of(&stamp), bytemuck::cast_slice(samples)].concat()
    }

    #[test]
    fn a_message_makes_a_row_of_every_record() {
        let stamp = Stamp { layout_version: LAYOUT_VERSION, sequence: 3, ..Stamp::default() };
        let sample = ImuRecord { valid_at_ns: 9, acceleration_mps2: [0.0, 0.5, 9.5], ..ImuRecord::default() };
        let rows = recorded_rows(topic::IMU, &message(stamp, &[sample; 2])).unwrap();
        assert_eq!(rows.len(), 2);
        let of = |name: &str| rows[1].iter().find(|(own, _)| own == name).map(|(_, cell)| cell.clone());
        assert_eq!(of("stamp.sequence"), Some(RecordedCell::Count(3)));
        assert_eq!(of("valid_at_ns"), Some(RecordedCell::Count(9)));
        assert_eq!(of("acceleration_mps2_1"), Some(RecordedCell::Number(0.5)));
        assert_eq!(of("stamp.layout_version"), None);
    }

    #[test]
    fn odometry_bears_the_names_of_a_drive_log_and_counts_from_its_first() {
        let stamp = Stamp { layout_version: LAYOUT_VERSION, valid_at_ns: 2_500_000_000, ..Stamp::default() };
        let record =
            OdometryRecord { velocity_mps: [1.5, 0.0], wheel_speed_mps: 1.6, ..OdometryRecord::default() };
        let bytes = [bytemuck::bytes_of(&stamp), bytemuck::bytes_of(&record)].concat();
        let mut began_ns = Some(1_000_000_000);
        let rows = recorded_odometry(&bytes, &mut began_ns).unwrap();
        let of = |name: &str| rows[0].iter().find(|(own, _)| own == name).map(|(_, cell)| cell.clone());
        assert_eq!(of("t"), Some(RecordedCell::Number(1.5)));
        assert_eq!(
            (of("vx"), of("wheel_speed")),
            (Some(RecordedCell::Number(1.5)), Some(RecordedCell::Number(1.6)))
        );
        assert_eq!(of("cmd_speed"), None);
    }

    #[test]
    fn other_versions_topics_and_bytes_are_refused() {
        let stamp = Stamp { layout_version: LAYOUT_VERSION, ..Stamp::default() };
        let whole = message(stamp, &[ImuRecord::default()]);
        let told = recorded_rows(topic::IMU, &whole[..whole.len() - 1]).unwrap_err();
        assert!(told.contains("expected a message of its layout, found"), "{told}");
        assert!(recorded_rows("/pose", &whole).unwrap_err().contains("expected the topic of a channel"));
        let old = message(Stamp { layout_version: LAYOUT_VERSION - 1, ..stamp }, &[]);
        assert!(recorded_rows(topic::IMU, &old).unwrap_err().contains("found version"));
        assert!(recorded_rows(topic::IMU, &[]).unwrap_err().contains("expected a stamp"));
    }
}
