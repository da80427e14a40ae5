//! Ways to break a document: values that nobody expects where values stand, and whatever transmission does to bytes.

use bus::layout::Scalar;
use rand::RngExt;

use crate::harness::Rng;

/// Whole numbers at the edges of what types and sizes hold.
pub const INTEGERS: [u64; 22] = [
    0,
    1,
    2,
    3,
    4,
    7,
    255,
    256,
    1000,
    0x7fff,
    0xffff,
    0x1_0000,
    0x00ff_ffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    1 << 32,
    1 << 40,
    1 << 60,
    (1 << 63) - 1,
    1 << 63,
    u64::MAX,
];

/// Numbers at the edges of what is a number.
pub const FLOATS: [f64; 22] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    1e-3,
    1e-9,
    -1e-9,
    1e-38,
    1e-310,
    1e3,
    1e6,
    -1e6,
    1e9,
    1e19,
    -1e19,
    3.4e38,
    1e39,
    f64::MAX,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::NAN,
];

/// What may stand where a value is expected.
const WORDS: [&str; 40] = [
    "",
    " ",
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "0.5",
    "-0.5",
    "1e-9",
    "1e-320",
    "1e308",
    "-1e308",
    "1e999",
    "nan",
    "NaN",
    "-nan",
    "inf",
    "-inf",
    "+inf",
    "null",
    "true",
    "[]",
    "{}",
    "\"\"",
    "\"x\"",
    "''",
    "0x10",
    "1_000",
    "1__0",
    "00",
    "255",
    "256",
    "65536",
    "4294967296",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "1979-05-27T07:32:00Z",
    "\u{feff}",
];

/// What structure is made of.
const MARKS: [&str; 28] = [
    "[",
    "]",
    "{",
    "}",
    "(",
    ")",
    ",",
    "=",
    ":",
    ";",
    "\"",
    "'",
    "\"\"\"",
    "#",
    "\\",
    "\\u0000",
    "\\ud800",
    "\n",
    "\r\n",
    "\t",
    "\0",
    ".",
    "-",
    "+",
    "e",
    "\u{e9}",
    "\u{1f600}",
    "[[",
];

/// What opens something that may hold the same again.
const OPENINGS: [&str; 7] = ["[", "{", "{\"a\":", "[[a]]\n", "a.", "a={", "\"\\\""];

/// One of these.
pub fn one_of<T: Copy>(rng: &mut Rng, items: &[T]) -> T {
    items[rng.random_range(0..items.len())]
}

/// Whether what happens once in `n` times happens.
pub fn once_in(rng: &mut Rng, n: u32) -> bool {
    rng.random_range(0..n) == 0
}

/// A whole number from an edge, or from near one, or any.
pub fn integer(rng: &mut Rng) -> u64 {
    let edge = one_of(rng, &INTEGERS);
    match rng.random_range(0..4) {
        0 => edge.wrapping_add(rng.random_range(0..5)).wrapping_sub(2),
        1 => rng.random(),
        2 => rng.random_range(0..64),
        _ => edge,
    }
}

/// A number from an edge, or of a usual size, or any bits.
pub fn float(rng: &mut Rng) -> f64 {
    match rng.random_range(0..4) {
        0 => f64::from_bits(rng.random()),
        1 => rng.random_range(-10.0..10.0),
        _ => one_of(rng, &FLOATS),
    }
}

/// A range of a length, rather short than long.
fn range(rng: &mut Rng, length: usize) -> std::ops::Range<usize> {
    let start = rng.random_range(0..=length);
    let longest = if once_in(rng, 4) { length } else { 16 };
    start..(start + rng.random_range(0..=longest)).min(length)
}

/// Breaks bytes that nothing is known of, in one to four places.
pub fn bytes(rng: &mut Rng, bytes: &mut Vec<u8>) {
    for _ in 0..rng.random_range(1..=4) {
        break_bytes(rng, bytes);
    }
}

fn break_bytes(rng: &mut Rng, bytes: &mut Vec<u8>) {
    let n = bytes.len();
    match rng.random_range(0..9) {
        _ if n == 0 => bytes.push(rng.random()),
        0 => bytes[rng.random_range(0..n)] ^= 1 << rng.random_range(0..8),
        1 => bytes[rng.random_range(0..n)] = rng.random(),
        2 | 3 => {
            let word = if once_in(rng, 3) { float(rng).to_bits() } else { integer(rng) };
            let width = one_of(rng, &[2, 4, 8]);
            overwrite(rng, bytes, word, width);
        }
        4 => bytes.truncate(rng.random_range(0..n)),
        5 => drop(bytes.drain(range(rng, n))),
        6 => {
            let piece = bytes[range(rng, n)].to_vec();
            let at = rng.random_range(0..=n);
            bytes.splice(at..at, piece);
        }
        7 => {
            let (piece, at) = (bytes[range(rng, n)].to_vec(), rng.random_range(0..n));
            let end = (at + piece.len()).min(n);
            bytes[at..end].copy_from_slice(&piece[..end - at]);
        }
        _ => bytes[range(rng, n)].fill(rng.random_range(0..2) * 0xff),
    }
}

