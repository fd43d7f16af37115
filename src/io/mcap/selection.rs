//! Selection of a number and its topic.

use super::channels::{Channels, TopicChannel};
use super::path::{self, PathPart};
use crate::failure::{ErrorCode, Failure, did_you_mean};

/// Selection on the command line.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FieldChoice {
    /// `--topic /joint_states`
    pub topic: Option<String>,
    /// `--field effort[0]`
    pub field: Option<String>,
    /// `--signal '/joint_states.effort[0]'`, both in one.
    pub signal: Option<String>,
}

/// The selection, as far as it is known without the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FieldRequest {
    /// A topic and a field; no parts for the only number there is.
    Topic(String, Vec<PathPart>),
    /// Both in one text; the file determines which part is the topic.
    Signal(String),
    /// The only number in the file.
    Only,
}

impl FieldChoice {
    /// Checks the selection as far as possible without the file.
    ///
    /// # Errors
    /// `Failure::Usage` if the selection contradicts itself or is malformed.
    pub fn check(&self) -> Result<FieldRequest, Failure> {
        let field = self.field.as_deref().unwrap_or("");
        match (&self.signal, &self.topic) {
            (Some(_), Some(_)) => Err(ErrorCode::ConflictingArguments.usage(
                "--signal names topic and field in one: give either --signal or --topic with \
                 --field",
            )),
            (Some(_), None) if self.field.is_some() => Err(ErrorCode::ConflictingArguments
                .usage("--signal names topic and field in one: omit --field")),
            (Some(signal), None) => Ok(FieldRequest::Signal(signal.clone())),
            (None, Some(topic)) => {
                let parts = path::parse(field);
                let parts = parts
                    .map_err(|why| ErrorCode::InvalidValue.usage(format_args!("--field: {why}")))?;
                Ok(FieldRequest::Topic(topic.clone(), parts))
            }
            (None, None) if self.field.is_some() => Err(ErrorCode::MissingArgument
                .usage("--field needs the topic it is in: add --topic, as --topic /joint_states")),
            (None, None) => Ok(FieldRequest::Only),
        }
    }
}

impl FieldRequest {
    /// The field in a channel's messages, if the channel's topic is selected. Text that is not a
    /// field is an error only there.
    pub fn field_in(&self, channel: &TopicChannel, channels: &Channels) -> Option<FieldText> {
        let topic = &channel.record.topic;
        match self {
            Self::Topic(wanted, parts) => {
                is_same(topic, wanted).then(|| FieldText::Parts(parts.clone()))
            }
            Self::Signal(signal) => {
                let rest = behind(signal, topic)?;
                // The longest matching topic counts, such as "/a.b" in "/a.b.x".
                let is_longest = channels.iter().all(|other| {
                    other.record.topic.len() <= topic.len()
                        || behind(signal, &other.record.topic).is_none()
                });
                is_longest.then(|| FieldText::Text(rest.to_owned()))
            }
            Self::Only => None,
        }
    }

    /// Message that no channel matches, with the available ones.
    pub fn miss(&self, channels: &Channels) -> String {
        let mut topics: Vec<_> = channels
            .iter()
            .map(|channel| (channel.record.topic.as_str(), channel.schema_name()))
            .collect();
        topics.sort_unstable();
        topics.dedup();
        let wanted = match self {
            Self::Topic(topic, _) => topic,
            Self::Signal(signal) => signal,
            Self::Only => "",
        };
        if topics.is_empty() {
            return "there is no channel in it".to_owned();
        }
        if let Some((topic, _)) = topics.iter().find(|(topic, _)| match self {
            Self::Topic(wanted, _) => is_same(topic, wanted),
            _ => behind(wanted, topic).is_some(),
        }) {
            return format!("there is no message on the topic \"{topic}\"");
        }
        let hint = did_you_mean(wanted, topics.iter().map(|(topic, _)| *topic));
        let list: Vec<_> = topics
            .iter()
            .map(|(topic, schema)| match *schema {
                "" => (*topic).to_owned(),
                schema => format!("{topic} ({schema})"),
            })
            .collect();
        format!(
            "there is no topic \"{wanted}\"{hint}; there are: {}",
            list.join(", ")
        )
    }
}

/// A field, parsed or as text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FieldText {
    /// Parsed.
    Parts(Vec<PathPart>),
    /// As text.
    Text(String),
}

