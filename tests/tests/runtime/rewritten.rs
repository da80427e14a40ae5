//! A publisher that goes on writing where its message lies after it was sent: by the file of its shared memory.

use std::fs::{File, OpenOptions};
use std::mem::offset_of;
use std::os::unix::fs::FileExt;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use bicycle::Decision;
use bus::channel::{Bus, Channel, DECISION, Inlet, MISSION, ODOMETRY, Outlet, RISK, Refusal, TRACKS};
use bus::clock::now_ns;
use bus::message::{
    CommandRecord, DecisionRecord, Grid, MissionRecord, OdometryRecord, RiskHeader, Stamp, TRACKS_MAX,
    TrackRecord, TracksHeader,
};
use bus::payload::{RiskParts, risk_views};
use bus::status::Role;
use terrain::GridGeometry;
use traversability::{Risk, RiskMap};

use crate::fixture::{Run, machine};

/// What every message of these tests carries, so that it is found again in the memory of its publisher.
const MARK: u64 = 0x5eed_0f0d_d1ce_cafe;
const GEOMETRY: GridGeometry = GridGeometry { resolution_m: 0.5, origin: [-48, -48], n_rows: 96, n_cols: 96 };
const N_YAWS: usize = 8;

fn parts() -> RiskParts {
    RiskParts::new(&GEOMETRY, N_YAWS, 0)
}

fn header() -> RiskHeader {
    RiskHeader {
        grid: Grid::from(&GEOMETRY),
        n_yaws: N_YAWS as u64,
        map_source: 1,
        odometry_at_ns: now_ns(),
        content_hash: MARK,
        ..RiskHeader::default()
    }
}

fn send_map(outlet: &mut Outlet<RiskHeader, [f32; 4]>) {
    let map = RiskMap::constant(GEOMETRY, N_YAWS, Risk::NONE);
    let known = map.view();
    let mut loan = outlet.write(parts().n_elements(), |place| parts().element(&known, place)).unwrap();
    let [seconds, _] = parts().times_mut(loan.payload_mut());
    // The goal lies in the east.
    seconds
        .iter_mut()
        .enumerate()
        .for_each(|(place, s)| *s = (GEOMETRY.n_cols - place % GEOMETRY.n_cols) as f32);
    *loan.header_mut() = header();
    outlet.send(loan, now_ns()).unwrap();
}

/// The memory of a publisher of risk maps, as its file.
struct Memory {
    file: File,
    /// Of each message: where its number of elements stands, and where its header begins.
    messages: Vec<[u64; 2]>,
    n_bytes: u64,
}

impl Memory {
    /// `None` while every mark has been written over.
    fn of(run: &Run) -> Option<Self> {
        run.shared_memory().into_iter().find_map(|path| {
            let bytes = std::fs::read(&path).ok()?;
            let words: Vec<u64> =
                bytes.chunks_exact(8).map(|word| u64::from_le_bytes(word.try_into().unwrap())).collect();
            let marks = words.iter().enumerate().filter(|(_, word)| **word == MARK);
            let messages: Vec<[u64; 2]> = marks.filter_map(|(place, _)| message_at(&words, place)).collect();
            let file = OpenOptions::new().write(true).open(&path).ok()?;
            (!messages.is_empty()).then_some(Self { file, messages, n_bytes: bytes.len() as u64 })
        })
    }

    fn write(&self, at: u64, bytes: &[u8]) {
        // The file keeps its length.
        let room = self.n_bytes.saturating_sub(at).min(bytes.len() as u64) as usize;
        self.file.write_all_at(&bytes[..room], at).unwrap();
    }

    fn write_word(&self, at: u64, word: u64) {
        self.write(at, &word.to_le_bytes());
    }

