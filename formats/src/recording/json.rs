//! Messages as JSON with a schema taken from the first one, for what Foxglove has no schema of its own.

use std::sync::Arc;

use bicycle::{Decision, HoldReason, StopReason};
use foxglove::{Context, PartialMetadata, RawChannel, Schema};
use serde::Serialize;
use serde_json::{Map, Value, json};

/// JSON topics, each created with its first message.
pub(super) struct JsonChannels {
    context: Arc<Context>,
    channels: Vec<(&'static str, Arc<RawChannel>)>,
}

impl JsonChannels {
    /// Keeps the context alive, without which channels close.
    pub(super) fn new(context: Arc<Context>) -> Self {
        Self { context, channels: Vec::new() }
    }

    pub(super) fn log(
        &mut self,
        topic: &'static str,
        at_ns: u64,
        value: &impl Serialize,
    ) -> Result<(), String> {
        let message = serde_json::to_value(value).map_err(|error| error.to_string())?;
        let known =
            self.channels.iter().find(|(known, _)| *known == topic).map(|(_, channel)| channel.clone());
        let channel = match known {
            Some(channel) => channel,
            None => self.open(topic, &message)?,
        };
        let bytes = serde_json::to_vec(&message).map_err(|error| error.to_string())?;
        channel.log_with_meta(&bytes, PartialMetadata::with_log_time(at_ns));
        Ok(())
    }

    fn open(&mut self, topic: &'static str, first: &Value) -> Result<Arc<RawChannel>, String> {
        let name = format!("surefoot.{}", topic.trim_start_matches('/'));
        let schema = Schema::new(name, "jsonschema", schema_of(first).to_string().into_bytes());
        let builder = self.context.channel_builder(topic).message_encoding("json").schema(schema);
        let channel = builder.build_raw().map_err(|error| error.to_string())?;
        self.channels.push((topic, channel.clone()));
        Ok(channel)
    }
}

/// JSON schema that a value of this shape obeys; null, which stands for a number that is not finite, may be anything.
fn schema_of(value: &Value) -> Value {
    match value {
        Value::Null => json!({}),
        Value::Bool(_) => json!({ "type": "boolean" }),
        Value::Number(_) => json!({ "type": "number" }),
        Value::String(_) => json!({ "type": "string" }),
        Value::Array(items) => {
            json!({ "type": "array", "items": items.first().map_or(json!({}), schema_of) })
        }
        Value::Object(fields) => {
            let properties: Map<_, _> =
                fields.iter().map(|(name, field)| (name.clone(), schema_of(field))).collect();
            json!({ "type": "object", "properties": properties })
        }
    }
}

/// A decision, flat.
#[derive(Serialize)]
pub(super) struct DecisionRecord {
    decision: &'static str,
    reason: Reason,
}

#[derive(Serialize)]
#[serde(untagged)]
enum Reason {
    None(&'static str),
    Hold(HoldReason),
    Stop(StopReason),
}

impl From<&Decision> for DecisionRecord {
    fn from(decision: &Decision) -> Self {
        let (decision, reason) = match decision {
            Decision::Drive(_) => ("drive", Reason::None("")),
            Decision::Hold(reason) => ("hold", Reason::Hold(*reason)),
            Decision::Stop(reason) => ("stop", Reason::Stop(*reason)),
        };
        Self { decision, reason }
    }
}
