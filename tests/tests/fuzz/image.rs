//! PNG and TIFF of which parts are broken before they are put together, so that checksums and offsets hold.

use std::sync::LazyLock;

use png::{BitDepth, ColorType, Encoder};
use rand::RngExt;

use crate::harness::Rng;
use crate::mutate::{self, float, integer, once_in, one_of};

/// A chunk of a PNG: its type and its data.
type Chunk = ([u8; 4], Vec<u8>);

/// Types of chunks that a decoder looks into, and one that it does not know.
const CHUNKS: [&[u8; 4]; 17] = [
    b"IHDR", b"IDAT", b"IEND", b"PLTE", b"tRNS", b"gAMA", b"cHRM", b"sRGB", b"iCCP", b"zTXt", b"iTXt",
    b"pHYs", b"acTL", b"fcTL", b"fdAT", b"eXIf", b"teSt",
];

/// A PNG as its encoder writes it.
pub fn png(width: u32, height: u32, (color, depth): (ColorType, BitDepth), data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    bytes
}

/// Grey of 16 bits, which is read, and two others.
static PNGS: LazyLock<Vec<Vec<Chunk>>> = LazyLock::new(|| {
    let data: Vec<u8> = (0..24).map(|k| 9 * k).collect();
    [
        png(4, 3, (ColorType::Grayscale, BitDepth::Sixteen), &data),
        png(4, 3, (ColorType::Grayscale, BitDepth::Sixteen), &data),
        png(4, 3, (ColorType::GrayscaleAlpha, BitDepth::Eight), &data),
        png(4, 2, (ColorType::Rgb, BitDepth::Eight), &data),
    ]
    .iter()
    .map(|bytes| chunks(bytes))
    .collect()
});

fn chunks(png: &[u8]) -> Vec<Chunk> {
    let mut chunks = Vec::new();
    let mut rest = &png[8..];
    while let Some((length, after)) = rest.split_first_chunk::<4>() {
        let n = u32::from_be_bytes(*length) as usize;
        chunks.push((after[..4].try_into().unwrap(), after[4..4 + n].to_vec()));
        rest = &after[8 + n..];
    }
    chunks
}

/// A PNG of which chunks, or bytes, are broken.
pub fn broken_png(rng: &mut Rng) -> Vec<u8> {
    let mut chunks = PNGS[rng.random_range(0..PNGS.len())].clone();
    for _ in 0..rng.random_range(0..3) {
        break_chunks(rng, &mut chunks);
    }
    let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
    for (kind, data) in &chunks {
        let length = if once_in(rng, 40) { integer(rng) as u32 } else { data.len() as u32 };
        bytes.extend(length.to_be_bytes());
        bytes.extend(kind);
        bytes.extend(data);
        bytes.extend(crc32(&[kind, data.as_slice()].concat()).to_be_bytes());
    }
    if once_in(rng, 4) {
        mutate::bytes(rng, &mut bytes);
    }
    bytes
}

fn break_chunks(rng: &mut Rng, chunks: &mut Vec<Chunk>) {
    let place = rng.random_range(0..=chunks.len());
    match rng.random_range(0..8) {
        0..=2 => {
            // Width, height; depth, colour, compression, filter, interlacing.
            let Some((_, header)) = chunks.first_mut().filter(|(_, data)| data.len() == 13) else { return };
            let field = rng.random_range(0..7);
            if field < 2 {
                header[4 * field..4 * field + 4].copy_from_slice(&(integer(rng) as u32).to_be_bytes());
            } else {
                header[6 + field] = one_of(rng, &[0, 1, 2, 3, 4, 6, 8, 16, 32, 255]);
            }
        }
        3 => {
            let mut data: Vec<u8> = (0..rng.random_range(0..40)).map(|_| rng.random()).collect();
            if once_in(rng, 2) {
                data = [b"name\0\0".as_slice(), &data].concat();
            }
            chunks.insert(place, (*one_of(rng, &CHUNKS), data));
        }
        _ if place == chunks.len() => {}
        4 => drop(chunks.remove(place)),
        5 => chunks.insert(place, chunks[place].clone()),
        6 => chunks[place].0 = *one_of(rng, &CHUNKS),
        _ => mutate::bytes(rng, &mut chunks[place].1),
    }
}

/// The checksum of PNG (ISO 3309).
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(
            crc ^ u32::from(*byte),
            |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 },
        )
    })
}

/// An entry of a TIFF's directory.
#[derive(Clone)]
pub struct Entry {
    pub tag: u16,
    /// 1 byte, 2 text, 3 u16, 4 u32, 11 f32, 12 f64, 16 u64.
    pub kind: u16,
    pub count: u32,
    pub values: Vec<u8>,
}

/// Entry of u16.
fn shorts(tag: u16, values: &[u16]) -> Entry {
    let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    Entry { tag, kind: 3, count: values.len() as u32, values: bytes }
}

