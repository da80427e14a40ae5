//! Settings from Python as the text of a configuration file, and settings as Python's dicts.

use std::fmt::{Display, Formatter};
use std::path::PathBuf;

use formats::{ConfigError, ConfigText, overlay};
use navigator::Config;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyList, PyString, PyTuple, PyType};
use serde::Serialize;
use toml::{Table, Value};

use crate::arrays::kind;
use crate::failure::{refused, refused_config, refused_type, refused_value};
use crate::typed::Fields;
use crate::vehicle::AnyVehicle;

/// Tables within tables: no settings have more, and a dict that holds itself has no end.
const DEEPEST: usize = 16;

/// The text of a configuration, and whether Python holds it as a dict: its lines are then nobody's.
pub struct Source {
    text: ConfigText,
    dict_of: Option<String>,
}

impl Source {
    /// A dict, a dataclass, TOML text, or a path (`os.PathLike`) of a file with it; `what` names it in errors.
    pub fn new(what: &str, found: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Some(fields) = fields_of(found)? {
            return Self::of_fields(what, &fields);
        }
        if let Ok(text) = found.cast::<PyString>() {
            return Ok(Self::of_text(what, &text.to_cow()?));
        }
        let Ok(path) = found.extract::<PathBuf>() else {
            return Err(refused_type(what, "a dict, a dataclass, TOML text or a path", kind(found)));
        };
        let text = ConfigText::read(&path).map_err(refused_config)?;
        Ok(Self { text, dict_of: None })
    }

    /// TOML text; `name` stands where errors name the file.
    pub fn of_text(name: &str, text: &str) -> Self {
        Self { text: ConfigText::new(name, text), dict_of: None }
    }

    /// A dict or a dataclass of what stands in a file.
    pub fn of_description(what: &str, found: &Bound<'_, PyAny>) -> PyResult<Self> {
        let fields = fields_of(found)?;
        let fields = fields.ok_or_else(|| refused_type(what, "a dict or a dataclass", kind(found)))?;
        Self::of_fields(what, &fields)
    }

    /// What [`fields_of`] gives.
    pub fn of_fields(what: &str, fields: &Bound<'_, PyDict>) -> PyResult<Self> {
        let text = toml::to_string(&table(&Place::of(what), fields)?).map_err(refused_value)?;
        Ok(Self { text: ConfigText::new(what, text), dict_of: Some(what.to_owned()) })
    }

    /// What `parse` makes of the text, whatever its errors are.
    pub fn with_text<T>(&self, parse: impl FnOnce(&ConfigText) -> T) -> T {
        parse(&self.text)
    }

    /// What `parse` makes of the text.
    pub fn parse<T>(&self, parse: impl FnOnce(&ConfigText) -> Result<T, ConfigError>) -> PyResult<T> {
        parse(&self.text).map_err(|error| match (&self.dict_of, error) {
            (Some(what), ConfigError::Field { field, expected, found, .. }) => {
                let place = if field.is_empty() { what.clone() } else { format!("{what}: {field}") };
                refused(&place, expected, found)
            }
            (_, other) => refused_config(other),
        })
    }
}

/// A dict as it is; of a dataclass its fields, but those that are None, which no file can say.
pub fn fields_of<'py>(found: &Bound<'py, PyAny>) -> PyResult<Option<Bound<'py, PyDict>>> {
    if let Ok(dict) = found.cast::<PyDict>() {
        return Ok(Some(dict.clone()));
    }
    // Of the class itself nothing is set yet.
    if found.is_instance_of::<PyType>() || !found.get_type().hasattr("__dataclass_fields__")? {
        return Ok(None);
    }
    let dict = PyDict::new(found.py());
    for field in found.py().import("dataclasses")?.call_method1("fields", (found,))?.try_iter()? {
        let name = field?.getattr("name")?.cast_into::<PyString>()?;
        let value = found.getattr(&name)?;
        if !value.is_none() {
            dict.set_item(name, value)?;
        }
    }
    Ok(Some(dict))
}

/// The settings of the whole pipeline that fit a vehicle, with what `changes` says in place of theirs.
///
/// vehicle: `Vehicle` or `SkidSteerVehicle`. changes: a dict, TOML text or a path, of which only what differs need stand
/// there. Returns a dict whose parts the other classes take: "elevation", "risk_map", "prior", "cost_to_go",
/// "controller" and so on; what it cannot hold raises `ValueError`.
#[pyfunction(signature = (vehicle, changes: "_Settings | None" = None))]
pub fn settings_for<'py>(
    py: Python<'py>,
    vehicle: AnyVehicle<'py>,
    changes: Option<&Bound<'py, PyAny>>,
) -> PyResult<Fields<'py>> {
    let fitting = vehicle.config();
    let config = match changes {
        Some(changes) => Source::new("changes", changes)?.parse(|text| overlay(text, &fitting))?,
        None => fitting,
    };
    Config::validate(&config).map_err(refused_value)?;
    config.elevation.validate().map_err(refused_value)?;
    config.prior.validate().map_err(refused_value)?;
    config.controller.validate().map_err(refused_value)?;
    dict(py, &config)
}