    /// Says of a message that it has so many elements, and a grid and yaws for as many.
    fn lengthen(&self, [n_at, header_at]: [u64; 2], n_edge: u64, n_yaws: u64) {
        let grid = Grid { n_rows: n_edge, n_cols: n_edge, ..header().grid }.geometry().unwrap();
        self.write_word(n_at, RiskParts::new(&grid, n_yaws as usize, 0).n_elements() as u64);
        self.write_word(header_at + offset_of!(RiskHeader, grid.n_rows) as u64, n_edge);
        self.write_word(header_at + offset_of!(RiskHeader, grid.n_cols) as u64, n_edge);
        self.write_word(header_at + offset_of!(RiskHeader, n_yaws) as u64, n_yaws);
    }
}

/// Of the message with its mark at this word: where its number of elements stands, a few words before its header, and
/// its header.
fn message_at(words: &[u64], mark: usize) -> Option<[u64; 2]> {
    let header = mark.checked_sub(offset_of!(RiskHeader, content_hash) / 8)?;
    let n_elements = parts().n_elements() as u64;
    let n_at = (header.saturating_sub(16)..header).rev().find(|place| words[*place] == n_elements)?;
    Some([8 * n_at as u64, 8 * header as u64])
}

#[test]
fn a_map_that_says_it_is_longer_than_its_publishers_memory_is_refused() {
    let run = Run::new();
    let bus = Bus::join(&run.name).unwrap();
    let mut inlet = bus.inlet(&RISK).unwrap();
    // One to whom a message without elements would be right: scans have none at times.
    let mut lenient = bus.inlet(&Channel { check: |_, _| Ok(()), ..RISK }).unwrap();
    let mut outlet = bus.outlet(&RISK, parts().n_elements()).unwrap();
    send_map(&mut outlet);
    let memory = Memory::of(&run).unwrap();
    memory.lengthen(memory.messages[0], 1 << 14, 1024);
    assert!(inlet.newest().is_none());
    assert_eq!(inlet.counts().of(Refusal::Malformed), 1);
    lenient.poll(|_, elements| panic!("taken as one of {} elements", elements.len()));
    assert_eq!(lenient.counts().of(Refusal::Malformed), 1);
}

#[test]
fn a_map_that_was_taken_keeps_its_header_and_its_length() {
    let run = Run::new();
    let bus = Bus::join(&run.name).unwrap();
    let mut inlet = bus.inlet(&RISK).unwrap();
    let mut outlet = bus.outlet(&RISK, parts().n_elements()).unwrap();
    send_map(&mut outlet);
    let message = inlet.newest().unwrap();
    let memory = Memory::of(&run).unwrap();
    let [n_at, header_at] = memory.messages[0];
    memory.write(header_at, &[0xff; size_of::<RiskHeader>()]);
    assert_eq!((message.header().n_yaws, message.header().content_hash), (N_YAWS as u64, MARK));
    for n_elements in [0, 1, parts().n_elements() as u64 + 1, 1 << 40, u64::MAX] {
        memory.write_word(n_at, n_elements);
        assert!(message.payload().is_empty(), "{n_elements} elements");
    }
    memory.write_word(n_at, parts().n_elements() as u64);
    let (map, _) = risk_views(message.header(), message.payload()).unwrap();
    assert_eq!((map.geometry, map.n_yaws), (GEOMETRY, N_YAWS));
}

/// The memory that [`check_and_write_over`] writes over.
static CHECKED: Mutex<Option<Memory>> = Mutex::new(None);

/// The check of the channel, with a publisher that writes over header, length and elements as soon as it has passed.
fn check_and_write_over(header: &RiskHeader, elements: &[[f32; 4]]) -> Result<(), Refusal> {
    let judged = (RISK.check)(header, elements);
    if let Some(memory) = &*CHECKED.lock().unwrap() {
        let [n_at, header_at] = memory.messages[0];
        memory.write(header_at, &vec![0xff; size_of::<RiskHeader>() + 16 * elements.len()]);
        memory.write_word(n_at, u64::MAX);
    }
    judged
}

