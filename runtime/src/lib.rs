//! The pipeline as processes.
