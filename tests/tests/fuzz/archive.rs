//! NumPy archives with arrays that are broken before they are packed, so that checksums hold.

use std::io::{Cursor, Write};

use rand::RngExt;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::harness::Rng;
use crate::mutate::{self, float, integer, once_in, one_of};

/// Types of elements, those that are read and others.
const TYPES: [&str; 16] = [
    "<f4", "<f8", ">f4", ">f8", "<f2", "|u1", "|i1", "|b1", "<u2", "<i4", "<u8", "<i8", "<c16", "|O", "<U4",
    "",
];

/// An array as an archive holds it.
#[derive(Clone)]
pub struct Array {
    pub name: &'static str,
    pub descriptor: &'static str,
    pub shape: Vec<u64>,
    pub data: Vec<u8>,
}

impl Array {
    /// An array of f32.
    pub fn f32(name: &'static str, shape: &[u64], values: impl IntoIterator<Item = f32>) -> Self {
        let data = values.into_iter().flat_map(f32::to_le_bytes).collect();
        Self { name, descriptor: "<f4", shape: shape.to_vec(), data }
    }

    /// An array of bytes.
    pub fn u8(name: &'static str, descriptor: &'static str, shape: &[u64], data: &[u8]) -> Self {
        Self { name, descriptor, shape: shape.to_vec(), data: data.to_vec() }
    }

    /// Zeros of any shape, for archives that unpack to far more than they are.
    pub fn zeros(name: &'static str, descriptor: &'static str, shape: &[u64], n_bytes: usize) -> Self {
        Self { name, descriptor, shape: shape.to_vec(), data: vec![0; n_bytes] }
    }

    fn break_in_one_place(&mut self, rng: &mut Rng) {
        match rng.random_range(0..7) {
            0 => self.descriptor = one_of(rng, &TYPES),
            1 if !self.shape.is_empty() => {
                let axis = rng.random_range(0..self.shape.len());
                self.shape[axis] = integer(rng);
            }
            2 => self.shape.push(integer(rng)),
            3 => drop(self.shape.pop()),
            4 => self.shape.reverse(),
            5 if self.data.len() >= 4 => {
                let place = 4 * rng.random_range(0..self.data.len() / 4);
                self.data[place..place + 4].copy_from_slice(&(float(rng) as f32).to_le_bytes());
            }
            _ => mutate::bytes(rng, &mut self.data),
        }
    }

    /// The array as a file of its own; `rng` may break its header.
    fn npy(&self, rng: Option<&mut Rng>) -> Vec<u8> {
        let extents: Vec<String> = self.shape.iter().map(|extent| format!("{extent},")).collect();
        let (descriptor, shape) = (self.descriptor, extents.concat());
        let mut header =
            format!("{{'descr': '{descriptor}', 'fortran_order': False, 'shape': ({shape}), }}\n")
                .into_bytes();
        let mut start = b"\x93NUMPY\x01\0".to_vec();
        if let Some(rng) = rng {
            if once_in(rng, 4) {
                header = String::from_utf8(header).unwrap().replace("False", "True").into_bytes();
            } else if once_in(rng, 4) {
                header = mutate::text(rng, &String::from_utf8(header).unwrap());
            } else if once_in(rng, 8) {
                mutate::bytes(rng, &mut start);
            }
        }
        let length = header.len().min(0xffff) as u16;
        [start.as_slice(), &length.to_le_bytes(), &header, &self.data].concat()
    }
}

/// An archive of these arrays.
pub fn archive(arrays: &[Array], method: CompressionMethod) -> Vec<u8> {
    pack(arrays.iter().map(|array| (format!("{}.npy", array.name), array.npy(None))), method)
}

fn pack(files: impl Iterator<Item = (String, Vec<u8>)>, method: CompressionMethod) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        // A name that stands there twice is refused by the writer, as it is by every other.
        if zip.start_file(name, SimpleFileOptions::default().compression_method(method)).is_ok() {
            zip.write_all(&bytes).unwrap();
        }
    }
    zip.finish().unwrap().into_inner()
}

/// An archive of which arrays, headers or bytes are broken.
pub fn broken(rng: &mut Rng, arrays: &[Array]) -> Vec<u8> {
    let mut arrays = arrays.to_vec();
    for _ in 0..rng.random_range(0..3) {
        let place = rng.random_range(0..arrays.len());
        match rng.random_range(0..12) {
            0 if arrays.len() > 1 => drop(arrays.remove(place)),
            1 => {
                let other = one_of(rng, &arrays.iter().map(|array| array.name).collect::<Vec<_>>());
                arrays[place].name = other;
            }
            _ => arrays[place].break_in_one_place(rng),
        }
    }
    let files: Vec<(String, Vec<u8>)> = arrays
        .iter()
        .map(|array| {
            let touched = once_in(rng, 6);
            (format!("{}.npy", array.name), array.npy(touched.then_some(&mut *rng)))
        })
        .collect();
    let method = if once_in(rng, 4) { CompressionMethod::Deflated } else { CompressionMethod::Stored };
    let mut bytes = pack(files.into_iter(), method);
    if once_in(rng, 3) {
        mutate::bytes(rng, &mut bytes);
    }
    bytes
}
