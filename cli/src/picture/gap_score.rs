//! The score of a set of diagnoses as pictures: what is taken for what, whether scores are probabilities, how far gaps
//! close.

mod closure;
mod confusion;
mod reliability;

use bench::gap_score::Score;

use super::MARGIN;
use super::canvas::{Anchor, Canvas, TextStyle};
use super::colour::Rgb;
use super::gap::GapPicture;

/// Draws every picture that there is something to show on, 1600 px wide.
///
/// # Errors
/// What the PNG encoder says.
pub fn draw_gap_score(score: &Score, title: &str) -> Result<Vec<GapPicture>, String> {
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
        .map(|(file, caption, page)| Ok(GapPicture { file, caption: caption.to_owned(), png: page.png()? }))
        .collect()
}

/// Title and a line below it.
fn draw_header(title: &str, line: &str, canvas: &mut Canvas) {
    canvas.text((MARGIN, 48.0), title, TextStyle::new(30, Anchor::Start).bold());
    canvas.text((MARGIN, 80.0), line, TextStyle::new(18, Anchor::Start).coloured(Rgb::INK_SOFT));
}
