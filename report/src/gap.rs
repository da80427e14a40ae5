//! A diagnosis in plain words, as a page and as pictures: where the residual lies, how large it is before and after,
//! over the ground, what ranks how, and a held-out drive with both predictions.

mod ground;
mod heldout;
mod in_simulator;
mod left;
mod page;
mod places;
mod predictions;
mod ranking;
mod residuals;
mod swing;
pub(crate) mod text;
mod throughout;
mod told;
mod words;

use sim_to_real::{Answer, Findings, GroundMap, ResidualCell};

use crate::Picture;
use crate::canvas::{Anchor, Canvas, EncodeError, Stroke, TextStyle};
use crate::colour::Rgb;
pub use heldout::{HeldOutSample, HeldOutStrip};
pub use page::{Page, page};
pub use text::text;
pub use told::Told;
pub use words::Reference;

/// Colours that mean the same on every page.
const BEFORE: Rgb = Rgb::FAILURE;
const AFTER: Rgb = Rgb::ROLL;
const FLOOR: Rgb = Rgb::INK_SOFT;

/// A diagnosis, as far as pictures need it.
#[derive(Clone, Copy, Debug)]
pub struct Pictures<'a> {
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

/// Draws every picture that there is something to show on, 1600 px wide.
///
/// # Errors
/// The encoder refuses.
pub fn pictures(pictures: &Pictures<'_>) -> Result<Vec<Picture>, EncodeError> {
    let reference = pictures.reference;
    let pages = [
        ("ranking.png", words::RANKING.to_owned(), ranking::page(pictures.answer)),
        ("throughout.png", words::THROUGHOUT.to_owned(), throughout::page(pictures.answer)),
        ("places.png", reference.places(), places::page(pictures)),
        ("left.png", words::LEFT.to_owned(), left::page(pictures.answer, reference)),
        ("swing.png", words::SWING.to_owned(), swing::page(pictures)),
        ("residuals.png", words::RESIDUALS.to_owned(), residuals::page(pictures)),
        ("ground.png", words::GROUND.to_owned(), ground::page(pictures)),
        (
            "heldout.png",
            words::HELDOUT.to_owned(),
            pictures.heldout.map(|strip| heldout::page(strip, reference)),
        ),
    ];
    let drawn = pages.into_iter().filter_map(|(file, caption, page)| Some((file, caption, page?)));
    drawn.map(|(file, caption, page)| Ok(Picture { file, caption, png: page.png()? })).collect()
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
mod examples;
#[cfg(test)]
mod tests;
