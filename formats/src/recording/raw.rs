//! Messages as they lie in memory, under a schema that tells how.

use std::sync::Arc;

use foxglove::{Context, PartialMetadata, RawChannel, Schema};

/// Topics of such messages, each created with its first one.
pub(super) struct RawChannels {
    context: Arc<Context>,
    channels: Vec<(&'static str, Arc<RawChannel>)>,
}

impl RawChannels {
    /// Keeps the context alive, without which channels close.
    pub(super) fn new(context: Arc<Context>) -> Self {
        Self { context, channels: Vec::new() }
    }

    pub(super) fn log(
        &mut self,
        topic: &'static str,
        layout: impl FnOnce() -> String,
        at_ns: u64,
        bytes: &[u8],
    ) -> Result<(), String> {
        let known = self.channels.iter().find(|(known, _)| *known == topic);
        let channel = match known {
            Some((_, channel)) => Arc::clone(channel),
            None => self.open(topic, &layout())?,
        };
        channel.log_with_meta(bytes, PartialMetadata::with_log_time(at_ns));
        Ok(())
    }

    fn open(&mut self, topic: &'static str, layout: &str) -> Result<Arc<RawChannel>, String> {
        let name = format!("surefoot{}", topic.replace('/', "."));
        let schema = Schema::new(name, "c", layout.as_bytes().to_vec());
        let builder = self.context.channel_builder(topic).message_encoding("c").schema(schema);
        let channel = builder.build_raw().map_err(|error| error.to_string())?;
        self.channels.push((topic, Arc::clone(&channel)));
        Ok(channel)
    }
}
