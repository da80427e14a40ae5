//! What drives, benchmarks and diagnoses came to, told to people: text for a terminal, tables, pictures and pages of
//! HTML that need nothing else. A place in the [guide](../cli/index.html).
//!
//! A module for every kind of result. Each takes the result as the crate that made it left it, and gives a `text`, a
//! `picture` (the bytes of a PNG, 1600 px wide) or a `page`, whichever there is; nothing here reads an argument, opens a
//! file or looks at a clock. `examples/draw_a_drive.rs` draws a drive over a hill.
//!
//! | result | by | as |
//! |---|---|---|
//! | a drive | `surefoot drive` | [picture](drive::picture) |
//! | data to learn from | `surefoot collect` | [picture](collection::picture) |
//! | a training | `surefoot train` | [picture](training::picture) |
//! | a route | `surefoot route` | [picture](route::picture) |
//! | a diagnosis | `surefoot gap diagnose` | [text](gap::text()), [pictures](gap::pictures), [page](gap::page()) |
//! | a belief about the ground | `surefoot gap ground` | [text](ground::text()), [picture](ground::picture()), [page](ground::page()) |
//! | the score of diagnoses | `surefoot gap score` | [text](gap_score::text()), [pictures](gap_score::pictures), [page](gap_score::page()) |
//! | the catalogue of effects | `surefoot gap effects` | [text](effects::text()), [picture](effects::picture), [Markdown](effects::page()) |
//! | benchmarks | `surefoot bench` | [`mod@arena`], [`correction`], [`crossings`], [`mod@friction`], [`gap_closed_loop`], [`ground_score`], [`kinodynamics`], [`learning`], [`navigation`], [`plant`], [`risk`], [`scaling`], [`slippery`], [`traction_map`] |

pub mod arena;
mod axes;
mod canvas;
pub mod collection;
mod colour;
mod colour_bar;
pub mod correction;
pub mod crossings;
pub mod drive;
pub mod effects;
pub mod friction;
pub mod friction_seen;
pub mod gap;
pub mod gap_closed_loop;
pub mod gap_score;
pub mod ground;
pub mod ground_score;
mod html;
pub mod kinodynamics;
pub mod learning;
pub mod navigation;
pub mod plant;
pub mod risk;
pub mod route;
pub mod routes;
pub mod scaling;
pub mod slippery;
mod table;
pub mod traction_map;
pub mod training;
mod verdict;
mod view;

pub use canvas::EncodeError;

/// A picture with the name of its file.
#[derive(Clone, Debug)]
pub struct Picture {
    /// File name.
    pub file: &'static str,
    /// What it shows, in a line.
    pub caption: String,
    /// The PNG file's bytes.
    pub png: Vec<u8>,
}
