//! What a channel promises, within one process: no copy, gaps counted, one publisher.

use bicycle::Model;
use bus::channel::{Bus, Inlet, MISSION, ODOMETRY, RISK};
use bus::message::{Grid, MissionRecord, OdometryRecord, RiskHeader, Stamp, SurfaceHeader};
use bus::payload::{RiskParts, cell_numbers, risk_views};
use navigator::{Assessor, Belief, Destination};
use runtime::mapping::{LEARNED, send_risk};
use runtime::risk_maker::RiskMaker;
use terrain::{GridGeometry, SurfaceCell, TerrainClass};
use traversability::{CvarLevel, Risk, RiskMap};

use crate::fixture::{ALPHA, Run, machine};

#[test]
fn a_risk_map_is_written_once_and_read_where_it_was_written() {
    let run = Run::new();
    let bus = Bus::join(&run.name).unwrap();
    let geometry = GridGeometry { resolution_m: 0.2, origin: [-4, 9], n_rows: 30, n_cols: 40 };
    let map = RiskMap::constant(geometry, 16, Risk::NONE);
    let (known, parts) = (map.view(), RiskParts::new(&geometry, 16, 0));
    let mut inlet = bus.inlet(&RISK).unwrap();
    let mut outlet = bus.outlet(&RISK, parts.n_elements()).unwrap();
    let mut n_written = vec![0u8; parts.n_elements()];
    let mut loan = outlet
        .write(parts.n_elements(), |place| {
            n_written[place] += 1;
            parts.element(&known, place)
        })
        .unwrap();
    assert!(n_written.iter().all(|n| *n == 1), "every element is written once");
    *loan.header_mut() =
        RiskHeader { grid: Grid::from(&geometry), n_yaws: 16, map_source: 1, ..RiskHeader::default() };
    // The reader maps the same memory at another address: a change after the last write shows in both.
    let marked = parts.risks_mut(loan.payload_mut());
    marked[777].pitch_rad = 0.25;
    outlet.send(loan, 1).unwrap();
    let message = inlet.newest().unwrap();
    let (view, _) = risk_views(message.header(), message.payload()).unwrap();
    assert_eq!(
        view.risks.as_ptr().cast(),
        message.payload().as_ptr(),
        "the view is borrowed from the message"
    );
    assert_eq!((view.risks[777].pitch_rad, view.risks[0]), (0.25, known.risks[0]));
    assert_eq!(view.ground, known.ground);
}

/// The way that every risk map goes: learning writes it, control reads it. Whoever copied it or put it into another form
/// on that way would have to allocate as much as it is long.
#[test]
fn a_risk_map_is_sent_and_read_without_memory_of_its_own() {
    let run = Run::new();
    let bus = Bus::join(&run.name).unwrap();
    let (vehicle, config) = machine();
    let limits = Model::of(&vehicle).limits;
    let level = CvarLevel::new(ALPHA).unwrap();
    let assessor = Assessor::new(&vehicle, &limits, &config, &Belief::Physics, level).unwrap();
    let mut maker = RiskMaker::new(assessor, LEARNED, 0);
    maker.set_destination(Destination { goal_m: [8.0, 0.0], tolerance_m: 0.5 });
    let (n_rows, n_cols) = (config.elevation.n_rows, config.elevation.n_cols);
    let origin = [n_cols, n_rows].map(|n| -(n as i64) / 2);
    let geometry = GridGeometry { resolution_m: config.elevation.resolution_m, origin, n_rows, n_cols };
    let header = SurfaceHeader { grid: Grid::from(&geometry), ..SurfaceHeader::default() };
    let ground = cell_numbers(&SurfaceCell::certain(0.0, TerrainClass::Open, 0.0));
    let mut outlet = None;
    let mut inlet = bus.inlet(&RISK).unwrap();
    let mut n_bytes = 0;
    // The first time, what is kept for the next is allocated.
    let counts = [0, 1].map(|_| {
        maker.update(&header, &vec![ground; geometry.n_cells()]).unwrap().unwrap();
        let n = maker.n_elements().unwrap();
        let outlet = outlet.get_or_insert_with(|| bus.outlet(&RISK, n).unwrap());
        allocation_counter::measure(|| {
            send_risk(&mut maker, outlet, 1).unwrap();
            let message = inlet.newest().unwrap();
            let (map, times) = risk_views(message.header(), message.payload()).unwrap();
            let place = message.payload().as_ptr_range();
            assert!(
                place.contains(&map.risks.as_ptr().cast()) && place.contains(&map.ground.as_ptr().cast())
            );
            assert!(place.contains(&times.seconds.as_ptr().cast()));
            assert!(place.contains(&times.turning_s[0..].as_ptr().cast()));
            n_bytes = size_of_val(message.payload());
        })
    });
    assert!(n_bytes > 100_000, "a map worth the name: {n_bytes}");
    assert!(counts[1].bytes_total < n_bytes as u64 / 50, "{:?} for {n_bytes} bytes", counts[1]);
}

