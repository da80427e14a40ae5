//! Processes of a run under test: this program itself, told by its environment which part to be.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use bicycle::{Model, Vehicle};
use bus::ages::{AgeLimits, Periods};
use bus::channel::{Bus, RunName};
use bus::status::Role;
use navigator::{Areas, Belief, Config, MovingConfig, Route};
use runtime::ages::{self, AskedAges};
use runtime::control::{self, ControlSetup};
use runtime::learning::{self, LearningSetup};
use runtime::mapping::{self, MappingSetup};
use runtime::mission::{self, Beginning, MissionSetup};
use runtime::recorder::{self, RecorderSetup};
use runtime::setup::{ClockAnchor, MachineSetup, RecordedSetup};
use rustix::process::{Pid, Signal, kill_process, set_parent_process_death_signal};
use scenarios::{EpisodeConfig, RockFieldConfig, Stride, Task, Walker};
use simulator::{self, Ending, PlantSetup};
use traversability::CvarLevel;

const ROLE: &str = "SUREFOOT_TEST_ROLE";
const RUN: &str = "SUREFOOT_TEST_RUN";
const FOLDER: &str = "SUREFOOT_TEST_FOLDER";
const FILE_BYTES: &str = "SUREFOOT_TEST_FILE_BYTES";
const FILE_TIME: &str = "SUREFOOT_TEST_FILE_TIME";
const QUOTA: &str = "SUREFOOT_TEST_QUOTA";
const SYNC: &str = "SUREFOOT_TEST_SYNC";
/// What recorders have to say goes into a file of this name.
const SAID: &str = "said";
/// A file of this name tells the processes to end.
const OVER: &str = "over";
pub const ALPHA: f64 = 0.6;
pub const SEED: u64 = 1;

/// A name that no other test and no other run of the tests has.
fn unique_run() -> RunName {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    let next = NEXT.fetch_add(1, Ordering::Relaxed);
    format!("test-{}-{next}", std::process::id()).parse().unwrap()
}

/// A full-size vehicle with coarse maps and few rollouts: what is tested is not how well it drives.
pub fn machine() -> (Vehicle, Config) {
    let vehicle = formats::read_vehicle("pietra_full_size").unwrap();
    let mut config = Config::for_vehicle(&vehicle);
    let resolution_m = 0.5;
    config.elevation.resolution_m = resolution_m;
    config.elevation.recentre_m = 4.0 * resolution_m;
    config.elevation.gap_radius_m = config.elevation.gap_radius_m.max(2.0 * resolution_m);
    config.risk_map.recentre_m = 4.0 * resolution_m;
    (config.risk_map.n_rows, config.risk_map.n_cols, config.risk_map.n_yaws) = (48, 48, 8);
    (config.elevation.n_rows, config.elevation.n_cols) = (68, 68);
    config.controller.n_rollouts = 256;
    config.controller.n_steps = 30;
    config.controller.n_threads = 1;
    config.moving = Some(MovingConfig::default());
    (vehicle, config)
}

/// Limits on ages as they are with the usual periods.
pub fn ages() -> AgeLimits {
    ages::limits(&Periods::default(), &machine().1.guard, &AskedAges::default()).unwrap()
}

/// When a recorder under test begins a new file or ends, and how large its disk is.
#[derive(Clone, Copy, Debug)]
pub struct RecorderLimits {
    pub file_bytes_max: u64,
    pub file_time_max_s: f64,
    pub quota_bytes: u64,
    pub disk_bytes: Option<u64>,
    /// Long, so that what the death of a recorder leaves is what it has flushed.
    pub sync_interval_s: f64,
}

impl Default for RecorderLimits {
    fn default() -> Self {
        Self {
            file_bytes_max: 1 << 30,
            file_time_max_s: 600.0,
            quota_bytes: 1 << 30,
            disk_bytes: None,
            sync_interval_s: 600.0,
        }
    }
}

/// The processes of one run; they end with it.
pub struct Run {
    pub name: RunName,
    pub folder: tempfile::TempDir,
    children: Vec<(Role, Child)>,
}

impl Run {
    pub fn new() -> Self {
        Self { name: unique_run(), folder: tempfile::tempdir().unwrap(), children: Vec::new() }
    }

    pub fn start(&mut self, role: Role) {
        let program = Command::new(std::env::current_exe().unwrap());
        self.spawn(role, program, &RecorderLimits::default());
    }

    /// Starts a recorder within limits. What is beyond its disk is refused by the system, as by a full one.
    pub fn start_recorder(&mut self, limits: &RecorderLimits) {
        let program = match limits.disk_bytes {
            None => Command::new(std::env::current_exe().unwrap()),
            Some(bytes) => {
                let script = format!("trap '' XFSZ; ulimit -f {}; exec \"$0\" \"$@\"", bytes / 512);
                let mut shell = Command::new("sh");
                shell.args(["-c", &script]).arg(std::env::current_exe().unwrap());
                shell
            }
        };
        self.spawn(Role::Recorder, program, limits);
    }

