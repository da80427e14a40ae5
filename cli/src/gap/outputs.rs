//! Where a diagnosis goes: places tried out before the work, files written whole or not at all.

use std::path::PathBuf;

use serde::Serialize;

use crate::arguments::GapDiagnoseArguments;
use crate::{UsageError, output};

/// The files of one diagnosis.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Outputs {
    /// Folder of the report.
    pub folder: Option<PathBuf>,
    pub json: Option<PathBuf>,
    pub predictions: Option<PathBuf>,
}

impl Outputs {
    /// Makes the folders where they are missing and tries them out.
    ///
    /// Errors: a folder cannot be made or written, has no room, or a file's place is taken by a folder.
    pub(super) fn prepare(arguments: &GapDiagnoseArguments) -> Result<Self, UsageError> {
        let folder = arguments.report_folder();
        folder.as_deref().map_or(Ok(()), |folder| output::prepare_folder("--out", folder))?;
        arguments.copy.prepare()?;
        let predictions = arguments.predictions.as_deref();
        predictions.map_or(Ok(()), |path| output::prepare_large_file("--predictions", path))?;
        Ok(Self { folder, json: arguments.copy.json.clone(), predictions: arguments.predictions.clone() })
    }

    /// A file of the report, if one is asked for.
    pub(super) fn in_folder(&self, name: &str) -> Option<PathBuf> {
        self.folder.as_ref().map(|folder| folder.join(name))
    }

    /// Writes a value to every place that is meant.
    pub(super) fn write_json(&self, name: &str, value: &impl Serialize) -> anyhow::Result<()> {
        let places = [self.in_folder(name), self.json.clone()];
        places.iter().flatten().try_for_each(|path| Ok(formats::write_json_atomic(path, value)?))
    }
}
