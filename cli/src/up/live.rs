//! The live view: a process that only looks on, so that whatever becomes of it, the vehicle drives on.

use std::ffi::OsString;
use std::net::{Ipv4Addr, SocketAddr};
use std::process::{Child, Stdio};

use runtime::live;
use rustix::process::{Signal, set_parent_process_death_signal};
use tracing::info;

use super::roles;
use crate::arguments::UpArguments;
use crate::{Program, interrupt};

/// Serves the view until told to end.
pub(super) fn run(arguments: &UpArguments) -> anyhow::Result<()> {
    if arguments.supervised {
        set_parent_process_death_signal(Some(Signal::TERM))?;
    }
    let address = arguments.live.unwrap_or(SocketAddr::from((Ipv4Addr::LOCALHOST, live::PORT)));
    let host = address.ip().to_string();
    live::run(&roles::join(arguments)?, (&host, address.port()), &interrupt::interrupted, &mut |port| {
        info!("Foxglove WebSocket on ws://{host}:{port}");
    })?;
    Ok(())
}

/// The process that serves the view beside those of the machine; it ends with this.
pub(super) struct Viewer(Child);

impl Viewer {
    pub fn start(program: &Program, words: &[OsString]) -> std::io::Result<Self> {
        let child = program
            .again()
            .args(words)
            .args(["--role", "live", "--supervised"])
            .stdout(Stdio::null())
            .spawn()?;
        Ok(Self(child))
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        // It may have ended by itself.
        drop(self.0.kill());
        drop(self.0.wait());
    }
}
