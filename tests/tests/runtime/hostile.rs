//! Publishers that mean harm or are broken: what they send is refused by its reason, and a good one is heard.

use bus::channel::{Bus, COMMAND, Channel, Counts, Inlet, ODOMETRY, RISK, Refusal, RunName, SURFACE};
use bus::clock::now_ns;
use bus::message::{CommandRecord, Grid, LAYOUT_VERSION, OdometryRecord, RiskHeader, Stamp, SurfaceHeader};
use iceoryx2::config::Config;
use iceoryx2::node::NodeBuilder;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::prelude::{FileName, Path, SemanticString, SignalHandlingMode, ipc};

use crate::fixture::Run;

/// A publisher that fills in headers as it likes; it keeps its node alive.
struct Hostile<H: bus::channel::Header, T: bus::channel::Element> {
    publisher: Publisher<ipc::Service, [T], H>,
}

impl<H: bus::channel::Header, T: bus::channel::Element> Hostile<H, T> {
    fn new(run: &RunName, channel: &Channel<H, T>, n_max: usize) -> Self {
        let mut config = Config::default();
        config.global.prefix = FileName::new(run.prefix().as_bytes()).unwrap();
        config.global.set_root_path(&Path::new(run.folder().as_bytes()).unwrap());
        let node = NodeBuilder::new()
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .unwrap();
        let service = node
            .service_builder(&channel.name.try_into().unwrap())
            .publish_subscribe::<[T]>()
            .user_header::<H>()
            .open()
            .unwrap();
        Self { publisher: service.publisher_builder().initial_max_slice_len(n_max).create().unwrap() }
    }

    fn send(&self, header: H, payload: &[T]) {
        let loan = self.publisher.loan_slice_uninit(payload.len()).unwrap();
        let mut loan = loan.write_from_fn(|place| payload[place]);
        *loan.user_header_mut() = header;
        loan.send().unwrap();
    }
}

fn stamp(sequence: u64) -> Stamp {
    let now_ns = now_ns();
    Stamp {
        layout_version: LAYOUT_VERSION,
        epoch_ns: 1,
        sequence,
        valid_at_ns: now_ns,
        published_at_ns: now_ns,
        ..Stamp::default()
    }
}

fn polled<H: bus::channel::Header, T: bus::channel::Element>(inlet: &mut Inlet<H, T>) -> Counts {
    inlet.poll(|_, _| ());
    *inlet.counts()
}

#[test]
fn broken_commands_never_come_through() {
    let run = Run::new();
    let bus = Bus::join(&run.name).unwrap();
    let mut inlet = bus.inlet(&COMMAND).unwrap();
    let hostile = Hostile::new(&run.name, &COMMAND, 8);
    let drive = CommandRecord { speed_mps: 1.0, decision: 1, ..CommandRecord::default() };
    let future_ns = now_ns() + 3_600_000_000_000;
    let broken = [
        (Stamp { layout_version: LAYOUT_VERSION + 1, ..stamp(1) }, vec![drive], Refusal::LayoutVersion),
        (Stamp { valid_at_ns: future_ns, ..stamp(2) }, vec![drive], Refusal::FromFuture),
        (Stamp { published_at_ns: u64::MAX, ..stamp(3) }, vec![drive], Refusal::FromFuture),
        (stamp(4), vec![CommandRecord { speed_mps: f32::NAN, ..drive }], Refusal::NonFinite),
        (stamp(5), vec![CommandRecord { steering_rad: f32::INFINITY, ..drive }], Refusal::NonFinite),
        (stamp(6), vec![CommandRecord { decision: 77, ..drive }], Refusal::Malformed),
        (stamp(7), vec![], Refusal::Malformed),
        (stamp(8), vec![drive; 8], Refusal::Malformed),
    ];
    for (n, (stamp, payload, refusal)) in broken.iter().enumerate() {
        let before = inlet.counts().of(*refusal);
        hostile.send(*stamp, payload);
        let counts = polled(&mut inlet);
        assert_eq!(counts.of(*refusal), before + 1, "{n}: {refusal:?}");
        assert_eq!(counts.received, 0, "{n}");
    }
    // Nothing of that is remembered: the next publisher is heard at once.
    drop(hostile);
    let mut outlet = bus.outlet(&COMMAND, 1).unwrap();
    outlet.send_one(Stamp::default(), drive, now_ns()).unwrap();
    assert_eq!(polled(&mut inlet).received, 1);
}

/// What was applied is looked at here and nowhere else.
#[test]
fn odometry_that_tells_no_command_as_applied_never_comes_through() {
    let run = Run::new();
    let bus = Bus::join(&run.name).unwrap();
    let mut inlet = bus.inlet(&ODOMETRY).unwrap();
    let hostile = Hostile::new(&run.name, &ODOMETRY, 1);
    let well = OdometryRecord::default();
    let broken = [
        (OdometryRecord { applied_speed_mps: f32::NAN, ..well }, Refusal::NonFinite),
        (OdometryRecord { applied_steering_rad: f32::NEG_INFINITY, ..well }, Refusal::NonFinite),
        (OdometryRecord { applied_by: 2, ..well }, Refusal::Malformed),
        (OdometryRecord { applied_since_ns: now_ns() + 3_600_000_000_000, ..well }, Refusal::FromFuture),
    ];
    for (n, (record, refusal)) in broken.iter().enumerate() {
        let before = inlet.counts().of(*refusal);
        hostile.send(stamp(n as u64 + 1), &[*record]);
        let counts = polled(&mut inlet);
        assert_eq!((counts.of(*refusal), counts.received), (before + 1, 0), "{n}: {refusal:?}");
    }
    hostile.send(stamp(9), &[OdometryRecord { applied_by: 1, ..well }]);
    assert_eq!(polled(&mut inlet).received, 1);
}

