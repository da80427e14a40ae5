//! Where a diagnosis goes: places tried out before the work, files written whole or not at all.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::arguments::GapDiagnoseArguments;
use crate::{UsageError, output};

/// Room that must be free beforehand: report and pictures take less [bytes].
const ROOM_BYTES: u64 = 16 << 20;

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
        if let Some(folder) = &folder {
            try_out("--out", folder)?;
        }
        arguments.json.as_deref().map_or(Ok(()), output::prepare_json)?;
        if let Some(predictions) = &arguments.predictions {
            if predictions.is_dir() {
                let found = predictions.display();
                return Err(UsageError(format!("--predictions: expected a file, found the folder {found}")));
            }
            let parent = predictions.parent().filter(|folder| !folder.as_os_str().is_empty());
            try_out("--predictions", parent.unwrap_or(Path::new(".")))?;
        }
        Ok(Self { folder, json: arguments.json.clone(), predictions: arguments.predictions.clone() })
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

fn try_out(option: &str, folder: &Path) -> Result<(), UsageError> {
    formats::prepare_out_dir(folder, ROOM_BYTES)
        .map_err(|error| UsageError(format!("{option}: {}", UsageError::from_input(error))))
}
