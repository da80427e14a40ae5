//! What a bag of ROS 2 holds, also one that breaks off.

use std::collections::BTreeMap;
use std::path::Path;

use formats::Bag;
use serde_json::{Value, json};

use crate::UsageError;

struct Topic {
    kind: String,
    encoding: String,
    messages: u64,
    bytes: u64,
    /// First and last time of recording [ns].
    times_ns: [u64; 2],
}

impl Topic {
    fn duration_s(&self) -> f64 {
        let [first, last] = self.times_ns;
        last.saturating_sub(first) as f64 * 1e-9
    }

    /// Messages per second [Hz]; none of a topic with a single time.
    fn rate_hz(&self) -> Option<f64> {
        let duration_s = self.duration_s();
        (duration_s > 0.0).then(|| (self.messages - 1) as f64 / duration_s)
    }
}

pub(super) fn look(path: &Path) -> Result<Value, UsageError> {
    let bag = Bag::open(path).map_err(UsageError::from_input)?;
    let mut topics: BTreeMap<String, Topic> = BTreeMap::new();
    let ended_early = bag.take_all(|message| {
        let channel = &message.channel;
        let time_ns = message.log_time_ns;
        let topic = topics.entry(channel.topic.clone()).or_insert_with(|| Topic {
            kind: channel.schema.clone(),
            encoding: channel.encoding.clone(),
            messages: 0,
            bytes: 0,
            times_ns: [time_ns; 2],
        });
        topic.messages += 1;
        topic.bytes += message.data.len() as u64;
        topic.times_ns = [topic.times_ns[0].min(time_ns), topic.times_ns[1].max(time_ns)];
        Ok(())
    });
    if topics.is_empty() {
        let found = ended_early.unwrap_or_else(|| "no message in it".to_owned());
        return Err(UsageError(format!("{}: expected a bag with messages, found {found}", path.display())));
    }
    let first_ns = topics.values().map(|topic| topic.times_ns[0]).min().unwrap_or_default();
    let last_ns = topics.values().map(|topic| topic.times_ns[1]).max().unwrap_or_default();
    let n_bytes = |file: &std::path::PathBuf| file.metadata().map(|file| file.len()).unwrap_or_default();
    Ok(json!({
        "kind": "bag",
        "files": bag.files().iter().map(|file| file.display().to_string()).collect::<Vec<_>>(),
        "bytes": bag.files().iter().map(n_bytes).sum::<u64>(),
        "begins_at_ns": first_ns,
        "duration_s": (last_ns - first_ns) as f64 * 1e-9,
        "complete": ended_early.is_none(),
        "ended_early": ended_early,
        "metadata": bag.metadata().map_or_else(str::to_owned, |metadata| {
            metadata.map_or("none", |_| "read").to_owned()
        }),
        "messages": topics.values().map(|topic| topic.messages).sum::<u64>(),
        "topics": topics.iter().map(|(name, topic)| (name.clone(), told(topic))).collect::<BTreeMap<_, _>>(),
    }))
}

fn told(topic: &Topic) -> Value {
    json!({
        "type": topic.kind,
        "encoding": topic.encoding,
        "messages": topic.messages,
        "bytes": topic.bytes,
        "rate_hz": topic.rate_hz(),
        "duration_s": topic.duration_s(),
    })
}
