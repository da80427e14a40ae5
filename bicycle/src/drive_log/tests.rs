use super::*;

#[test]
fn every_column_is_found_by_its_name() {
    for (index, column) in Column::ALL.into_iter().enumerate() {
        assert_eq!(column as usize, index);
        assert_eq!(Column::from_name(column.name()), Some(column));
    }
    assert_eq!(Column::from_name("run"), None);
}

#[test]
fn columns_that_appear_late_are_missing_before() {
    let mut log = DriveLog::default();
    log.push("a", &DriveRow::new(0.0).with(Column::X, 1.0)).unwrap();
    log.push("a", &DriveRow::new(0.1).with(Column::Vx, 2.0)).unwrap();
    log.push("b", &DriveRow::new(-5.0).with(Column::X, 3.0).with(Column::Vx, 4.0)).unwrap();
    assert_eq!(log.columns().collect::<Vec<_>>(), [Column::X, Column::Vx]);
    let runs: Vec<_> = log.runs().collect();
    assert_eq!(runs.iter().map(Run::name).collect::<Vec<_>>(), ["a", "b"]);
    assert_eq!(runs[0].time_s(), [0.0, 0.1]);
    let vx = runs[0].column(Column::Vx).unwrap();
    assert!(vx[0].is_nan() && vx[1] == 2.0);
    assert!(runs[0].column(Column::X).unwrap()[1].is_nan());
    assert_eq!(runs[1].column(Column::Vx), Some(&[4.0][..]));
    assert_eq!(runs[0].column(Column::Yaw), None);
}

#[test]
fn pushing_what_was_read_gives_the_same_log() {
    let mut log = DriveLog::default();
    for step in 0..10 {
        let row = DriveRow::new(f64::from(step)).with(Column::Wz, f64::from(step * step));
        log.push(if step < 4 { "1" } else { "2" }, &row).unwrap();
    }
    let mut copy = DriveLog::default();
    for run in log.runs() {
        for row in run.drive_rows() {
            copy.push(run.name(), &row).unwrap();
        }
    }
    assert_eq!(log, copy);
}

#[test]
fn rows_are_changed_where_they_stand() {
    let mut log = DriveLog::default();
    for (run, time_s) in [("a", 0.0), ("a", 0.1), ("b", 5.0)] {
        log.push(run, &DriveRow::new(time_s).with(Column::X, 1.0)).unwrap();
    }
    let changed = log.with_rows(|run, place, row| {
        DriveRow::new(f64::NAN).with(Column::X, row.value(Column::X) + 10.0 * run as f64 + place as f64)
    });
    let told: Vec<_> = changed.runs().map(|run| (run.time_s(), run.column(Column::X).unwrap())).collect();
    assert_eq!(told, [(&[0.0, 0.1][..], &[1.0, 2.0][..]), (&[5.0][..], &[11.0][..])]);
    assert_eq!(log.with_rows(|_, _, row| row), log);
}

#[test]
fn rows_that_do_not_continue_are_refused_and_leave_the_log_alone() {
    let mut log = DriveLog::default();
    log.push("a", &DriveRow::new(0.0)).unwrap();
    log.push("b", &DriveRow::new(1.0)).unwrap();
    let before = log.clone();
    for time_s in [1.0, 0.5, f64::NAN, f64::INFINITY] {
        assert!(matches!(log.push("b", &DriveRow::new(time_s)), Err(DriveLogError::Time { .. })));
    }
    assert_eq!(log.push("a", &DriveRow::new(9.0)), Err(DriveLogError::RunSplit { run: "a".into() }));
    let infinite = DriveRow::new(2.0).with(Column::Ay, f64::NEG_INFINITY);
    let error = log.push("b", &infinite).unwrap_err();
    assert_eq!(error.to_string(), "ay: expected a finite number or nothing, found -inf");
    assert_eq!(log, before);
}
