//! Recordings of which messages, records or bytes are broken.

use rand::RngExt;

use crate::harness::Rng;
use crate::mutate::{self, integer, once_in, one_of};

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Kinds of records, those that a recording of ours holds and others.
const KINDS: [u8; 18] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 255];

/// What a recording says, topic by topic.
#[derive(Clone)]
pub struct Told {
    pub topic: String,
    pub data: Vec<u8>,
}

impl Told {
    pub fn new(topic: &str, data: &[u8]) -> Self {
        Self { topic: topic.to_owned(), data: data.to_vec() }
    }
}

/// A record: its kind and its content.
type Record = (u8, Vec<u8>);

fn text(word: &str) -> Vec<u8> {
    [&(word.len() as u32).to_le_bytes(), word.as_bytes()].concat()
}

/// The records of a recording without an index: a channel for every topic, then the messages.
fn records(messages: &[Told]) -> Vec<Record> {
    let mut topics: Vec<&str> = messages.iter().map(|told| told.topic.as_str()).collect();
    topics.sort_unstable();
    topics.dedup();
    let mut records = Vec::new();
    for (number, topic) in topics.iter().enumerate() {
        let number = number as u16 + 1;
        let schema = [&number.to_le_bytes(), text("surefoot").as_slice(), &text("c"), &text("")].concat();
        let both = [number.to_le_bytes(), number.to_le_bytes()].concat();
        let channel = [both.as_slice(), &text(topic), &text("c"), &[0; 4]].concat();
        records.extend([(3, schema), (4, channel)]);
    }
    for (number, told) in messages.iter().enumerate() {
        let channel = topics.iter().position(|topic| *topic == told.topic).unwrap_or(0) as u16 + 1;
        let time_ns = 1_000_000 * number as u64;
        let mut content = channel.to_le_bytes().to_vec();
        content.extend((number as u32).to_le_bytes());
        content.extend([time_ns.to_le_bytes(); 2].concat());
        content.extend(&told.data);
        records.push((5, content));
    }
    records
}

fn put(bytes: &mut Vec<u8>, (kind, content): &Record, length: u64) {
    bytes.push(*kind);
    bytes.extend(length.to_le_bytes());
    bytes.extend(content);
}

/// One chunk of all these records, not packed, without a checksum; sizes are what the caller says.
fn chunk(inner: &[u8], said_bytes: u64, compression: &str) -> Record {
    let content = [
        [0; 16].as_slice(),
        &said_bytes.to_le_bytes(),
        &[0; 4],
        &text(compression),
        &(inner.len() as u64).to_le_bytes(),
        inner,
    ];
    (6, content.concat())
}

/// A recording of these messages of which messages, records or bytes are broken. Messages are broken by `change`.
pub fn broken(rng: &mut Rng, messages: &[Told], change: impl Fn(&mut Rng, &mut Told)) -> Vec<u8> {
    let mut messages = messages.to_vec();
    for _ in 0..rng.random_range(0..4) {
        let (place, other) = (rng.random_range(0..messages.len()), rng.random_range(0..messages.len()));
        match rng.random_range(0..10) {
            0 if messages.len() > 1 => drop(messages.remove(place)),
            1 => messages.insert(place, messages[other].clone()),
            2 => messages.swap(place, other),
            3 => messages[place].topic = messages[other].topic.clone(),
            _ => change(rng, &mut messages[place]),
        }
    }
    let mut records = records(&messages);
    if once_in(rng, 5) {
        break_records(rng, &mut records);
    }
    let mut bytes = put_together(rng, &records);
    if once_in(rng, 5) {
        mutate::bytes(rng, &mut bytes);
    }
    bytes
}

fn break_records(rng: &mut Rng, records: &mut Vec<Record>) {
    let (place, other) = (rng.random_range(0..records.len()), rng.random_range(0..records.len()));
    match rng.random_range(0..5) {
        0 => drop(records.remove(place)),
        1 => records.insert(place, records[other].clone()),
        2 => records.swap(place, other),
        3 => records[place].0 = one_of(rng, &KINDS),
        _ => mutate::bytes(rng, &mut records[place].1),
    }
}

fn put_together(rng: &mut Rng, records: &[Record]) -> Vec<u8> {
    let mut data = Vec::new();
    for record in records {
        let length = if once_in(rng, 200) { integer(rng) } else { record.1.len() as u64 };
        put(&mut data, record, length);
    }
    if once_in(rng, 3) {
        let said_bytes = if once_in(rng, 4) { integer(rng) } else { data.len() as u64 };
        let compression = if once_in(rng, 8) { one_of(rng, &["lz4", "zstd", "none"]) } else { "" };
        let chunk = chunk(&data, said_bytes, compression);
        data = Vec::new();
        put(&mut data, &chunk, chunk.1.len() as u64);
    }
    file_of(&data)
}

/// A recording of these messages as they are.
pub fn whole(messages: &[Told]) -> Vec<u8> {
    let mut data = Vec::new();
    records(messages).iter().for_each(|record| put(&mut data, record, record.1.len() as u64));
    file_of(&data)
}

fn file_of(data: &[u8]) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    let header = (1, [text(""), text("")].concat());
    put(&mut bytes, &header, header.1.len() as u64);
    bytes.extend(data);
    put(&mut bytes, &(15, vec![0; 4]), 4);
    put(&mut bytes, &(2, vec![0; 20]), 20);
    bytes.extend(MAGIC);
    bytes
}
