//! Those who only look on.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::atomic::{AtomicBool, AtomicU16, Ordering};
use std::time::Duration;

use bicycle::Decision;
use bus::channel::{
    Bus, CHECKPOINT, COMMAND, ChannelError, DECISION, Inlet, MISSION, ODOMETRY, RISK, RISK_PHYSICS, SCAN,
    STUCK, SURFACE,
};
use bus::clock;
use bus::message::{DecisionRecord, OdometryRecord, Stamp};
use bus::status::Role;
use runtime::live;
use runtime::supervisor::{RestartPolicy, Supervisor};

use crate::fixture::{Run, eventually};

/// Longest that a machine under load may need for anything here [s].
const LIMIT_S: f64 = 60.0;

/// The least of a WebSocket client.
struct Client {
    stream: TcpStream,
    left: Vec<u8>,
}

impl Client {
    fn connect(port: u16) -> Self {
        let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs_f64(LIMIT_S))).unwrap();
        let asked = "GET / HTTP/1.1\r\nHost: surefoot\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
             Sec-WebSocket-Key: c3VyZWZvb3Qtc3VyZWZvbw==\r\nSec-WebSocket-Version: 13\r\n\
             Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n";
        stream.write_all(asked.as_bytes()).unwrap();
        let mut client = Self { stream, left: Vec::new() };
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            head.extend(client.take(1));
        }
        assert!(head.starts_with(b"HTTP/1.1 101"), "{}", String::from_utf8_lossy(&head));
        client
    }

    fn take(&mut self, n: usize) -> Vec<u8> {
        while self.left.len() < n {
            let mut more = [0; 4096];
            let n_read = self.stream.read(&mut more).unwrap();
            assert!(n_read > 0, "the server hung up");
            self.left.extend(&more[..n_read]);
        }
        self.left.drain(..n).collect()
    }

    /// Kind and payload of the next frame.
    fn frame(&mut self) -> (u8, Vec<u8>) {
        let head = self.take(2);
        let n = match head[1] & 127 {
            126 => u64::from(u16::from_be_bytes(self.take(2).try_into().unwrap())),
            127 => u64::from_be_bytes(self.take(8).try_into().unwrap()),
            n => u64::from(n),
        };
        (head[0] & 15, self.take(n as usize))
    }

    /// Masked by nothing, as the protocol permits.
    fn say(&mut self, text: &str) {
        let mut frame = vec![0x81, 0x80 | 126];
        frame.extend((text.len() as u16).to_be_bytes());
        frame.extend([0; 4]);
        frame.extend(text.as_bytes());
        self.stream.write_all(&frame).unwrap();
    }
}

/// Somebody who reads everything.
struct ThirdParty {
    decisions: Inlet<Stamp, DecisionRecord>,
    _others: Box<dyn std::any::Any>,
}

impl ThirdParty {
    fn join(run: &Run) -> Result<Self, ChannelError> {
        let bus = Bus::join(&run.name)?;
        let decisions = bus.inlet(&DECISION)?;
        let small = (bus.inlet(&ODOMETRY)?, bus.inlet(&COMMAND)?, bus.inlet(&STUCK)?, bus.inlet(&MISSION)?);
        let maps = (bus.inlet(&SURFACE)?, bus.inlet(&RISK)?, bus.inlet(&RISK_PHYSICS)?);
        let rest = (bus.inlet(&SCAN)?, bus.inlet(&CHECKPOINT)?);
        let statuses: Vec<_> =
            Role::ALL.iter().map(|role| bus.inlet(&role.status())).collect::<Result<_, _>>()?;
        Ok(Self { decisions, _others: Box::new((bus, small, maps, rest, statuses)) })
    }
}

