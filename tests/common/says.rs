//! What a message must say, however it is put.

/// Whether `text` holds the parts of `words` that ellipses (…) keep apart, in their order; a number not
/// as a part of a longer one. What matters is asked for, however it is put: `seed … 0 … 7`.
pub fn says(text: &str, words: &str) -> bool {
    let mut rest = text;
    words.split('…').map(str::trim).all(|part| match find(rest, part) {
        Some(at) => {
            rest = &rest[at + part.len()..];
            true
        }
        None => false,
    })
}

fn find(text: &str, part: &str) -> Option<usize> {
    let is_digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
    let is_whole = |at: usize| {
        let (before, after) = (&text[..at], &text[at + part.len()..]);
        let goes_on = |inner: Option<char>, outer: Option<char>| is_digit(inner) && is_digit(outer);
        !goes_on(part.chars().next(), before.chars().next_back())
            && !goes_on(part.chars().next_back(), after.chars().next())
    };
    text.match_indices(part).map(|(at, _)| at).find(|at| is_whole(*at))
}

#[test]
fn words_are_found_in_their_order_and_numbers_whole() {
    let text = "seed was 10, now it is 7";
    assert!(says(text, "seed … 10 … 7") && says(text, "seed was"));
    assert!(!says(text, "seed … 7 … 10") && !says(text, "seed … 0") && !says(text, "1"));
}
