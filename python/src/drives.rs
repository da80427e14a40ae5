//! Drives of Python's as drive logs: data frames, dicts of arrays, recordings and files.

use std::path::{Path, PathBuf};

use bicycle::{Column, DriveLog, DriveRow};
use formats::{
    ColumnNames, DescribedVehicle, DriveFileError, DriveLogFileError, GapVehicleError, McapReadError,
};
use numpy::{PyArray1, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyString, PyTuple};
use sim_to_real::{Drives, Machine};

use crate::arrays::{kind, shape};
use crate::failure::{refused, refused_config, refused_file, refused_type, refused_value};
use crate::recording::Recording;
use crate::settings::{Source, fields_of};
use crate::vehicle::Vehicle;

const DRIVES: &str = "a list of drives: data frames, dicts of arrays, recordings or paths of files";

/// The drives of a list. `set` names it in errors; what files leave out is told in `doubts`.
///
/// # Errors
/// `TypeError` for anything but a list, `ValueError` for a drive that cannot be, `OSError` for a file.
pub fn drives(
    set: &str,
    found: &Bound<'_, PyAny>,
    names: &ColumnNames,
    doubts: &mut Vec<String>,
) -> PyResult<Drives> {
    if !(found.is_instance_of::<PyList>() || found.is_instance_of::<PyTuple>()) {
        return Err(refused_type(set, DRIVES, kind(found)));
    }
    let mut drives = Drives::default();
    for (place, own) in found.try_iter()?.enumerate() {
        let own = own?;
        let (name, log) = drive(&format!("{set}[{place}]"), &own, names, doubts)?;
        drives.names.push(name);
        drives.logs.push(log);
    }
    Ok(drives)
}

/// Names for columns: a dict from ours to theirs.
///
/// # Errors
/// `TypeError` for other than words, `ValueError` for a name that is none of ours or stands twice.
pub fn column_names(found: Option<&Bound<'_, PyDict>>) -> PyResult<ColumnNames> {
    let Some(found) = found else { return Ok(ColumnNames::default()) };
    let words = found.iter().map(|(ours, theirs)| {
        let word = |word: &Bound<'_, PyAny>| {
            let text = word.extract::<String>();
            text.map_err(|_| refused_type("columns", "a dict from our names to yours", kind(word)))
        };
        Ok(format!("{}={}", word(&ours)?, word(&theirs)?))
    });
    let words = words.collect::<PyResult<Vec<String>>>()?;
    let names = ColumnNames::parse(words.iter().map(String::as_str));
    names.map_err(|error| refused_value(format!("columns: {error}")))
}

fn drive(
    place: &str,
    found: &Bound<'_, PyAny>,
    names: &ColumnNames,
    doubts: &mut Vec<String>,
) -> PyResult<(String, DriveLog)> {
    if let Ok(recording) = found.cast::<Recording>() {
        return of_file(recording.get().path(), names, doubts);
    }
    if let Ok(path) = found.extract::<PathBuf>() {
        return of_file(&path, names, doubts);
    }
    let keys = if let Ok(dict) = found.cast::<PyDict>() {
        dict.keys()
    } else if found.hasattr("columns")? && found.hasattr("__getitem__")? {
        found.py().get_type::<PyList>().call1((found.getattr("columns")?,))?.cast_into::<PyList>()?
    } else {
        return Err(refused_type(
            place,
            "a data frame, a dict of arrays, a recording or a path",
            kind(found),
        ));
    };
    Ok((place.to_owned(), Table::new(place, found, &keys, names)?.log()?))
}

/// A drive out of one file, or of several with `+` between them.
fn of_file(path: &Path, names: &ColumnNames, doubts: &mut Vec<String>) -> PyResult<(String, DriveLog)> {
    let parts = formats::drive_parts(path);
    let mut logs = parts.iter().map(|part| of_part(part, names, doubts)).collect::<PyResult<Vec<_>>>()?;
    let name = path.display().to_string();
    if logs.len() == 1 {
        return Ok((name, logs.remove(0)));
    }
    let joined = DriveLog::joined(&logs).map_err(|error| refused_value(format!("{name}: {error}")))?;
    Ok((name, joined))
}

fn of_part(path: &Path, names: &ColumnNames, doubts: &mut Vec<String>) -> PyResult<DriveLog> {
    let drive = formats::read_drive_named(path, names).map_err(|error| match error {
        DriveFileError::Csv(DriveLogFileError::Unreadable { source, .. })
        | DriveFileError::Mcap(McapReadError::Unreadable { source, .. }) => refused_file(path, &source),
        other => refused_value(other),
    })?;
    let early = |problem| format!("{}: the recording ends early, {problem}", path.display());
    doubts.extend(drive.ended_early.map(early));
    Ok(drive.log)
}