#[test]
fn what_is_older_than_what_was_taken_does_not_count_again() {
    let run = Run::new();
    let bus = Bus::join(&run.name).unwrap();
    let mut inlet = bus.inlet(&COMMAND).unwrap();
    let hostile = Hostile::new(&run.name, &COMMAND, 1);
    let drive = CommandRecord { speed_mps: 1.0, decision: 1, ..CommandRecord::default() };
    let first = stamp(7);
    let earlier = |stamp: Stamp| Stamp { valid_at_ns: first.valid_at_ns - 1, ..stamp };
    for (stamp, received, out_of_order) in
        [(first, 1, 0), (first, 1, 1), (stamp(6), 1, 2), (earlier(stamp(8)), 1, 3), (stamp(9), 2, 3)]
    {
        hostile.send(stamp, &[drive]);
        let counts = polled(&mut inlet);
        assert_eq!((counts.received, counts.of(Refusal::OutOfOrder)), (received, out_of_order), "{stamp:?}");
    }
}

/// Each reader takes the latest publisher for the channel's, and none of before is heard again, whatever it sends.
#[test]
fn a_publisher_that_another_has_followed_is_heard_no_more() {
    let run = Run::new();
    let bus = Bus::join(&run.name).unwrap();
    let mut readers = [bus.inlet(&COMMAND).unwrap(), bus.inlet(&COMMAND).unwrap()];
    let drive = CommandRecord { speed_mps: 1.0, decision: 1, ..CommandRecord::default() };
    for (epoch_ns, sequence, received, others) in [(5, 1, 1, 0), (3, 9, 1, 1), (5, 9, 1, 2), (7, 1, 2, 2)] {
        let hostile = Hostile::new(&run.name, &COMMAND, 1);
        hostile.send(Stamp { epoch_ns, ..stamp(sequence) }, &[drive]);
        for inlet in &mut readers {
            let counts = polled(inlet);
            assert_eq!(
                (counts.received, counts.of(Refusal::OtherPublisher)),
                (received, others),
                "{epoch_ns}"
            );
        }
    }
}

#[test]
fn maps_with_huge_counts_and_wrong_lengths_never_come_through() {
    let run = Run::new();
    let bus = Bus::join(&run.name).unwrap();
    let (mut risks, mut surfaces) = (bus.inlet(&RISK).unwrap(), bus.inlet(&SURFACE).unwrap());
    let hostile_risk = Hostile::new(&run.name, &RISK, 16);
    let hostile_surface = Hostile::new(&run.name, &SURFACE, 16);
    let grid = Grid { resolution_m: 0.2, origin: [0, 0], n_rows: 2, n_cols: 2 };
    let risk = |grid: Grid, n_yaws: u64| RiskHeader {
        stamp: stamp(1),
        grid,
        n_yaws,
        map_source: 1,
        ..RiskHeader::default()
    };
    let huge = Grid { n_rows: u64::MAX, n_cols: u64::MAX, ..grid };
    let far = Grid { origin: [i64::MIN, i64::MAX], ..grid };
    for header in [risk(huge, 16), risk(grid, u64::MAX), risk(far, 1), risk(grid, 3), risk(grid, 0)] {
        let before = risks.counts().of(Refusal::Malformed);
        hostile_risk.send(header, &[[0.5; 4]; 7]);
        assert!(risks.newest().is_none(), "{header:?}");
        assert_eq!(risks.counts().of(Refusal::Malformed), before + 1);
    }
    for grid in [huge, far, Grid { n_rows: 3, ..grid }, Grid { resolution_m: -1.0, ..grid }] {
        hostile_surface
            .send(SurfaceHeader { stamp: stamp(1), grid, ..SurfaceHeader::default() }, &[[0.0; 8]; 4]);
        assert!(surfaces.newest().is_none(), "{grid:?}");
    }
    let header = SurfaceHeader { stamp: stamp(1), grid, ..SurfaceHeader::default() };
    let odd = [
        SurfaceHeader { jump_m: [f64::NAN; 3], ..header },
        SurfaceHeader { jump_yaw_rad: f64::INFINITY, ..header },
        SurfaceHeader { shift_yaw_rad: f64::NAN, ..header },
    ];
    for header in odd {
        hostile_surface.send(header, &[[0.0; 8]; 4]);
        assert!(surfaces.newest().is_none(), "{header:?}");
    }
    let nowhere = OdometryRecord { position_m: [1e19, 0.0, 0.0], ..OdometryRecord::default() };
    hostile_surface.send(SurfaceHeader { odometry: nowhere, ..header }, &[[0.0; 8]; 4]);
    assert!(surfaces.newest().is_none(), "a position that no window can be placed at");
    assert_eq!((surfaces.counts().of(Refusal::Malformed), surfaces.counts().of(Refusal::NonFinite)), (5, 3));
}

#[test]
fn a_flood_hides_nothing_that_is_whole() {
    let run = Run::new();
    let bus = Bus::join(&run.name).unwrap();
    let mut inlet = bus.inlet(&ODOMETRY).unwrap();
    let hostile = Hostile::new(&run.name, &ODOMETRY, 1);
    let mut heard = 0;
    for cycle in 1..=20u64 {
        for n in 0..500 {
            let flood = Stamp { layout_version: 99, ..stamp(500 * cycle + n) };
            hostile.send(flood, &[OdometryRecord::default()]);
        }
        // In the midst of its flood, what is whole counts.
        hostile.send(stamp(cycle), &[OdometryRecord::default()]);
        inlet.poll(|stamp, _| heard += u64::from(stamp.sequence == cycle));
    }
    assert_eq!(heard, 20);
    assert_eq!(inlet.counts().lost, 0);
}
