//! Topics of keys, by their words.

use super::Topic;
use crate::recording::text::vocabulary::{has, meaning, words};

/// Whether a key that may concern the rate more often concerns the signal.
pub fn is_vague(key: &str) -> bool {
    has("vague keys", without_brackets(&key.to_lowercase()))
}

/// Whether the rate given by a key may be that of all channels together, or before some samples are left out.
pub fn is_of_others(key: &str) -> bool {
    contains_any("rates of others", key)
}

/// Whether a key says how many samples were left out.
pub fn is_thinning(key: &str) -> bool {
    contains_any("thinning", key)
}

fn contains_any(section: &str, key: &str) -> bool {
    let lower = key.to_lowercase();
    words(section).iter().any(|word| lower.contains(word.text))
}

/// Topic of a key.
pub fn topic(key: &str) -> Option<Topic> {
    let whole = key.to_lowercase();
    let bare = without_brackets(&whole);
    let exact = meaning("keys", bare).or_else(|| meaning("keys", &whole));
    if let Some(about) = exact {
        return Topic::of(about);
    }
    let is_other = words("not keys")
        .iter()
        .any(|word| whole.contains(word.text));
    if is_other || whole.chars().count() > 60 {
        return None;
    }
    let mut within = words("within keys").iter();
    let found = within.find(|word| whole.contains(word.text));
    found.and_then(|word| Topic::of(word.meaning))
}

fn without_brackets(key: &str) -> &str {
    let end = key.find(['(', '[', '{']).unwrap_or(key.len());
    if end == 0 { key } else { key[..end].trim() }
}
