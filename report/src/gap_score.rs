//! The score of a set of diagnoses as text, page and pictures: what is taken for what, whether scores are
//! probabilities, how far gaps close.

mod closure;
mod confusion;
mod page;
mod reliability;
mod text;

use bench::gap_score::Score;

use crate::Picture;
use crate::canvas::EncodeError;
pub(crate) use confusion::page as confusion_page;
pub use page::page;
pub use text::text;

/// Draws every picture that there is something to show on, 1600 px wide.
///
/// # Errors
/// The encoder refuses.
pub fn pictures(score: &Score, title: &str) -> Result<Vec<Picture>, EncodeError> {
    let pages = [
        (
            "confusion.png",
            "What was announced first (columns) for what had been added (rows); pairs are left out.",
            confusion::page(&score.confusion, title),
        ),
        (
            "reliability.png",
            "Scores against the share of cases in which they were right.",
            reliability::page(&score.calibration, title),
        ),
        (
            "closure.png",
            "How far gaps close on held-out drives, and how far that was predicted.",
            closure::page(&score.cases, title),
        ),
    ];
    let drawn = pages.into_iter().filter_map(|(file, caption, page)| Some((file, caption, page?)));
    drawn
        .map(|(file, caption, page)| Ok(Picture { file, caption: caption.to_owned(), png: page.png()? }))
        .collect()
}
