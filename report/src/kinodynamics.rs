//! Inverse kinodynamics on a track: success, failed turns and errors, as text, pictures and page.

mod laps;
mod log;
mod page;
mod text;

use bench::kinodynamics::Report;

use crate::Picture;
use crate::canvas::EncodeError;
pub use log::text as log_text;
pub use page::page;
pub use text::{data_curve_text, text};

/// Draws the laps of both tracks, 1600 px wide: baseline red, ablation blue, learned green.
///
/// # Errors
/// The encoder refuses.
pub fn pictures(report: &Report) -> Result<[Picture; 2], EncodeError> {
    let [outdoor, indoor] = [&report.outdoor, &report.indoor].map(|track| {
        let png = laps::page(track, report.half_width_m).png()?;
        let file =
            if track.track == "indoor" { "kinodynamics_indoor.png" } else { "kinodynamics_outdoor.png" };
        Ok(Picture { file, caption: format!("laps on the {} track", track.track), png })
    });
    Ok([outdoor?, indoor?])
}