/// Entry of u32.
fn long(tag: u16, value: u32) -> Entry {
    Entry { tag, kind: 4, count: 1, values: value.to_le_bytes().to_vec() }
}

/// Entry of f64.
fn doubles(tag: u16, values: &[f64]) -> Entry {
    let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    Entry { tag, kind: 12, count: values.len() as u32, values: bytes }
}

/// A directory of `n_cols` x `n_rows` heights of 32 bits in one strip, packed as `compression` says.
pub fn directory(n_cols: u32, n_rows: u32, compression: u16, n_strip_bytes: u32) -> Vec<Entry> {
    vec![
        long(256, n_cols),
        long(257, n_rows),
        shorts(258, &[32]),
        shorts(259, &[compression]),
        shorts(262, &[1]),
        long(273, 8),
        shorts(277, &[1]),
        long(278, n_rows),
        long(279, n_strip_bytes),
        shorts(339, &[3]),
        doubles(33550, &[2.0, 2.0, 0.0]),
        doubles(33922, &[0.0, 0.0, 0.0, 500_000.0, 4_000_006.0, 0.0]),
        shorts(34735, &[1, 1, 0, 1, 1024, 0, 1, 1]),
        Entry { tag: 42113, kind: 2, count: 6, values: b"-9999\0".to_vec() },
    ]
}

/// A little-endian TIFF: the strip behind the head, then the directory, then what does not fit into its entries.
pub fn tiff(entries: &[Entry], strip: &[u8]) -> Vec<u8> {
    let at = 8 + strip.len() as u32;
    let mut bytes = [b"II*\0".as_slice(), &at.to_le_bytes(), strip].concat();
    let mut beyond: Vec<u8> = Vec::new();
    let beyond_at = at + 2 + 12 * entries.len() as u32 + 4;
    bytes.extend((entries.len() as u16).to_le_bytes());
    for Entry { tag, kind, count, values } in entries {
        bytes.extend(tag.to_le_bytes());
        bytes.extend(kind.to_le_bytes());
        bytes.extend(count.to_le_bytes());
        if values.len() <= 4 {
            let mut inline = values.clone();
            inline.resize(4, 0);
            bytes.extend(inline);
        } else {
            bytes.extend((beyond_at + beyond.len() as u32).to_le_bytes());
            beyond.extend(values);
        }
    }
    bytes.extend([0; 4]);
    bytes.extend(beyond);
    bytes
}

/// A TIFF of which entries, heights or bytes are broken.
pub fn broken_tiff(rng: &mut Rng) -> Vec<u8> {
    let mut strip: Vec<u8> = (0..12).flat_map(|k| (0.5 * k as f32).to_le_bytes()).collect();
    let compression = if once_in(rng, 2) { 1 } else { one_of(rng, &[5, 7, 8, 32773, 32946, 50000]) };
    let mut entries = directory(4, 3, compression, strip.len() as u32);
    for _ in 0..rng.random_range(0..3) {
        break_entries(rng, &mut entries);
    }
    if once_in(rng, 3) {
        let place = 4 * rng.random_range(0..12);
        strip[place..place + 4].copy_from_slice(&(float(rng) as f32).to_le_bytes());
    }
    let mut bytes = tiff(&entries, &strip);
    if once_in(rng, 4) {
        mutate::bytes(rng, &mut bytes);
    }
    bytes
}

fn break_entries(rng: &mut Rng, entries: &mut Vec<Entry>) {
    let place = rng.random_range(0..entries.len());
    match rng.random_range(0..9) {
        0..=2 => {
            let entry = &mut entries[place];
            let word = if entry.kind == 12 { float(rng).to_bits() } else { integer(rng) };
            let width = match entry.kind {
                3 => 2,
                4 => 4,
                12 => 8,
                _ => 1,
            };
            let at = width * rng.random_range(0..(entry.values.len() / width).max(1));
            if let Some(value) = entry.values.get_mut(at..at + width) {
                value.copy_from_slice(&word.to_le_bytes()[..width]);
            }
        }
        3 => entries[place].count = integer(rng) as u32,
        4 => entries[place].kind = rng.random_range(0..20),
        5 => {
            entries[place].tag =
                one_of(rng, &[256, 258, 262, 273, 279, 317, 320, 322, 323, 324, 325, 330, 347, 34665])
        }
        6 => drop(entries.remove(place)),
        7 => entries.insert(place, entries[place].clone()),
        // Tiles of a side that is a power of two, in place of strips.
        _ => {
            let side = 1 << rng.random_range(0..17);
            let strip =
                entries.iter().find(|entry| entry.tag == 279).map_or(48, |entry| entry.values.len() as u32);
            entries.extend([long(322, side), long(323, side), long(324, 8), long(325, strip)]);
        }
    }
    if entries.is_empty() {
        entries.push(long(256, 1));
    }
}