/// Writes the low bytes of a word somewhere, in one order or the other.
fn overwrite(rng: &mut Rng, bytes: &mut [u8], word: u64, width: usize) {
    let Some(last) = bytes.len().checked_sub(width) else { return };
    let at = rng.random_range(0..=last);
    let place = &mut bytes[at..at + width];
    place.copy_from_slice(&word.to_le_bytes()[..width]);
    if once_in(rng, 2) {
        place.reverse();
    }
}

/// Breaks a text of values and marks, in one to five places; the result need not be UTF-8.
pub fn text(rng: &mut Rng, text: &str) -> Vec<u8> {
    let mut text = text.to_owned();
    for _ in 0..rng.random_range(1..=5) {
        break_text(rng, &mut text);
    }
    let mut broken = text.into_bytes();
    if once_in(rng, 8) {
        bytes(rng, &mut broken);
    }
    broken
}

fn break_text(rng: &mut Rng, text: &mut String) {
    match rng.random_range(0..13) {
        0..=3 => replace(rng, text, |byte| byte.is_ascii_digit()),
        4 => replace(rng, text, |byte| byte.is_ascii_alphanumeric()),
        5 => splice_word(rng, text),
        6 | 7 => {
            let at = boundary(rng, text);
            text.insert_str(at, one_of(rng, &MARKS));
        }
        8 => break_lines(rng, text),
        9 => {
            let at = boundary(rng, text);
            text.truncate(at);
        }
        10 => {
            let start = boundary(rng, text);
            let end = text.floor_char_boundary(start + rng.random_range(0..24)).max(start);
            text.replace_range(start..end, "");
        }
        11 if once_in(rng, 8) => {
            let n = one_of(rng, &[3, 30, 130, 1000, 5000]);
            let at = boundary(rng, text);
            let opening = one_of(rng, &OPENINGS);
            text.insert_str(at, &opening.repeat(n));
        }
        _ => {
            let at = boundary(rng, text);
            let digits = one_of(rng, &["0", "9", "1.", "a", " "]);
            let n = one_of(rng, &[1, 2, 20, 400]);
            text.insert_str(at, &digits.repeat(n));
        }
    }
}

/// A place where a character begins.
fn boundary(rng: &mut Rng, text: &str) -> usize {
    text.floor_char_boundary(rng.random_range(0..=text.len()))
}

/// The word around a place: letters, digits and what numbers are written with.
fn word_at(text: &str, at: usize) -> std::ops::Range<usize> {
    let is_word = |byte: &u8| byte.is_ascii_alphanumeric() || b"._+-".contains(byte);
    let bytes = text.as_bytes();
    let before = bytes[..at].iter().rev().take_while(|byte| is_word(byte)).count();
    let after = bytes[at..].iter().take_while(|byte| is_word(byte)).count();
    at - before..at + after
}

/// Puts something unexpected in place of a word that a byte of this kind stands in.
fn replace(rng: &mut Rng, text: &mut String, is_kind: impl Fn(&u8) -> bool) {
    let start = boundary(rng, text);
    let kind = |from: usize| text.as_bytes()[from..].iter().position(&is_kind).map(|ahead| from + ahead);
    let Some(at) = kind(start).or_else(|| kind(0)) else { return };
    let word = word_at(text, at);
    let told = match rng.random_range(0..4) {
        0 => float(rng).to_string(),
        1 => (integer(rng) as i64).to_string(),
        _ => one_of(rng, &WORDS).to_owned(),
    };
    text.replace_range(word, &told);
}

/// Puts one word of the text in place of another.
fn splice_word(rng: &mut Rng, text: &mut String) {
    let (from, to) = (boundary(rng, text), boundary(rng, text));
    let word = text[word_at(text, from)].to_owned();
    text.replace_range(word_at(text, to), &word);
}

/// Loses a line, repeats one, or puts one elsewhere.
fn break_lines(rng: &mut Rng, text: &mut String) {
    let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
    if lines.is_empty() {
        return;
    }
    let (one, other) = (rng.random_range(0..lines.len()), rng.random_range(0..lines.len()));
    match rng.random_range(0..3) {
        0 => drop(lines.remove(one)),
        1 => lines.insert(other, lines[one]),
        _ => lines.swap(one, other),
    }
    *text = lines.concat();
}

/// Puts numbers from the edges into some of the numbers of a record, which lie at these places.
pub fn scalars(rng: &mut Rng, record: &mut [u8], places: &[(usize, Scalar)]) {
    for _ in 0..rng.random_range(0..=3) {
        let (at, scalar) = one_of(rng, places);
        let bytes = match scalar {
            Scalar::F32 => (float(rng) as f32).to_le_bytes().to_vec(),
            Scalar::F64 => float(rng).to_le_bytes().to_vec(),
            Scalar::U32 => (integer(rng) as u32).to_le_bytes().to_vec(),
            Scalar::U64 | Scalar::I64 => integer(rng).to_le_bytes().to_vec(),
            Scalar::Record(name) => panic!("{name}: expected the places of its numbers"),
        };
        record[at..at + bytes.len()].copy_from_slice(&bytes);
    }
}