    /// Starts a recorder that asks for the disk twice a second and whose calls of the system's library go to another one
    /// first.
    pub fn start_recorder_with(&mut self, library: &Path) {
        let mut program = Command::new(std::env::current_exe().unwrap());
        program.env("LD_PRELOAD", library);
        let limits = RecorderLimits { sync_interval_s: 0.5, ..RecorderLimits::default() };
        self.spawn(Role::Recorder, program, &limits);
    }

    fn spawn(&mut self, role: Role, mut program: Command, limits: &RecorderLimits) {
        let child = program
            .args(["--exact", "process_of_its_own", "--nocapture"])
            .env(ROLE, role.name())
            .env(RUN, self.name.to_string())
            .env(FOLDER, self.folder.path())
            .env(FILE_BYTES, limits.file_bytes_max.to_string())
            .env(FILE_TIME, limits.file_time_max_s.to_string())
            .env(QUOTA, limits.quota_bytes.to_string())
            .env(SYNC, limits.sync_interval_s.to_string())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        self.children.push((role, child));
    }

    /// What recorders had to say.
    pub fn said_by_recorder(&self) -> Option<String> {
        let said = std::fs::read_to_string(self.folder.path().join(SAID)).ok();
        said.filter(|text| text.ends_with('\n'))
    }

    pub fn start_all(&mut self, roles: &[Role]) {
        roles.iter().for_each(|role| self.start(*role));
    }

    /// Sends a signal to the process of a role.
    pub fn signal(&self, role: Role, signal: Signal) {
        let (_, child) = self.children.iter().find(|(of, _)| *of == role).unwrap();
        kill_process(Pid::from_raw(child.id() as i32).unwrap(), signal).unwrap();
    }

    /// Kills the process of a role, with no time to say farewell.
    pub fn kill(&mut self, role: Role) {
        let place = self.children.iter().position(|(of, _)| *of == role).unwrap();
        let (_, mut child) = self.children.remove(place);
        child.kill().unwrap();
        child.wait().unwrap();
    }

    /// Tells all to end, and waits for it.
    pub fn end(&mut self) {
        std::fs::write(self.folder.path().join(OVER), "").unwrap();
        for (role, mut child) in self.children.drain(..) {
            let ended = eventually(20.0, || child.try_wait().unwrap());
            let (_, status) = ended.unwrap_or_else(|| panic!("{} does not end", role.name()));
            assert!(status.success(), "{} ended by {status}", role.name());
        }
        std::fs::remove_file(self.folder.path().join(OVER)).unwrap();
    }

    /// Its files in shared memory.
    pub fn shared_memory(&self) -> Vec<PathBuf> {
        let prefix = self.name.prefix();
        let files = std::fs::read_dir("/dev/shm").unwrap().map(|entry| entry.unwrap());
        let is_ours = |file: &std::fs::DirEntry| file.file_name().to_string_lossy().starts_with(&prefix);
        files.filter(is_ours).map(|file| file.path()).collect()
    }

    pub fn recordings(&self) -> Vec<PathBuf> {
        let files = std::fs::read_dir(self.folder.path()).unwrap().map(|entry| entry.unwrap().path());
        let mut files: Vec<_> = files.filter(|path| path.extension().is_some_and(|e| e == "mcap")).collect();
        files.sort();
        files
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        for (_, child) in &mut self.children {
            drop(child.kill());
            drop(child.wait());
        }
        drop(std::fs::remove_dir_all(self.name.folder()));
        for file in self.shared_memory() {
            drop(std::fs::remove_file(file));
        }
    }
}

