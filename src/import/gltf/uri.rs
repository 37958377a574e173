//! URIs of buffers and images: data URIs, and names of files beside the glTF file.

use super::json::Json;
use crate::error::Result;
use crate::import::source;
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use std::path::{Path, PathBuf};

/// What a URI stands for.
pub(super) enum Resource {
    /// The bytes of a data URI.
    Data(Vec<u8>),
    /// A file.
    File(PathBuf),
}

/// Takes padding or does without it.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// What the text `uri` of `json` stands for, in the glTF file `file`.
///
/// Errors: a data URI that is not base64; an address on a network.
pub(super) fn resolve(json: &Json<'_>, uri: &str, file: &Path) -> Result<Resource> {
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((kind, data)) = data.split_once(',').filter(|(kind, _)| kind.ends_with(";base64"))
        else {
            return Err(json.fault("a data URI that is not base64").into());
        };
        return match BASE64.decode(data) {
            Ok(bytes) => Ok(Resource::Data(bytes)),
            Err(error) => {
                Err(json.fault(format!("the data URI of `{kind}` is damaged: {error}")).into())
            }
        };
    }
    if let Some((scheme, _)) = uri.split_once("://") {
        let help = "download it, put it beside the glTF file, and name it there";
        let message = format!("`{}` is an address ({scheme}), not a file", shortened(uri));
        return Err(json.fault(message).help(help).into());
    }
    // Names are percent-encoded. Programs that forget this write names that are found as they stand.
    let plain = source::beside(file, uri);
    Ok(Resource::File(if plain.exists() { plain } else { source::beside(file, &decoded(uri)) }))
}

/// `%20` and the like decoded; what is no such code stays.
fn decoded(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, after @ ..] = rest {
        let code = match after {
            [high, low, ..] if *first == b'%' => hex(*high).zip(hex(*low)),
            _ => None,
        };
        let (byte, next) = match code {
            Some((high, low)) => (16 * high + low, &after[2..]),
            None => (*first, after),
        };
        bytes.push(byte);
        rest = next;
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

fn hex(digit: u8) -> Option<u8> {
    char::from(digit).to_digit(16).map(|value| value as u8)
}

/// The beginning of a text that may be long.
pub(super) fn shortened(text: &str) -> String {
    const MOST: usize = 60;
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::decoded;

    #[test]
    fn percent_codes_are_decoded_and_others_stay() {
        assert_eq!(decoded("a%20b%C3%A9%2"), "a bé%2");
        assert_eq!(decoded("100%zz%41"), "100%zzA");
    }
}