/// The vehicle that was driven: a [`Vehicle`], the name of one, the path of a file, a dict or a dataclass.
pub fn machine(found: &Bound<'_, PyAny>, drives: &[bicycle::DriveLog]) -> PyResult<Machine> {
    if let Ok(vehicle) = found.cast::<Vehicle>() {
        return Ok(Machine::of_vehicle(&vehicle.get().0));
    }
    if let Some(description) = fields_of(found)? {
        let source = Source::of_fields("vehicle", &description)?;
        let vehicle = source.with_text(|text| formats::parse_gap_vehicle(text, Path::new("")));
        return Ok(Machine::of_case(vehicle.map_err(refused_vehicle)?, drives));
    }
    let Ok(path) = found.extract::<PathBuf>() else {
        let expected =
            "a Vehicle, the name of one, the path of a vehicle's file, a dict or a dataclass of it";
        return Err(refused_type("vehicle", expected, kind(found)));
    };
    let vehicle: DescribedVehicle =
        formats::read_described_vehicle(&path.to_string_lossy()).map_err(refused_vehicle)?;
    Ok(Machine::described(vehicle, drives))
}

fn refused_vehicle(error: GapVehicleError) -> PyErr {
    match error {
        GapVehicleError::Config(error) => refused_config(error),
        GapVehicleError::Unreadable { ref file, ref source } => refused_file(Path::new(file), source),
        other => refused_value(other),
    }
}

/// The columns of a table that have a meaning.
struct Table<'a> {
    place: &'a str,
    time_s: Vec<f64>,
    runs: Option<Vec<String>>,
    columns: Vec<(Column, Vec<f64>)>,
}

impl<'a> Table<'a> {
    fn new(
        place: &'a str,
        found: &Bound<'_, PyAny>,
        keys: &Bound<'_, PyList>,
        names: &ColumnNames,
    ) -> PyResult<Self> {
        let header: Vec<String> =
            keys.iter().map(|key| Ok(key.str()?.to_string())).collect::<PyResult<_>>()?;
        let only = || format!("only: {}", header.join(", "));
        let renamed = names.renamed(&header).map_err(|expected| refused(place, expected, only()))?;
        let mut table = Self { place, time_s: Vec::new(), runs: None, columns: Vec::new() };
        let mut has_time = false;
        for (index, (name, key)) in renamed.iter().zip(keys.iter()).enumerate() {
            if renamed[..index].contains(name) {
                return Err(refused(place, "each column once", format!("'{name}' twice")));
            }
            let column = Column::from_name(name);
            if name == "t" {
                (table.time_s, has_time) = (numbers(place, name, &found.get_item(key)?)?, true);
            } else if name == "run" {
                table.runs = Some(words(&found.get_item(key)?)?);
            } else if let Some(column) = column {
                table.columns.push((column, numbers(place, name, &found.get_item(key)?)?));
            }
        }
        if !has_time {
            return Err(refused(place, "a column 't'", only()));
        }
        table.of_one_length()?;
        Ok(table)
    }

    fn of_one_length(&self) -> PyResult<()> {
        let expected = self.time_s.len();
        let lengths = self.columns.iter().map(|(column, values)| (column.name(), values.len()));
        let runs = self.runs.iter().map(|runs| ("run", runs.len()));
        match lengths.chain(runs).find(|(_, length)| *length != expected) {
            Some((name, length)) => Err(refused(
                &format!("{}: column '{name}'", self.place),
                format!("{expected} values"),
                length,
            )),
            None if expected == 0 => Err(refused(self.place, "at least one row", "none")),
            None => Ok(()),
        }
    }

    fn log(&self) -> PyResult<DriveLog> {
        let mut log = DriveLog::default();
        for (index, time_s) in self.time_s.iter().enumerate() {
            let values = self.columns.iter().map(|(column, values)| (*column, values[index]));
            let row = values.fold(DriveRow::new(*time_s), |row, (column, value)| row.with(column, value));
            let run = self.runs.as_ref().map_or("", |runs| &runs[index]);
            log.push(run, &row)
                .map_err(|error| refused_value(format!("{}, row {index}: {error}", self.place)))?;
        }
        Ok(log)
    }
}

/// A column of numbers of whatever width; what is missing is NaN. Text is no number, not even where it looks like one.
fn numbers(place: &str, name: &str, found: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let py = found.py();
    let column = format!("{place}: column '{name}'");
    let array = py.import("numpy")?.call_method1("asarray", (found,))?;
    let untyped = array.cast::<PyUntypedArray>()?;
    if untyped.ndim() != 1 {
        return Err(refused(&column, "one number for each row", format!("shape {}", shape(untyped.shape()))));
    }
    let kind_of_number: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    match kind_of_number.as_str() {
        "b" | "i" | "u" | "f" => {
            let wide = array.call_method1("astype", ("float64",))?;
            Ok(wide.cast::<PyArray1<f64>>()?.try_readonly()?.as_array().to_vec())
        }
        "O" => array.try_iter()?.enumerate().map(|(row, item)| object(&column, row, &item?)).collect(),
        _ => Err(refused(&column, "numbers", untyped.dtype())),
    }
}

fn object(column: &str, row: usize, item: &Bound<'_, PyAny>) -> PyResult<f64> {
    let is_missing = item.is_none() || item.get_type().name()? == "NAType";
    if is_missing {
        return Ok(f64::NAN);
    }
    let refuse = || refused(&format!("{column}, row {row}"), "a number or nothing", kind(item));
    if item.is_instance_of::<PyString>() { Err(refuse()) } else { item.extract().map_err(|_| refuse()) }
}

fn words(found: &Bound<'_, PyAny>) -> PyResult<Vec<String>> {
    found.try_iter()?.map(|item| Ok(item?.str()?.to_string())).collect()
}