#[test]
fn what_is_taken_by_polling_is_what_was_checked() {
    let run = Run::new();
    let bus = Bus::join(&run.name).unwrap();
    let mut inlet = bus.inlet(&Channel { check: check_and_write_over, ..RISK }).unwrap();
    let mut outlet = bus.outlet(&RISK, parts().n_elements()).unwrap();
    send_map(&mut outlet);
    *CHECKED.lock().unwrap() = Memory::of(&run);
    let mut n_taken = 0;
    inlet.poll(|header, elements| {
        assert_eq!((header.n_yaws, header.content_hash), (N_YAWS as u64, MARK));
        assert_eq!((RISK.check)(header, elements), Ok(()));
        n_taken += 1;
    });
    assert_eq!(n_taken, 1);
    assert!(Memory::of(&run).is_none(), "nothing was written over");
}

/// Numbers that are as good as any, the same in every run of the test.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        // Constants of Knuth's MMIX generator; its upper bits are the better ones.
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 16
    }

    fn of(&mut self, n: u64) -> u64 {
        self.next() % n
    }
}

/// Bytes that numbers are made of: such as no map holds, and any.
fn bytes(numbers: &mut Numbers, n: usize) -> Vec<u8> {
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, -1.0, 1e-42, 1e30];
    let value = odd[numbers.of(odd.len() as u64) as usize].to_le_bytes();
    let is_any = numbers.of(2) == 0;
    (0..n).map(|place| if is_any { numbers.next() as u8 } else { value[place % 4] }).collect()
}

/// Writes over a message somewhere: its length, its header, its elements.
fn write_somewhere(memory: &Memory, numbers: &mut Numbers) {
    let message = memory.messages[numbers.of(memory.messages.len() as u64) as usize];
    let [n_at, header_at] = message;
    let header_bytes = size_of::<RiskHeader>() as u64;
    match numbers.of(6) {
        0 => memory.write_word(n_at, [0, 1, 1 << 40, u64::MAX / 16, u64::MAX][numbers.of(5) as usize]),
        1 => memory.lengthen(message, 1 << 14, 1024),
        2 => memory.write(header_at + 8 * numbers.of(header_bytes / 8), &bytes(numbers, 8)),
        // As it was: most of the time the map is driven on.
        3 => memory.write_word(n_at, parts().n_elements() as u64),
        _ => {
            let n_bytes = 16 * parts().n_elements() as u64;
            let at = header_at + header_bytes + 4 * numbers.of(n_bytes / 4);
            let n = numbers.of(1 << 16).min(header_at + header_bytes + n_bytes - at);
            memory.write(at, &bytes(numbers, n as usize));
        }
    }
}

/// Everybody but control, in one process.
struct Others {
    odometry: Outlet<Stamp, OdometryRecord>,
    missions: Outlet<Stamp, MissionRecord>,
    tracks: Outlet<TracksHeader, TrackRecord>,
    risks: Outlet<RiskHeader, [f32; 4]>,
    decisions: Inlet<Stamp, DecisionRecord>,
    decided: Vec<DecisionRecord>,
    n_steps: u64,
}

impl Others {
    /// A fiftieth of a second: odometry, now and then a mission, that nothing moves, and a map, which nobody writes into
    /// meanwhile.
    fn step(&mut self, writing: &Mutex<()>) {
        // It stands, as its sensors see it: never twice at the same place.
        let x_m = 0.01 * (self.n_steps % 2) as f64;
        let record = OdometryRecord { position_m: [x_m, 0.0, 0.0], ..OdometryRecord::default() };
        self.odometry.send_one(Stamp::default(), record, now_ns()).unwrap();
        if self.n_steps.is_multiple_of(20) {
            let mission = MissionRecord { goal_m: [20.0, 0.0], tolerance_m: 1.0, ..MissionRecord::default() };
            self.missions.send_one(Stamp::default(), mission, now_ns()).unwrap();
        }
        if self.n_steps.is_multiple_of(10) {
            let nothing = self.tracks.write(0, |_| TrackRecord::default()).unwrap();
            self.tracks.send(nothing, now_ns()).unwrap();
            let nobody = writing.lock().unwrap();
            send_map(&mut self.risks);
            drop(nobody);
        }
        self.n_steps += 1;
        let decided = &mut self.decided;
        self.decisions.poll(|_, records| decided.push(records[0]));
        std::thread::sleep(Duration::from_millis(20));
    }