/// The guests come first: whoever found no room would be one of the run's own.
#[test]
fn all_roles_the_live_view_and_two_third_parties_have_room() {
    let mut run = Run::new();
    let mut guests = [ThirdParty::join(&run).unwrap(), ThirdParty::join(&run).unwrap()];
    let bus = Bus::join(&run.name).unwrap();
    let never = |_, _| std::process::Command::new("false");
    let _supervisor = Supervisor::new(&bus, &Role::SIMULATED, RestartPolicy::default(), &never).unwrap();
    // Learning with --learn reads these, too.
    let _school = (bus.inlet(&ODOMETRY).unwrap(), bus.inlet(&COMMAND).unwrap());
    run.start_all(&Role::SIMULATED);
    let (is_over, port) = (AtomicBool::new(false), AtomicU16::new(0));
    std::thread::scope(|scope| {
        let live = scope.spawn(|| {
            let bus = Bus::join(&run.name).unwrap();
            let is_over = || is_over.load(Ordering::Relaxed);
            live::run(&bus, ("127.0.0.1", 0), &is_over, &mut |at| port.store(at, Ordering::Relaxed)).unwrap();
        });
        let mut has_driven = [false; 2];
        let found = eventually(LIMIT_S, || {
            for (guest, has_driven) in guests.iter_mut().zip(&mut has_driven) {
                guest.decisions.poll(|_, records| {
                    *has_driven |= matches!(records[0].command.decision(), Some(Decision::Drive(_)));
                });
            }
            let is_all = has_driven == [true; 2] && port.load(Ordering::Relaxed) > 0;
            (is_all && !run.recordings().is_empty()).then_some(())
        });
        let is_viewed = !live.is_finished();
        is_over.store(true, Ordering::Relaxed);
        assert!(found.is_some() && is_viewed, "somebody found no room");
    });
    // It is counted: whoever comes beyond that is told what to do.
    let told = ThirdParty::join(&run).err().expect("every place is taken").to_string();
    assert!(told.contains("expected at most 4 readers") && told.contains("--third-parties"), "{told}");
    run.end();
}

#[test]
fn who_looks_on_is_told_the_topics_and_where_the_vehicle_is() {
    let run = Run::new();
    let (is_over, port) = (AtomicBool::new(false), AtomicU16::new(0));
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let bus = Bus::join(&run.name).unwrap();
            let is_over = || is_over.load(Ordering::Relaxed);
            live::run(&bus, ("127.0.0.1", 0), &is_over, &mut |at| port.store(at, Ordering::Relaxed)).unwrap();
        });
        scope.spawn(|| {
            let bus = Bus::join(&run.name).unwrap();
            let mut odometry = bus.outlet(&ODOMETRY, 1).unwrap();
            while !is_over.load(Ordering::Relaxed) {
                odometry.send_one(Stamp::default(), OdometryRecord::default(), clock::now_ns()).unwrap();
                std::thread::sleep(Duration::from_millis(20));
            }
        });
        let serving = || Some(port.load(Ordering::Relaxed)).filter(|port| *port > 0);
        let (_, at) = eventually(LIMIT_S, serving).expect("the live view serves");
        // One that never reads is nobody's concern.
        let _silent = Client::connect(at);
        let mut client = Client::connect(at);
        let told = loop {
            let (kind, payload) = client.frame();
            let told = String::from_utf8_lossy(&payload).into_owned();
            if kind == 1 && told.contains("\"advertise\"") {
                break told;
            }
        };
        for topic in ["/pose", "/tf", "/elevation", "/risk", "/path", "/goal"] {
            assert!(told.contains(&format!("\"{topic}\"")), "{topic}: {told}");
        }
        let told: serde_json::Value = serde_json::from_str(&told).unwrap();
        let is_pose = |channel: &&serde_json::Value| channel["topic"] == "/pose";
        let pose = told["channels"].as_array().unwrap().iter().find(is_pose).unwrap();
        assert_eq!(pose["schemaName"], "foxglove.PoseInFrame");
        client.say(&format!(
            "{{\"op\":\"subscribe\",\"subscriptions\":[{{\"id\":77,\"channelId\":{}}}]}}",
            pose["id"]
        ));
        let message = loop {
            let (kind, payload) = client.frame();
            if kind == 2 && payload[0] == 1 {
                break payload;
            }
        };
        assert_eq!(u32::from_le_bytes(message[1..5].try_into().unwrap()), 77);
        assert!(message.windows(3).any(|bytes| bytes == b"map"), "a pose in the map frame");
        is_over.store(true, Ordering::Relaxed);
    });
}