/// Whatever can be written as TOML as a dict.
pub fn dict<'py>(py: Python<'py>, settings: &impl Serialize) -> PyResult<Fields<'py>> {
    of_table(py, Table::try_from(settings).map_err(refused_value)?).map(Fields)
}

/// JSON as a dict.
pub fn json_dict<'py>(py: Python<'py>, text: &[u8]) -> PyResult<Fields<'py>> {
    let read = py.import("json")?.call_method1("loads", (text,))?;
    Ok(Fields(read.cast_into::<PyDict>()?))
}

fn of_table(py: Python<'_>, table: Table) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    for (key, value) in table {
        dict.set_item(key, of_value(py, value)?)?;
    }
    Ok(dict)
}

fn of_value(py: Python<'_>, value: Value) -> PyResult<Bound<'_, PyAny>> {
    Ok(match value {
        Value::Boolean(value) => PyBool::new(py, value).to_owned().into_any(),
        Value::Integer(value) => value.into_pyobject(py)?.into_any(),
        Value::Float(value) => PyFloat::new(py, value).into_any(),
        Value::String(value) => PyString::new(py, &value).into_any(),
        Value::Datetime(value) => PyString::new(py, &value.to_string()).into_any(),
        Value::Array(values) => {
            let values: PyResult<Vec<_>> = values.into_iter().map(|value| of_value(py, value)).collect();
            PyList::new(py, values?)?.into_any()
        }
        Value::Table(table) => of_table(py, table)?.into_any(),
    })
}

/// Where a value stands: what was given, and the path in it.
struct Place<'a> {
    what: &'a str,
    path: String,
    depth: usize,
}

impl Place<'_> {
    fn of(what: &str) -> Place<'_> {
        Place { what, path: String::new(), depth: 0 }
    }

    /// The place of a key, refused where dicts and lists lie too deep within each other.
    fn within(&self, step: &str) -> PyResult<Self> {
        if self.depth == DEEPEST {
            return Err(refused(
                &self.to_string(),
                format!("at most {DEEPEST} dicts and lists within each other"),
                "more",
            ));
        }
        let dot = if self.path.is_empty() || step.starts_with('[') { "" } else { "." };
        Ok(Self { what: self.what, path: format!("{}{dot}{step}", self.path), depth: self.depth + 1 })
    }
}

impl Display for Place<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let colon = if self.path.is_empty() { "" } else { ": " };
        write!(f, "{}{colon}{}", self.what, self.path)
    }
}

fn table(place: &Place<'_>, dict: &Bound<'_, PyDict>) -> PyResult<Table> {
    let mut table = Table::new();
    for (key, found) in dict {
        let Ok(key) = key.cast::<PyString>() else {
            return Err(refused_type(&place.to_string(), "keys that are strings", kind(&key)));
        };
        let key = key.to_cow()?;
        table.insert(key.to_string(), value(&place.within(&key)?, &found)?);
    }
    Ok(table)
}

fn value(place: &Place<'_>, found: &Bound<'_, PyAny>) -> PyResult<Value> {
    if let Ok(value) = found.cast::<PyBool>() {
        return Ok(Value::Boolean(value.is_true()));
    }
    if let Some(fields) = fields_of(found)? {
        return Ok(Value::Table(table(place, &fields)?));
    }
    if let Ok(text) = found.cast::<PyString>() {
        return Ok(Value::String(text.to_cow()?.into_owned()));
    }
    if found.is_instance_of::<PyList>() || found.is_instance_of::<PyTuple>() {
        return list(place, found);
    }
    number(found).ok_or_else(|| {
        refused_type(
            &place.to_string(),
            "a number, a bool, a string, a list, a dict or a dataclass",
            kind(found),
        )
    })
}

/// What counts is a whole number, be it Python's or NumPy's; what only measures is a real one.
fn number(found: &Bound<'_, PyAny>) -> Option<Value> {
    if !found.is_instance_of::<PyFloat>()
        && let Ok(value) = found.extract::<i64>()
    {
        return Some(Value::Integer(value));
    }
    found.extract::<f64>().ok().map(Value::Float)
}

fn list(place: &Place<'_>, found: &Bound<'_, PyAny>) -> PyResult<Value> {
    let items = found.try_iter()?.enumerate();
    let items: PyResult<Vec<Value>> =
        items.map(|(index, item)| value(&place.within(&format!("[{index}]"))?, &item?)).collect();
    Ok(Value::Array(items?))
}