#[test]
fn messages_that_were_dropped_are_counted() {
    let run = Run::new();
    let bus = Bus::join(&run.name).unwrap();
    let mut inlet = bus.inlet(&ODOMETRY).unwrap();
    let mut outlet = bus.outlet(&ODOMETRY, 1).unwrap();
    let n_sent = ODOMETRY.depth as u64 + 5;
    let mut send = |n: u64| {
        for at_ns in 1..=n {
            outlet.send_one(Stamp::default(), OdometryRecord::default(), at_ns).unwrap();
        }
    };
    send(1);
    inlet.poll(|_, _| ());
    send(n_sent);
    let mut sequences = Vec::new();
    inlet.poll(|stamp, _| sequences.push(stamp.sequence));
    assert_eq!(sequences, (7..=n_sent + 1).collect::<Vec<_>>(), "the youngest, in their order");
    assert_eq!((inlet.counts().lost, inlet.counts().received), (5, 1 + ODOMETRY.depth as u64));
}

fn at(x_m: f64) -> OdometryRecord {
    OdometryRecord { position_m: [x_m, 0.0, 0.0], ..OdometryRecord::default() }
}

/// Where the messages that have come say to be.
fn heard(inlet: &mut Inlet<Stamp, OdometryRecord>) -> Vec<f64> {
    let mut heard = Vec::new();
    inlet.poll(|_, records| heard.push(records[0].position_m[0]));
    heard
}

/// The first reader looks while only the first publisher has spoken; the second reader comes when both have, and is told
/// by the second publisher first.
#[test]
fn two_readers_follow_the_same_publisher_whatever_they_heard_first() {
    let run = Run::new();
    let (first, second) = (Bus::join(&run.name).unwrap(), Bus::join(&run.name).unwrap());
    let mut early = first.inlet(&ODOMETRY).unwrap();
    let mut one = first.outlet(&ODOMETRY, 1).unwrap();
    let mut other = second.outlet(&ODOMETRY, 1);
    one.send_one(Stamp::default(), at(1.0), 1).unwrap();
    let mut followed = vec![heard(&mut early)];
    let mut late = second.inlet(&ODOMETRY).unwrap();
    if let Ok(other) = &mut other {
        other.send_one(Stamp::default(), at(2.0), 2).unwrap();
    }
    followed.push(heard(&mut late));
    one.send_one(Stamp::default(), at(1.0), 3).unwrap();
    followed.extend([heard(&mut early), heard(&mut late)]);
    assert_eq!(followed, [vec![1.0], vec![], vec![1.0], vec![1.0]], "the one that has the channel");
    let told = other.err().expect("the channel has its publisher").to_string();
    assert!(told.contains("channel odometry: expected to be its only publisher"), "{told}");

    // What has the channel next is heard by both at once.
    drop(one);
    let mut next = second.outlet(&ODOMETRY, 1).unwrap();
    next.send_one(Stamp::default(), at(3.0), 4).unwrap();
    assert_eq!([heard(&mut early), heard(&mut late)], [[3.0], [3.0]]);
}

#[test]
fn a_publisher_whose_memory_cannot_be_reached_is_counted_as_a_failure() {
    let run = Run::new();
    let (here, there) = (Bus::join(&run.name).unwrap(), Bus::join(&run.name).unwrap());
    let files = |run: &Run| std::collections::BTreeSet::from_iter(run.shared_memory());
    let mut inlet = here.inlet(&ODOMETRY).unwrap();
    let before = files(&run);
    let mut outlet = there.outlet(&ODOMETRY, 1).unwrap();
    for file in files(&run).difference(&before) {
        std::fs::remove_file(file).unwrap();
    }
    outlet.send_one(Stamp::default(), OdometryRecord::default(), 1).unwrap();
    inlet.poll(|_, _| panic!("nobody can have heard that"));
    assert!(inlet.counts().failed > 0, "{:?}", inlet.counts());
}

/// A recorder that is started on the way: what was said last counts for it as for all others, long before it is said
/// again.
#[test]
fn who_comes_late_is_given_the_last_mission_and_no_older_one() {
    let run = Run::new();
    let (here, there) = (Bus::join(&run.name).unwrap(), Bus::join(&run.name).unwrap());
    let mut outlet = here.outlet(&MISSION, 1).unwrap();
    for number in 1..=3 {
        let mission = MissionRecord { number, ..MissionRecord::default() };
        outlet.send_one(Stamp::default(), mission, number).unwrap();
    }
    let mut late = there.inlet(&MISSION).unwrap();
    outlet.welcome();
    let mut heard = Vec::new();
    late.poll(|stamp, missions| heard.push((stamp.sequence, missions[0].number)));
    assert_eq!(heard, [(3, 3)]);
    outlet.send_one(Stamp::default(), MissionRecord::default(), 4).unwrap();
    late.poll(|stamp, missions| heard.push((stamp.sequence, missions[0].number)));
    assert_eq!((heard, late.counts().lost), (vec![(3, 3), (4, 0)], 0), "and then as everybody");
}
