//! A recording as a file of safetensors: `image` F32 [4, rows, columns] (red, green, blue from 0 to 1, height [m]; row 0 in the
//! south), `moments` F64 [instants, 15] in the order of [`Moment`]'s fields, where somebody knows them `classes` U8 [rows,
//! columns], indices into the published table; and in the header `resolution_m`, `west_m` and `south_m`.

use std::collections::HashMap;

use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};

use super::{Moment, ROW, Recording, RecordingError, part};
use crate::view::{CHANNELS, View};

impl Recording {
    /// As bytes of safetensors.
    ///
    /// # Errors
    /// A recording that is none.
    pub fn to_bytes(&self) -> Result<Vec<u8>, RecordingError> {
        self.validate()?;
        let View { n_rows, n_cols, resolution_m, south_west_m: [west_m, south_m], .. } = self.view;
        let image: Vec<u8> = self.view.values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let moments: Vec<u8> = self.moments.iter().flat_map(Moment::row).flat_map(f64::to_le_bytes).collect();
        let mut tensors = vec![
            ("image", TensorView::new(Dtype::F32, vec![CHANNELS, n_rows, n_cols], &image)?),
            ("moments", TensorView::new(Dtype::F64, vec![self.moments.len(), ROW], &moments)?),
        ];
        if let Some(classes) = &self.classes {
            tensors.push(("classes", TensorView::new(Dtype::U8, vec![n_rows, n_cols], classes)?));
        }
        let header = [("resolution_m", resolution_m), ("west_m", west_m), ("south_m", south_m)];
        let header: HashMap<String, String> =
            header.into_iter().map(|(key, value)| (key.to_owned(), value.to_string())).collect();
        Ok(safetensors::serialize(tensors, Some(header))?)
    }

    /// From the same bytes.
    ///
    /// # Errors
    /// No safetensors, tensors that are missing or of another type or shape, numbers that are none.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, RecordingError> {
        let (_, metadata) = SafeTensors::read_metadata(bytes)?;
        let tensors = SafeTensors::deserialize(bytes)?;
        let header = |key: &'static str| {
            let told = metadata.metadata().as_ref().and_then(|all| all.get(key).cloned());
            let number = told.as_ref().and_then(|word| word.parse::<f64>().ok());
            number
                .filter(|value| value.is_finite())
                .ok_or_else(|| part(key, "a number of metres", format!("{told:?}")))
        };
        let image = tensor(&tensors, "image", Dtype::F32, [Some(CHANNELS), None, None])?;
        let moments = tensor(&tensors, "moments", Dtype::F64, [None, Some(ROW)])?;
        let [n_rows, n_cols] = [image.shape()[1], image.shape()[2]];
        let classes = match tensors.names().contains(&"classes") {
            true => {
                Some(tensor(&tensors, "classes", Dtype::U8, [Some(n_rows), Some(n_cols)])?.data().to_vec())
            }
            false => None,
        };
        let values = image.data().as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        let rows: Vec<f64> =
            moments.data().as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
        let view = View {
            resolution_m: header("resolution_m")?,
            south_west_m: [header("west_m")?, header("south_m")?],
            n_rows,
            n_cols,
            values,
        };
        let moments = rows.as_chunks().0.iter().map(Moment::of_row).collect();
        let recording = Self { view, classes, moments };
        recording.validate()?;
        Ok(recording)
    }
}

/// A tensor of a type and shape, of which some sides may be any.
fn tensor<'a, const N: usize>(
    tensors: &SafeTensors<'a>,
    name: &'static str,
    dtype: Dtype,
    shape: [Option<usize>; N],
) -> Result<TensorView<'a>, RecordingError> {
    let sides = shape.map(|side| side.map_or("any".to_owned(), |side| side.to_string()));
    let expected = format!("{dtype:?} [{}]", sides.join(", "));
    let found = tensors.tensor(name).map_err(|_| part(name, &expected, "no such tensor"))?;
    let fits = found.shape().len() == N
        && shape.iter().zip(found.shape()).all(|(side, found)| side.is_none_or(|side| side == *found));
    if found.dtype() != dtype || !fits {
        return Err(part(name, expected, format!("{:?} {:?}", found.dtype(), found.shape())));
    }
    Ok(found)
}
