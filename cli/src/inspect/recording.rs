//! What a recording holds, also one that breaks off.

use std::collections::BTreeMap;
use std::path::Path;

use bus::message::Stamp;
use formats::open_recording;
use runtime::timing::Timing;
use runtime::{recorder, replay};
use serde_json::{Value, json};

use crate::UsageError;

#[derive(Default)]
struct Topic {
    schema: String,
    encoding: String,
    messages: u64,
    bytes: u64,
    /// Of a channel: the last number of every publisher's life, and how many numbers are missing between.
    last: BTreeMap<u64, u64>,
    lost: Option<u64>,
}

impl Topic {
    /// Numbers of a channel's messages have no gaps, unless the recorder came too late for some.
    fn count(&mut self, stamp: &Stamp) {
        let missing = self
            .last
            .insert(stamp.epoch_ns, stamp.sequence)
            .map_or(0, |last| stamp.sequence.saturating_sub(last.saturating_add(1)));
        let lost = self.lost.get_or_insert(0);
        *lost = lost.saturating_add(missing);
    }
}

pub(super) fn look(path: &Path) -> Result<Value, UsageError> {
    let refused = |problem: String| {
        UsageError(format!("{}: expected a recording in MCAP, found {problem}", path.display()))
    };
    let n_bytes = std::fs::metadata(path).map_err(|error| refused(error.to_string()))?.len();
    let messages = open_recording(path).map_err(|error| refused(error.to_string()))?;
    let mut topics: BTreeMap<String, Topic> = BTreeMap::new();
    let mut timing = Timing::default();
    let (mut setup, mut times_ns) = (Value::Null, None);
    let ended_early = messages.take_all(|message| {
        let channel = &message.channel;
        if channel.topic == "/setup" {
            setup = serde_json::from_slice(&message.data).unwrap_or(Value::Null);
        }
        let topic = topics.entry(channel.topic.clone()).or_default();
        topic.schema.clone_from(&channel.schema);
        topic.encoding.clone_from(&channel.encoding);
        topic.messages += 1;
        topic.bytes += message.data.len() as u64;
        if channel.topic.starts_with(recorder::topic::CHANNELS) {
            replay::recorded_stamp(&message.data).iter().for_each(|stamp| topic.count(stamp));
        }
        if channel.topic == recorder::topic::DECISION
            && let Some((stamp, decision)) = replay::recorded_decision(&message.data)
        {
            timing.take(&stamp, &decision);
        }
        let (first, last) = times_ns.unwrap_or((message.log_time_ns, message.log_time_ns));
        times_ns = Some((first.min(message.log_time_ns), last.max(message.log_time_ns)));
        Ok(())
    });
    if topics.is_empty() {
        return Err(refused(ended_early.unwrap_or_else(|| "no message in it".to_owned())));
    }
    let duration_s = times_ns.map(|(first, last)| (last - first) as f64 * 1e-9);
    let topics: BTreeMap<String, Value> =
        topics.into_iter().map(|(name, topic)| (name, told(&topic))).collect();
    Ok(json!({
        "kind": "recording",
        "bytes": n_bytes,
        "duration_s": duration_s,
        "complete": ended_early.is_none(),
        "ended_early": ended_early,
        "setup": setup,
        "control": timing.report(),
        "topics": topics,
    }))
}

fn told(topic: &Topic) -> Value {
    let Topic { schema, encoding, messages, bytes, lost, .. } = topic;
    json!({ "schema": schema, "encoding": encoding, "messages": messages, "bytes": bytes, "lost": lost })
}
