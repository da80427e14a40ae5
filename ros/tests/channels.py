"""Surefoot's channels for Python: the same records in the same shared memory, through PyPI `iceoryx2==0.10.0`.

What a channel keeps, and how many may use it, must be what `bus/src/channel.rs` says; the first process to open a
channel decides.
"""

import argparse
import ctypes
import os
import re
import stat
import time

import iceoryx2 as iox2
import surefoot_layout as layout

# Readers beside the run's own, as `surefoot up --third-parties` says.
THIRD_PARTIES = 2


class Quad(ctypes.Structure):
    """Element of a risk map's payload."""

    _fields_ = [("values", ctypes.c_float * 4)]

    @staticmethod
    def type_name() -> str:
        return "[f32; 4]"


# Name: header, element, depth, readers of the run's own, messages that late ones are given.
CHANNELS = {
    "odometry": (layout.Stamp, layout.OdometryRecord, 32, 6, 0),
    "imu": (layout.Stamp, layout.ImuRecord, 32, 3, 0),
    "scan": (layout.ScanHeader, layout.PointRecord, 2, 2, 0),
    "risk": (layout.RiskHeader, Quad, 1, 4, 0),
    "command": (layout.Stamp, layout.CommandRecord, 32, 4, 0),
    "mission": (layout.Stamp, layout.MissionRecord, 2, 8, 1),
}


def now_ns() -> int:
    """The clock of all processes."""
    return time.clock_gettime_ns(time.CLOCK_MONOTONIC)


def run_name(word: str) -> str:
    """A word that may name a run, as for `surefoot up --run`; argparse tells of any other."""
    if re.fullmatch("[A-Za-z0-9_-]{1,32}", word) is None:
        raise argparse.ArgumentTypeError(f"expected 1 to 32 letters, digits, - or _, found {word!r}")
    return word


def user_folder() -> str:
    """The folder by which the processes of this user find one another; refuses one that is not his alone."""
    folder = f"/tmp/surefoot-{os.geteuid()}"
    try:
        os.mkdir(folder, 0o700)
    except FileExistsError:
        pass
    about = os.lstat(folder)
    if not stat.S_ISDIR(about.st_mode) or about.st_uid != os.geteuid() or stat.S_IMODE(about.st_mode) != 0o700:
        raise PermissionError(f"{folder}: expected a folder of user {os.geteuid()} and nobody else (mode 700)")
    return folder


class Bus:
    """A process among the others of its run."""

    def __init__(self, run: str) -> None:
        iox2.set_log_level(iox2.LogLevel.Fatal)
        config = iox2.config.default()
        config.global_cfg.prefix = iox2.FileName.new(f"surefoot_{os.geteuid()}_{run}_")
        config.global_cfg.root_path = iox2.Path.new(f"{user_folder()}/{run}")
        builder = iox2.NodeBuilder.new().config(config)
        self.node = builder.signal_handling_mode(iox2.SignalHandlingMode.Disabled).create(iox2.ServiceType.Ipc)

    def service(self, name: str):
        """The channel of this name."""
        header, element, depth, n_readers, n_kept = CHANNELS[name]
        return (
            self.node.service_builder(iox2.ServiceName.new(name))
            .publish_subscribe(iox2.Slice[element])
            .user_header(header)
            .max_publishers(1)
            .max_subscribers(n_readers + THIRD_PARTIES)
            .subscriber_max_buffer_size(depth)
            .subscriber_max_borrowed_samples(depth + 1)
            .history_size(n_kept)
            .enable_safe_overflow(True)
            .open_or_create()
        )


class Outlet:
    """The way into a channel, which has one publisher at a time: it is an error while another process publishes on it."""

    def __init__(self, bus: Bus, name: str, n_max: int = 1) -> None:
        factory = bus.service(name).publisher_builder().initial_max_slice_len(n_max).max_loaned_samples(1)
        self.publisher = factory.create()
        self.epoch_ns = now_ns()
        self.n_sent = 0

    def send(self, valid_at_ns: int, records, **header_fields) -> None:
        """Writes records where their readers will read them, stamps them and hands them over.

        `records` is a ctypes array; it is copied once, into the loaned memory.
        """
        sample = self.publisher.loan_slice_uninit(len(records))
        ctypes.memmove(sample.payload_ptr, records, ctypes.sizeof(records))
        header = sample.user_header().contents
        for name, value in header_fields.items():
            setattr(header, name, value)
        stamp = header if isinstance(header, layout.Stamp) else header.stamp
        self.n_sent += 1
        stamp.layout_version = layout.LAYOUT_VERSION
        stamp.reserved = 0
        stamp.epoch_ns = self.epoch_ns
        stamp.sequence = self.n_sent
        stamp.valid_at_ns = valid_at_ns
        stamp.published_at_ns = now_ns()
        sample.assume_init().send()


class Inlet:
    """The way out of a channel."""

    def __init__(self, bus: Bus, name: str) -> None:
        self.subscriber = bus.service(name).subscriber_builder().create()
        self.heard = (0, 0)

    def newest(self):
        """The newest waiting message of our layout: its header and its payload where they lie; None without one.

        Of a publisher that another one has followed, nothing is heard any more.
        """
        newest = None
        while (sample := self.subscriber.receive()) is not None:
            header = sample.user_header().contents
            stamp = header if isinstance(header, layout.Stamp) else header.stamp
            place = (stamp.epoch_ns, stamp.sequence)
            if stamp.layout_version == layout.LAYOUT_VERSION and self.heard < place <= (now_ns(), 1 << 64):
                self.heard = place
                newest = (sample, header, sample.payload())
        return newest
