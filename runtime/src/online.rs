//! Learning from the drive that is under way: what the vehicle did over what was asked of it becomes examples, examples
//! become networks, and networks are used once they are better on ground that nothing was learned from.
//!
//! [`Notebook`] keeps what was measured and commanded until there is a stretch of it; [`Learner`] labels stretches as
//! `surefoot collect` does and keeps them in a bounded [`Memory`]; [`Background`] does so on a thread of low priority,
//! so that risk maps never wait for it.

mod background;
mod learner;
mod memory;
mod notebook;
mod school;

pub use background::{Background, Judge, News};
pub use learner::{Decision, FORGETTING_MAX, Learner, LearnerSetup, OnlineError, Round};
pub use memory::{Memory, Part};
pub use notebook::{Notebook, Stretch};
pub use school::{School, SchoolSetup, Told};
