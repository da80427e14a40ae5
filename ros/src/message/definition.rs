//! What bags say of messages beside their bytes, so that everybody can read them.

use super::{AckermannDriveStamped, Imu, Named, OccupancyGrid, Odometry, Path, PointCloud2, TfMessage};

/// A message that bags can be written of.
pub trait Defined: Named {
    /// Its definition, with those of the messages that it is made of behind it, as rosbag2 writes them.
    const DEFINITION: &'static str;
    /// The hash of its type's description (REP 2016).
    const TYPE_HASH: &'static str;
}

/// Says a message's definition and hash.
macro_rules! defined {
    ($($kind:ty = $file:literal, $hash:literal;)*) => { $(
        impl Defined for $kind {
            const DEFINITION: &'static str = include_str!(concat!("definitions/", $file, ".msg"));
            const TYPE_HASH: &'static str = concat!("RIHS01_", $hash);
        }
    )* };
}

defined! {
    AckermannDriveStamped = "AckermannDriveStamped",
        "48ca7612a08d3bb72744fd98b71b7cf2ea24c6ad50fa4e1aa0bbad963c90d8cf";
    Imu = "Imu", "7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b";
    OccupancyGrid = "OccupancyGrid", "8d348150c12913a31ee0ec170fbf25089e4745d17035792a1ba94d6f0bc0cfc7";
    Odometry = "Odometry", "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0";
    Path = "Path", "1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b";
    PointCloud2 = "PointCloud2", "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5";
    TfMessage = "TFMessage", "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087";
}