impl FieldText {
    /// Parses the text, if necessary.
    ///
    /// # Errors
    /// A sentence about what was expected.
    pub fn parts(self) -> Result<Vec<PathPart>, String> {
        match self {
            Self::Parts(parts) => Ok(parts),
            Self::Text(text) => path::parse(&text),
        }
    }
}

/// Whether two topics are equal except for a leading slash.
fn is_same(topic: &str, wanted: &str) -> bool {
    topic == wanted
        || topic.strip_prefix('/') == Some(wanted)
        || wanted.strip_prefix('/') == Some(topic)
}

/// The text after a topic in a signal; `None` if it does not begin with it.
fn behind<'a>(signal: &'a str, topic: &str) -> Option<&'a str> {
    let bare = topic.strip_prefix('/').unwrap_or(topic);
    let rest = signal.strip_prefix(topic).or_else(|| {
        let signal = signal.strip_prefix('/').unwrap_or(signal);
        signal.strip_prefix(bare)
    })?;
    match rest.chars().next() {
        None => Some(""),
        Some('.' | '/') => Some(&rest[1..]),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use mcap::records::op;

    use super::*;

    fn channels(topics: &[&str]) -> Channels {
        let mut channels = Channels::default();
        for (id, topic) in topics.iter().enumerate() {
            let mut body = (id as u16).to_le_bytes().to_vec();
            body.extend_from_slice(&[0, 0]);
            body.extend_from_slice(&(topic.len() as u32).to_le_bytes());
            body.extend_from_slice(topic.as_bytes());
            body.extend_from_slice(&[0; 8]);
            channels.note(op::CHANNEL, &body);
        }
        channels
    }

    fn found(wanted: &FieldRequest, channels: &Channels) -> Vec<(String, String)> {
        channels
            .iter()
            .filter_map(|channel| {
                let field = wanted.field_in(channel, channels)?;
                let parts = field.parts().unwrap();
                Some((channel.record.topic.clone(), path::text(&parts)))
            })
            .collect()
    }

    fn pair(topic: &str, field: &str) -> (String, String) {
        (topic.to_owned(), field.to_owned())
    }

    #[test]
    fn topic_and_field_together_or_apart() {
        let channels = channels(&["/joint_states", "/a", "/a.b", "plain"]);
        let signal = |text: &str| found(&FieldRequest::Signal(text.to_owned()), &channels);
        let expected = [pair("/joint_states", "effort[0]")];
        assert_eq!(signal("/joint_states.effort[0]"), expected);
        assert_eq!(signal("joint_states.effort[0]"), expected);
        assert_eq!(signal("/a.b.x"), [pair("/a.b", "x")]);
        assert_eq!(signal("/a.c"), [pair("/a", "c")]);
        assert_eq!(signal("plain"), [pair("plain", "")]);
        assert_eq!(signal("/joint_statesx.y"), []);
        let topic = FieldRequest::Topic("joint_states".to_owned(), vec![]);
        assert_eq!(found(&topic, &channels), [pair("/joint_states", "")]);
    }

    #[test]
    fn a_miss_lists_the_topics() {
        let channels = channels(&["/joint_states", "/imu"]);
        let said = FieldRequest::Topic("/joint_sates".to_owned(), vec![]).miss(&channels);
        assert!(said.contains("(did you mean \"/joint_states\"?)"), "{said}");
        assert!(said.contains("/imu"), "{said}");
        let said = FieldRequest::Signal("/imu.x".to_owned()).miss(&channels);
        assert!(said.contains("no message on the topic \"/imu\""), "{said}");
    }

    #[test]
    fn a_choice_that_contradicts_itself_is_refused() {
        let some = |text: &str| Some(text.to_owned());
        let wrong = [
            (some("/a"), None, some("/a.b")),
            (None, some("b"), some("/a.b")),
            (None, some("b"), None),
            (some("/a"), some("b["), None),
        ];
        for (topic, field, signal) in wrong {
            let selection = FieldChoice {
                topic,
                field,
                signal,
            };
            assert!(
                matches!(selection.check(), Err(Failure::Usage(_))),
                "{selection:?}"
            );
        }
        assert_eq!(FieldChoice::default().check(), Ok(FieldRequest::Only));
    }
}
