//! The pipeline as one pure object: observation to map to belief to risk map to decision.