    fn until(&mut self, what: &str, holds: impl Fn(&[DecisionRecord]) -> bool) {
        self.decided.clear();
        for _ in 0..3000 {
            self.step(&Mutex::new(()));
            if holds(&self.decided) {
                return;
            }
        }
        panic!("{what}: not within a minute; {:?}", self.decided.last());
    }
}

fn is_drive(record: &DecisionRecord) -> bool {
    matches!(record.command.decision(), Some(Decision::Drive(_)))
}

#[test]
fn control_decides_whatever_becomes_of_the_map_that_it_reads() {
    let mut run = Run::new();
    let bus = Bus::join(&run.name).unwrap();
    let mut others = Others {
        odometry: bus.outlet(&ODOMETRY, 1).unwrap(),
        missions: bus.outlet(&MISSION, 1).unwrap(),
        tracks: bus.outlet(&TRACKS, TRACKS_MAX).unwrap(),
        risks: bus.outlet(&RISK, parts().n_elements()).unwrap(),
        decisions: bus.inlet(&DECISION).unwrap(),
        decided: Vec::new(),
        n_steps: 0,
    };
    run.start(Role::Control);
    others.until("driving", |decided| decided.last().is_some_and(is_drive));

    others.decided.clear();
    let (writing, is_over) = (Mutex::new(()), AtomicBool::new(false));
    let n_written = std::thread::scope(|scope| {
        let writer = scope.spawn(|| {
            let mut numbers = Numbers(1);
            let mut n_written = 0u64;
            while !is_over.load(Ordering::Relaxed) {
                let alone = writing.lock().unwrap();
                if let Some(memory) = Memory::of(&run) {
                    (0..200).for_each(|_| write_somewhere(&memory, &mut numbers));
                    n_written += 200;
                }
                drop(alone);
                std::thread::sleep(Duration::from_micros(200));
            }
            n_written
        });
        (0..400).for_each(|_| others.step(&writing));
        is_over.store(true, Ordering::Relaxed);
        writer.join().unwrap()
    });
    let decided = std::mem::take(&mut others.decided);
    println!("{} decisions while the map was written over {n_written} times", decided.len());
    assert!(decided.len() > 30, "{} decisions in 8 s", decided.len());
    let (limits, first) = (machine().0.limits, decided[0].cycle);
    for (place, record) in decided.iter().enumerate() {
        assert_eq!(record.cycle, first + place as u64, "control has begun anew");
        let CommandRecord { speed_mps, steering_rad, .. } = record.command;
        let speed_mps = f64::from(speed_mps);
        assert!(record.command.decision().is_some(), "{record:?}");
        assert!(
            (-limits.reverse_speed_max_mps..=limits.speed_max_mps + 1e-3).contains(&speed_mps),
            "{record:?}"
        );
        assert!(f64::from(steering_rad).abs() <= limits.steering_max_rad + 1e-3, "{record:?}");
    }
    assert!(decided.iter().any(|record| !is_drive(record)), "what was written was read");
    others.until("driving on a map that is whole again", |decided| decided.last().is_some_and(is_drive));
    run.end();
}

/// The reader of a map: where it lies is where it was written, so that the test above tests what it says.
#[test]
fn what_is_written_after_sending_is_read() {
    let run = Run::new();
    let bus = Bus::join(&run.name).unwrap();
    let mut inlet = bus.inlet(&RISK).unwrap();
    let mut outlet = bus.outlet(&RISK, parts().n_elements()).unwrap();
    send_map(&mut outlet);
    let message = inlet.newest().unwrap();
    let memory = Memory::of(&run).unwrap();
    let at = memory.messages[0][1] + size_of::<RiskHeader>() as u64;
    memory.write(at, &vec![0xff; 16 * parts().n_elements()]);
    let read = |message: &bus::channel::Message<RiskHeader, [f32; 4]>| -> [bool; 2] {
        let (map, times) = risk_views(message.header(), message.payload()).unwrap();
        [map.risks[0].roll_rad.is_nan(), times.seconds[times.seconds.len() - 1].is_nan()]
    };
    assert_eq!(read(&message), [true, true]);
}
