//! A diagnosis as pictures: where the residual lies, how large it is before and after, over the ground, what ranks
//! how, and a held-out drive with both predictions.

mod ground;
mod heldout;
mod places;
mod ranking;
mod residuals;
mod words;

use sim_to_real::{Answer, Findings, GroundMap, ResidualCell};

use super::MARGIN;
use super::canvas::{Anchor, Canvas, Stroke, TextStyle};
use super::colour::Rgb;
pub use heldout::{HeldOutSample, HeldOutStrip};
pub use words::Reference;

/// Colours that mean the same on every page.
const BEFORE: Rgb = Rgb::FAILURE;
const AFTER: Rgb = Rgb::ROLL;
const FLOOR: Rgb = Rgb::INK_SOFT;

/// A diagnosis, as far as pictures need it.
#[derive(Clone, Copy, Debug)]
pub struct GapPictures<'a> {
    /// What the real drives were held against.
    pub reference: Reference,
    /// The answer.
    pub answer: &'a Answer,
    /// What the real drives have shown.
    pub findings: &'a Findings,
    /// Residuals on the held-out drives; empty without any.
    pub heldout_residuals: &'a [ResidualCell],
    /// Ground below the drives.
    pub ground: Option<&'a GroundMap>,
    /// A held-out drive with its predictions.
    pub heldout: Option<&'a HeldOutStrip>,
}

/// A picture with the name of its file.
#[derive(Clone, Debug)]
pub struct GapPicture {
    /// File name.
    pub file: &'static str,
    /// What it shows, in a line.
    pub caption: String,
    /// The PNG file's bytes.
    pub png: Vec<u8>,
}

/// Draws every picture that there is something to show on, 1600 px wide.
///
/// # Errors
/// What the PNG encoder says.
pub fn draw_gap(pictures: &GapPictures<'_>) -> Result<Vec<GapPicture>, String> {
    let reference = pictures.reference;
    let pages = [
        ("ranking.png", words::RANKING.to_owned(), ranking::page(pictures.answer)),
        ("places.png", reference.places(), places::page(pictures)),
        ("residuals.png", words::RESIDUALS.to_owned(), residuals::page(pictures)),
        ("ground.png", words::GROUND.to_owned(), ground::page(pictures)),
        (
            "heldout.png",
            words::HELDOUT.to_owned(),
            pictures.heldout.map(|strip| heldout::page(strip, reference)),
        ),
    ];
    let drawn = pages.into_iter().filter_map(|(file, caption, page)| Some((file, caption, page?)));
    drawn.map(|(file, caption, page)| Ok(GapPicture { file, caption, png: page.png()? })).collect()
}

/// Title and a line below it.
fn draw_header(title: &str, line: &str, canvas: &mut Canvas) {
    canvas.text((MARGIN, 48.0), title, TextStyle::new(30, Anchor::Start).bold());
    canvas.text((MARGIN, 80.0), line, TextStyle::new(18, Anchor::Start).coloured(Rgb::INK_SOFT));
}

/// Lines and names side by side.
fn draw_legend(entries: &[(&str, Stroke)], (x, y): (f64, f64), canvas: &mut Canvas) {
    let mut x = x;
    for (name, stroke) in entries {
        canvas.line((x, y - 6.0), (x + 38.0, y - 6.0), *stroke);
        canvas.text((x + 48.0, y), name, TextStyle::new(17, Anchor::Start));
        x += 48.0 + 9.5 * name.chars().count() as f64 + 30.0;
    }
}

#[cfg(test)]
pub(crate) mod examples;
#[cfg(test)]
mod tests;
