//! The table of routes: text, bars, and maps with the routes of a task.

mod bars;
mod experts;
mod grip;
mod map;
mod text;

pub use bars::picture;
pub use experts::{experts, experts_picture};
pub use grip::grip;
pub use map::map;
pub use text::text;
