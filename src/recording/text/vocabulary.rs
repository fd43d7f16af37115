//! Words used by recorders, by meaning: the lists of `vocabulary.txt`.

use std::collections::HashMap;
use std::sync::LazyLock;

use crate::packed_text::{packed, unpack};

/// A word and its meaning, if the list does not imply it.
pub struct Word {
    pub text: &'static str,
    pub meaning: &'static str,
}

static LISTS: LazyLock<HashMap<&'static str, Vec<Word>>> =
    LazyLock::new(|| lists(unpack(packed!("vocabulary.txt")).leak()));

/// The words of a list, in their order.
///
/// # Panics
/// If there is no such list.
pub fn words(list: &str) -> &'static [Word] {
    LISTS.get(list).expect("a list of vocabulary.txt")
}

/// Whether a word is in a list.
pub fn has(list: &str, word: &str) -> bool {
    words(list).iter().any(|known| known.text == word)
}

/// Meaning of a word in a list.
pub fn meaning(list: &str, word: &str) -> Option<&'static str> {
    let known = words(list).iter().find(|known| known.text == word);
    known.map(|known| known.meaning)
}

fn lists(text: &'static str) -> HashMap<&'static str, Vec<Word>> {
    let mut lists: HashMap<&str, Vec<Word>> = HashMap::new();
    let (mut list, mut meaning) = ("", "");
    for line in text.lines().map(str::trim) {
        if line.is_empty() || line.starts_with("# ") {
            continue;
        }
        if let Some(name) = line
            .strip_prefix('[')
            .and_then(|rest| rest.strip_suffix(']'))
        {
            (list, meaning) = (name, "");
            continue;
        }
        let mut words = line;
        if let Some((before, after)) = line.split_once(": ") {
            (meaning, words) = (before, after);
        }
        let words = words
            .split('|')
            .map(str::trim)
            .filter(|word| !word.is_empty());
        let words = words.map(|text| Word { text, meaning });
        lists.entry(list).or_default().extend(words);
    }
    lists
}

#[cfg(test)]
mod tests {
    use super::*;
    use torqcomp_model::Unit;

    #[test]
    fn every_word_for_a_unit_leads_to_one() {
        let lists = ["units", "units by case", "time units", "endings"];
        for word in lists.iter().flat_map(|list| words(list)) {
            assert!(
                Unit::parse(word.meaning).is_ok(),
                "{}: {}",
                word.meaning,
                word.text
            );
        }
    }

    #[test]
    fn lists_go_on_after_a_bar() {
        assert!(has("time", "laufzeit") && has("index", "#"));
        assert_eq!(meaning("keys", "δt"), Some("interval"));
        assert_eq!(meaning("keys", "tick"), Some("interval"));
        assert_eq!(words("within keys")[0].meaning, "rate");
    }
}