/// Asks until there is an answer; how long that took and the answer, `None` after `limit_s`.
pub fn eventually<T>(limit_s: f64, mut ask: impl FnMut() -> Option<T>) -> Option<(Duration, T)> {
    let began = Instant::now();
    while began.elapsed().as_secs_f64() < limit_s {
        if let Some(answer) = ask() {
            return Some((began.elapsed(), answer));
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    None
}

/// Becomes a part of the machine when the environment says so.
pub fn begin_as_told() {
    let (Ok(role), Ok(run), Ok(folder)) = (std::env::var(ROLE), std::env::var(RUN), std::env::var(FOLDER))
    else {
        return;
    };
    // Whoever started it is a thread of the test: when that fails, this ends too.
    set_parent_process_death_signal(Some(Signal::KILL)).unwrap();
    let role = Role::ALL.into_iter().find(|known| known.name() == role).unwrap();
    let folder = PathBuf::from(folder);
    let over = folder.join(OVER);
    be(role, &run.parse().unwrap(), &folder, &|| over.exists());
}

fn told<T: std::str::FromStr<Err: std::fmt::Debug>>(variable: &str) -> T {
    std::env::var(variable).unwrap().parse().unwrap()
}

fn be(role: Role, run: &RunName, folder: &Path, is_over: &dyn Fn() -> bool) {
    let (vehicle, config) = machine();
    let (model, level) = (Model::of(&vehicle), CvarLevel::new(ALPHA).unwrap());
    let limits = model.limits;
    let bus = Bus::join(run).unwrap();
    match role {
        Role::Plant => {
            simulator::run(&bus, plant_setup(&vehicle), is_over).unwrap();
        }
        Role::Mapping => {
            let setup = MappingSetup { vehicle: &vehicle, config, level, model: &model, ages: ages() };
            mapping::run(&bus, &setup, is_over).unwrap();
        }
        Role::Learning => {
            let belief = Belief::Physics;
            let setup = LearningSetup { vehicle: &vehicle, config, belief, checkpoint: 0, level, limits };
            learning::run(&bus, &setup, is_over).unwrap();
        }
        Role::Control => {
            let setup =
                ControlSetup { model, config, corrector: None, seed: SEED, period_s: 0.1, ages: ages() };
            control::run(&bus, setup, is_over).unwrap();
        }
        Role::Mission => {
            let task = task();
            let route = Route::goals(vec![task.goal_m], task.goal_tolerance_m).unwrap();
            let setup = MissionSetup {
                beginning: Beginning::Driving(route),
                tolerance_m: task.goal_tolerance_m,
                model: &model,
                guard: config.guard,
                periods: Periods::default(),
                ages: ages(),
                areas: Areas::default(),
            };
            mission::run(&bus, setup, is_over).unwrap();
        }
        Role::Recorder => {
            let setup = RecorderSetup {
                folder: folder.to_owned(),
                setup: recorded_setup(),
                file_bytes_max: told(FILE_BYTES),
                file_time_max_s: told(FILE_TIME),
                mounts: Vec::new(),
                quota_bytes: told(QUOTA),
                sync_interval_s: told(SYNC),
            };
            let said = folder.join(SAID);
            let mut say = |line: &str| std::fs::write(&said, format!("{line}\n")).unwrap();
            recorder::run(&bus, setup, is_over, &mut say).unwrap();
        }
        Role::Ros => panic!("a simulated vehicle has no topics; ros/test has"),
    }
}

pub fn recorded_setup() -> RecordedSetup {
    let (vehicle, config) = machine();
    let model = Model::of(&vehicle);
    let vehicle_name = vehicle.name.clone();
    let [vehicle_toml, model_toml, config_toml] = MachineSetup { vehicle, model, config }.texts().unwrap();
    RecordedSetup {
        format: RecordedSetup::FORMAT,
        clock: ClockAnchor::now(),
        vehicle_name,
        vehicle_toml,
        model_toml,
        config_toml,
        method: "physics".to_owned(),
        checkpoint_sha256: String::new(),
        corrector_sha256: String::new(),
        alpha: ALPHA,
        seed: SEED.to_string(),
        ages: ages(),
        revision: String::new(),
    }
}

pub fn task() -> Task {
    Task::rock_field(&RockFieldConfig::default(), SEED).unwrap()
}

pub fn episode_config(vehicle: &Vehicle) -> EpisodeConfig {
    let mut episode = EpisodeConfig::for_vehicle(vehicle);
    // Faults make it stand for long; that is no end of the drive here.
    (episode.rules.immobile_s, episode.rules.stopped_s, episode.rules.time_limit_s) = (1e3, 1e3, 1e3);
    if let Some(sensor) = &mut episode.range_sensor {
        (sensor.n_azimuths, sensor.n_beams) = (120, 24);
    }
    episode.walkers = vec![passer_by()];
    episode
}

/// Walks up and down beside the start, where he is seen and in nobody's way.
fn passer_by() -> Walker {
    let Task { start: [x_m, y_m, yaw_rad], .. } = task();
    let (sin, cos) = yaw_rad.sin_cos();
    let at_m = [x_m + 2.0 * cos + 5.0 * sin, y_m + 2.0 * sin - 5.0 * cos];
    let walk = |sense: f64| Stride { duration_s: 5.0, velocity_mps: [sense * cos, sense * sin] };
    Walker::new(at_m, (0..100).map(|k| walk(if k % 2 == 0 { 1.0 } else { -1.0 })).collect())
}

pub fn plant_setup(vehicle: &Vehicle) -> PlantSetup<'_> {
    PlantSetup {
        task: task(),
        vehicle,
        episode: episode_config(vehicle),
        ending: Ending::AtGoal,
        seed: SEED,
        periods: Periods::default(),
        ages: ages(),
    }
}
